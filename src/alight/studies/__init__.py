"""Many runs of a scenario: measures, the paper's variants, identification."""

from alight.studies.identify import Identified, identify
from alight.studies.measures import Measures, measure, run_and_measure

__all__ = ["Identified", "Measures", "identify", "measure", "run_and_measure"]
