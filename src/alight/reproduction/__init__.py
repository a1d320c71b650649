"""Both experiments of the paper, every published number and claim beside what is simulated."""

from alight.reproduction.claims import Claim
from alight.reproduction.reproduce import Reproduction, reproduce

__all__ = ["Claim", "Reproduction", "reproduce"]
