"""Design studies: full grids over a scene, solved on all cores into Parquet tables."""

from fastncm.sweep.read import load
from fastncm.sweep.run import BrokenOff, SweepRun, sweep
from fastncm.sweep.study import Report, Study
from fastncm.sweep.study_file import load_study

__all__ = ["BrokenOff", "Report", "Study", "SweepRun", "load", "load_study", "sweep"]
