"""A simulated bench: CANopen nodes of drives and transducer on a bus, and the plant behind them."""

from alight.live.devices.cia402.simulated.bench import SimulatedBench

__all__ = ["SimulatedBench"]
