"""The host: a process of its own that ticks on absolute deadlines and waits for nobody."""
