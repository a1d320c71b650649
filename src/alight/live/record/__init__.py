"""The recorder: a process that follows the host's telemetry and keeps each run in a file."""
