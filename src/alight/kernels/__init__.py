"""From expression to running code: CasADi's virtual machine, or C compiled on the spot."""

from alight.kernels.auto import Auto
from alight.kernels.compilers import CompilerUnavailable
from alight.kernels.program import Program, Runner
from alight.kernels.select import BACKENDS, runner

__all__ = ["BACKENDS", "Auto", "CompilerUnavailable", "Program", "Runner", "runner"]
