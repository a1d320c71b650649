"""What sampling does to the loop: the paper's theorems are about continuous time."""

from alight.theory.sampled.adaptation import AdaptationSteps, adaptation_steps
from alight.theory.sampled.linear import LinearLoop, linear_loop
from alight.theory.sampled.loops import AtRate, SampledLoop, linear_loops, sampled_loops
from alight.theory.sampled.report import Sampled, sampled
from alight.theory.sampled.rest import Rest, rest_in_contact, rest_in_free_motion
from alight.theory.sampled.spectrum import Spectrum, growth, largest_sample_time, spectrum

__all__ = [
    "AdaptationSteps",
    "AtRate",
    "LinearLoop",
    "Rest",
    "Sampled",
    "SampledLoop",
    "Spectrum",
    "adaptation_steps",
    "growth",
    "largest_sample_time",
    "linear_loop",
    "linear_loops",
    "rest_in_contact",
    "rest_in_free_motion",
    "sampled",
    "sampled_loops",
    "spectrum",
]
