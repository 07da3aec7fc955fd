"""Design studies: many cases of a scene, solved on one machine or many, into Parquet tables.

Names are loaded when they are first used, so that a worker loads only what solves its tasks.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fastncm.sweeping.read import load
    from fastncm.sweeping.run import BrokenOff, SweepRun, sweep
    from fastncm.sweeping.study import Design, Report, Study
    from fastncm.sweeping.study_file import load_study, read_cases

_HOMES = {
    "BrokenOff": "run",
    "Design": "study",
    "Report": "study",
    "Study": "study",
    "SweepRun": "run",
    "load": "read",
    "load_study": "study_file",
    "read_cases": "study_file",
    "sweep": "run",
}
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


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'fastncm.sweeping' has no attribute {name!r}")
    return getattr(import_module(f"fastncm.sweeping.{_HOMES[name]}"), name)
