"""A design study: a scene, the axes that are varied, and what is asked of the result."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd

from fastncm.columns import WITHDRAWAL, case_columns
from fastncm.errors import SceneError
from fastncm.scene import Scene, tabulate
from fastncm.scene.kinds import is_number
from fastncm.scene.refusal import refusal, unknown
from fastncm.sweeping.axes import Axis, axis_values, plain_axis
from fastncm.sweeping.grid import Grid
from fastncm.sweeping.identity import case_keys
from fastncm.sweeping.samples import DRAWN, Samples, drawn, listed

CHECKED_ROWS = 100_000
"""Cases validated at once: bounds the memory of `Study.check`."""
MOST_CASES = 10**10
"""One byte is held for each."""
BEST = ("min", "max")
TEXT_COLUMNS = ("status", "advice")
"""Results of a case that are words; all others are numbers."""
LISTED = "list"
KINDS = ("grid", LISTED, *DRAWN)


@dataclass(frozen=True)
class Report:
    """Which designs are the best: the smallest or largest `column` within the limits.

    limits: column -> the largest value that is allowed.
    """

    column: str = "peak_force_N"
    best: str = "min"
    limits: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Design:
    """How the axes make cases.

    kind: "grid" (every combination), "list" (the i-th case has the i-th value of every axis), or a
    sample: "latin-hypercube", "sobol" (best with a power of two) or "halton", of `samples` cases
    drawn with `seed`.
    """

    kind: str = "grid"
    samples: int = 0
    seed: int = 0


@dataclass(frozen=True)
class Study:
    """Cases, made from axes or listed in a table, applied to a scene.

    axes: dotted name -> list of values, or {"linspace": [low, high, number]}, or the same with
    "geomspace"; where cases are drawn: {"uniform": [low, high]}, {"loguniform": [low, high]} or a
    list. The order of the axes numbers the cases of a grid, the last one varies fastest. Or a data
    frame: one row per case, dotted names as columns.
    curves: whether the long table of curves is written beside the table of cases.
    """

    scene: Scene
    axes: Mapping[str, Axis] | pd.DataFrame
    name: str = "study"
    curves: bool = False
    report: Report = Report()
    design: Design = Design()

    def __post_init__(self) -> None:
        if isinstance(self.axes, pd.DataFrame) and self.design == Design():
            object.__setattr__(self, "design", Design(LISTED))

    @cached_property
    def cases(self) -> Grid | Samples:
        """The cases by number. SceneError where the axes do not make any."""
        kind, samples, seed = self.design.kind, self.design.samples, self.design.seed
        if kind not in KINDS:
            raise _at("design.kind", unknown(str(kind), KINDS, "design"))
        if not list(self.axes):
            raise SceneError("a study needs at least one axis", name="axes")
        if kind == LISTED:
            return listed(self.axes)
        if isinstance(self.axes, pd.DataFrame):
            raise refusal("design.kind", kind, "'list' where the cases are a table")
        if kind == "grid":
            return Grid({name: axis_values(name, axis) for name, axis in self.axes.items()})
        for name, value, least in (("samples", samples, 1), ("seed", seed, 0)):
            if not isinstance(value, int) or isinstance(value, bool) or value < least:
                raise refusal(f"design.{name}", value, f"a whole number of at least {least}")
        return drawn(self.axes, kind, samples, seed)

    def check(self) -> None:
        """Refuse what cannot be swept, case by case and before anything is written (SceneError)."""
        if self.cases.size > MOST_CASES:
            raise SceneError(
                f"the axes make {self.cases.size:.3g} cases: must be {MOST_CASES:.0e} at most; "
                "cut the study along an axis",
                name="axes",
            )
        for start in range(0, self.cases.size, CHECKED_ROWS):
            rows = np.arange(start, min(start + CHECKED_ROWS, self.cases.size))
            try:
                tabulate(self.scene, self.cases.columns(rows))
            except SceneError as error:
                counted = f" (counted from case {start})" if start else ""
                raise SceneError(f"{error}{counted}", name=f"axes.{error.name}") from None
        self._check_report()

    def keys(self, case_ids: np.ndarray) -> np.ndarray:
        """The identities (`sweeping.identity`) of the cases, both shape (C,)."""
        return case_keys(tabulate(self.scene, self.cases.columns(case_ids)))

    def _check_report(self) -> None:
        columns = case_columns(self.scene, self.axes)
        known = [*self.axes, *(name for name in columns if name not in TEXT_COLUMNS)]
        if self.report.column in WITHDRAWAL and self.report.column not in columns:
            raise _at(
                "report.column",
                SceneError(f"{self.report.column} is there only where path.withdraw is true"),
            )
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
        """Plain values for JSON; `from_dict` turns them back.

        Listed cases, of which there may be millions, are not in it but their number and a digest.
        """
        return {
            "name": self.name,
            "scene": self.scene.to_dict(),
            "axes": self._plain_axes(),
            "design": {
                "kind": self.design.kind,
                "samples": self.design.samples,
                "seed": self.design.seed,
            },
            "curves": self.curves,
            "report": {
                "column": self.report.column,
                "best": self.report.best,
                "limits": dict(self.report.limits),
            },
        }

    def _plain_axes(self) -> dict[str, object]:
        if isinstance(self.axes, pd.DataFrame) or self.design.kind == LISTED:
            return {
                name: {"values": len(values), "digest": _digest(values)}
                for name, values in self.cases.axes.items()
            }
        return {name: plain_axis(axis) for name, axis in self.axes.items()}

    @classmethod
    def from_dict(
        cls,
        plain: Mapping,  # type: ignore[type-arg]
        listed_cases: pd.DataFrame | None = None,
    ) -> "Study":
        """The study of `to_dict`; `listed_cases`: its cases, where they are a list."""
        return cls(
            scene=Scene.from_dict(plain["scene"]),
            axes=plain["axes"] if listed_cases is None else listed_cases,
            name=plain["name"],
            curves=plain["curves"],
            report=Report(**plain["report"]),
            design=Design(**plain["design"]),
        )


def _digest(values: np.ndarray) -> str:
    """A short hash of a column."""
    data = repr(values.tolist()).encode() if values.dtype == object else values.tobytes()
    return hashlib.sha256(data).hexdigest()[:16]


def _at(name: str, error: SceneError) -> SceneError:
    """The same error, pointing to another name of the study file."""
    return SceneError(str(error), name=name)
