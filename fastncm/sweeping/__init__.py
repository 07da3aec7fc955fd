"""Design studies: full grids over a scene, solved on all cores into Parquet tables."""

from fastncm.sweeping.read import load
from fastncm.sweeping.run import BrokenOff, SweepRun, sweep
from fastncm.sweeping.study import Report, Study
from fastncm.sweeping.study_file import load_study

__all__ = ["BrokenOff", "Report", "Study", "SweepRun", "load", "load_study", "sweep"]
