"""A design study: a scene, the axes that are varied, and what is asked of the result."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fastncm.columns import CASE_UNITS
from fastncm.errors import SceneError
from fastncm.scene import Scene, tabulate
from fastncm.scene.kinds import is_number
from fastncm.scene.refusal import refusal, unknown
from fastncm.sweeping.axes import Axis, axis_values, plain_axis
from fastncm.sweeping.grid import Grid

CHECKED_ROWS = 100_000
"""Cases validated at once: bounds the memory of `Study.check`."""
BEST = ("min", "max")
TEXT_COLUMNS = ("status", "advice")
"""Results of a case that are words; all others are numbers."""


@dataclass(frozen=True)
class Report:
    """Which designs are the best: the smallest or largest `column` within the limits.

    limits: column -> the largest value that is allowed.
    """

    column: str = "peak_force_N"
    best: str = "min"
    limits: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """A full grid over the axes, applied to a scene.

    axes: dotted name -> list of values, or {"linspace": [low, high, number]}, or the same with
    "geomspace"; their order numbers the cases, the last one varies fastest.
    curves: whether the long table of curves is written beside the table of cases.
    """

    scene: Scene
    axes: Mapping[str, Axis]
    name: str = "study"
    curves: bool = False
    report: Report = Report()

    @cached_property
    def grid(self) -> Grid:
        return Grid({name: axis_values(name, axis) for name, axis in self.axes.items()})

    def check(self) -> None:
        """Refuse what cannot be swept, case by case and before anything is written (SceneError)."""
        if not self.axes:
            raise SceneError("a study needs at least one axis", name="axes")
        for start in range(0, self.grid.size, CHECKED_ROWS):
            rows = np.arange(start, min(start + CHECKED_ROWS, self.grid.size))
            try:
                tabulate(self.scene, self.grid.columns(rows))
            except SceneError as error:
                counted = f" (counted from case {start})" if start else ""
                raise SceneError(f"{error}{counted}", name=f"axes.{error.name}") from None
        self._check_report()

    def _check_report(self) -> None:
        known = [*self.axes, *(name for name in CASE_UNITS if name not in TEXT_COLUMNS)]
        if self.report.column not in known:
            raise _at("report.column", unknown(self.report.column, known, "column"))
        if self.report.best not in BEST:
            raise refusal("report.best", self.report.best, "'min' or 'max'")
        for column, limit in self.report.limits.items():
            if column not in known:
                raise _at("report.limits", unknown(column, known, "column"))
            if not is_number(limit) or not np.isfinite(limit):
                raise refusal(f"report.limits.{column}", limit, "a finite number")

    def to_dict(self) -> dict[str, object]:
        """Plain values for JSON; `from_dict` turns them back."""
        return {
            "name": self.name,
            "scene": self.scene.to_dict(),
            "axes": {name: plain_axis(axis) for name, axis in self.axes.items()},
            "curves": self.curves,
            "report": {
                "column": self.report.column,
                "best": self.report.best,
                "limits": dict(self.report.limits),
            },
        }

    @classmethod
    def from_dict(cls, plain: Mapping) -> "Study":  # type: ignore[type-arg]
        """The study of `to_dict`."""
        return cls(
            scene=Scene.from_dict(plain["scene"]),
            axes=plain["axes"],
            name=plain["name"],
            curves=plain["curves"],
            report=Report(**plain["report"]),
        )


def _at(name: str, error: SceneError) -> SceneError:
    """The same error, pointing to another name of the study file."""
    return SceneError(str(error), name=name)
