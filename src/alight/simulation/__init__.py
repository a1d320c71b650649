"""The closed loop in time: one run, its recording, its verdict."""
