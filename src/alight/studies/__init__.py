"""Many runs of a scenario: measures, the paper's variants, identification."""

from alight.studies.identified import Identified
from alight.studies.identify import identify
from alight.studies.measures import Measures, measure, run_and_measure

__all__ = ["Identified", "Measures", "identify", "measure", "run_and_measure"]
