"""Alight against the tools that its users would take instead, on one closed loop."""
