"""Design studies: many cases of a scene, solved on one machine or many, into Parquet tables."""

from fastncm.sweeping.read import load
from fastncm.sweeping.run import BrokenOff, SweepRun, sweep
from fastncm.sweeping.study import Design, Report, Study
from fastncm.sweeping.study_file import load_study, read_cases

__all__ = [
    "BrokenOff",
    "Design",
    "Report",
    "Study",
    "SweepRun",
    "load",
    "load_study",
    "read_cases",
    "sweep",
]
