"""Many cases of a scene at once, in this process: one row per case, nothing in Python per solve."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fastncm import columns as names
from fastncm.direct.cases import solve_surface_cases, surface_scale_only_names
from fastncm.direct.columns import surface_case_units, surface_curve_units
from fastncm.errors import SceneError
from fastncm.first_use import prepare
from fastncm.lowering import Lowered, lower
from fastncm.lowering import scale_only_names as jaw_scale_only_names
from fastncm.path import reduce
from fastncm.path.peaks import refine_peaks
from fastncm.path.reduce import summarise
from fastncm.scene import CaseGroup, Scene, tabulate
from fastncm.sqp import status
from fastncm.trace import Solved, kkt_tolerance, solve_paths

if TYPE_CHECKING:
    import pandas as pd

Array = np.ndarray

#: Columns that hold although the way out failed (friction locks the finger in).
_WAY_IN = ("peak_force_N", "peak_position", "insertion_work_J")


@dataclass(frozen=True)
class ChunkResult:
    """Answers to C cases.

    columns: columns of `case_units`, each (C,), in the order of the cases given; those of words
    hold, for each case, the place of its word in `words`.
    curves: columns of `curve_units`, each (C N,), with `case` the index of the case, or None.
    shape_paths: different dimensionless paths that were solved; solves: shapes; seconds_compiled:
    time inside compiled code. groups: the validated cases that were solved.
    """

    columns: dict[str, Array]
    words: dict[str, list[str]]
    curves: dict[str, Array] | None
    shape_paths: int
    solves: int
    seconds_compiled: float
    groups: list[CaseGroup]

    @property
    def cases(self) -> dict[str, Array]:
        """The columns with their words written out."""
        return {
            name: np.array(self.words[name], dtype=object)[column] if name in self.words else column
            for name, column in self.columns.items()
        }


def case_units(scene: Scene) -> dict[str, str]:
    """Column of the cases table to its unit ("1": a pure number, "": a word). Those of the way out
    (`columns.WITHDRAWAL`) are there where some case has one."""
    return dict(names.CASE_UNITS) if scene.jaw else surface_case_units(scene)


def curve_units(scene: Scene) -> dict[str, str]:
    """Column of a curve to its unit."""
    return dict(names.CURVE_UNITS) if scene.jaw else surface_curve_units(scene)


def scale_only_names(scene: Scene) -> frozenset[str]:
    """Dotted names that change only the scale of this scene's answers: cases that differ in nothing
    else share one dimensionless problem."""
    return jaw_scale_only_names(scene) if scene.jaw else surface_scale_only_names(scene)


def solve_cases(scene: Scene, frame: "pd.DataFrame") -> "pd.DataFrame":
    """Solve the scene once per row of `frame`, whose columns are dotted names.

    Returns one row per case with the same index: the columns given, then those of the cases table
    (status, peak_force_N, peak_position, max_strain, ...). ``.attrs`` holds `shape_paths` and
    `solves`. Raises SceneError for a bad name or value; what does not converge is a row with a
    status.
    """
    import pandas as pd  # workers of a sweep start without it

    columns = {str(name): frame[name].to_numpy() for name in frame.columns}
    prepare(scene)
    result = solve_chunk(scene, columns, count=len(frame))
    table = pd.DataFrame({**columns, **result.cases}, index=frame.index)
    table.attrs.update(shape_paths=result.shape_paths, solves=result.solves)
    return table


def solve_chunk(
    scene: Scene,
    columns: Mapping[str, Sequence[object] | Array],
    curves: bool = False,
    count: int | None = None,
) -> ChunkResult:
    """Solve all cases of `columns` (dotted name to one entry per case); `count` where there are no
    columns."""
    if not columns and count is not None and count != 1:
        if count == 0:
            raise SceneError("there are no cases: the table has no rows")
        columns = {"friction.mu": np.full(count, scene.friction.mu)}
    groups = tabulate(scene, columns)
    total = sum(len(group.rows) for group in groups)
    cases = {
        name: np.empty(total, dtype=np.int64 if name in names.WHOLE else np.float64)
        for name in names.case_columns(scene, columns)
    }
    sentences = list(status.ADVICE)
    parts: list[dict[str, Array]] = []
    shape_paths, solves, compiled = 0, 0, 0.0
    for group in groups:
        if group.scene.jaw is None:
            done = solve_surface_cases(group, curves, sentences)
            for name, column in cases.items():
                column[group.rows] = done.cases.get(name, np.nan)
            parts += done.curves
            shape_paths += done.shape_paths
            solves += done.solves
            compiled += done.seconds_compiled
            continue
        lowered = lower(group)
        by_design = np.argsort(lowered.problem_of, kind="stable")
        edges = np.searchsorted(lowered.problem_of[by_design], np.arange(len(lowered.jaw) + 1))
        shape_paths += len(lowered.jaw)
        begin = time.perf_counter()
        for solved in solve_paths(lowered):
            chosen, design = _cases_of(solved, by_design, edges)
            summary, extra = _summarise(solved, lowered, chosen, design)
            compiled += time.perf_counter() - begin
            solves += int(solved.trace.solves[0]) + extra
            number = summary[:, reduce.STATUS].astype(np.int64)
            _fill(cases, group.rows[chosen], lowered, chosen, summary)
            ends = solved.trace.ends
            cases["advice"][group.rows[chosen]] = names.advice(
                ends, lowered, chosen, design, number, sentences
            )
            if curves:
                curve = names.curve_columns(solved.trace.rows, lowered, chosen, design)
                curve["case"] = np.repeat(group.rows[chosen], lowered.positions.shape[1])
                parts.append(curve)
            begin = time.perf_counter()
    return ChunkResult(
        columns=cases,
        words={"status": list(status.WORDS), "advice": sentences},
        curves=_joined(parts) if curves else None,
        shape_paths=shape_paths,
        solves=solves,
        seconds_compiled=compiled,
        groups=groups,
    )


def _cases_of(solved: Solved, by_design: Array, edges: Array) -> tuple[Array, Array]:
    """The cases that use the solved designs: ``(cases, index of each one's design in `solved`)``.

    by_design: (C,) cases sorted by design; edges: (D + 1,) where each design's cases begin there.
    """
    counts = edges[solved.designs + 1] - edges[solved.designs]
    design = np.repeat(np.arange(len(solved.designs)), counts)
    begin = np.repeat(edges[solved.designs], counts)
    within = np.arange(len(design)) - np.repeat(np.cumsum(counts) - counts, counts)
    return by_design[begin + within], design


def _summarise(solved: Solved, lowered: Lowered, chosen: Array, design: Array) -> tuple[Array, int]:
    """Summaries (`path.reduce`) of the chosen cases, smooth peaks refined, and the shapes that
    took."""
    table, positions = solved.trace.rows, lowered.positions.shape[1]
    turned = np.ascontiguousarray(lowered.turned[chosen])
    summary = np.empty((len(chosen), reduce.COLUMNS))
    summarise(table, positions, design, turned, summary)
    tolerance = kkt_tolerance(lowered.scene.solver.rtol)
    extra = refine_peaks(solved.problem, tolerance, solved.trace, design, turned, summary)
    return summary, extra


def _fill(
    cases: dict[str, Array], at: Array, lowered: Lowered, chosen: Array, summary: Array
) -> None:
    """Write summaries in SI units into rows `at` of the case columns; failed cases have no
    numbers, but for the way in where only the way out failed."""
    scale = lowered.scale
    length, force = scale.length[chosen], scale.force[chosen]
    number = summary[:, reduce.STATUS].astype(np.int64)
    failed = number > status.NO_CONTACT
    back = lowered.turn < lowered.positions.shape[1] - 1
    lost = summary[:, reduce.WORK] + summary[:, reduce.WORK_BACK] - summary[:, reduce.STORED]
    values = {
        "peak_force_N": summary[:, reduce.PEAK_FORCE] * force,
        "peak_position": summary[:, reduce.PEAK_POSITION] * length,
        "max_strain": summary[:, reduce.STRAIN] * scale.strain[chosen],
        "insertion_work_J": summary[:, reduce.WORK] * force * length,
        "error_estimate": summary[:, reduce.ESTIMATE],
    }
    if "retention_force_N" in cases:
        values |= {
            "retention_force_N": np.where(back, summary[:, reduce.RETENTION] * force, np.nan),
            "withdrawal_work_J": np.where(
                back, summary[:, reduce.WORK_BACK] * force * length, np.nan
            ),
            "hysteresis_J": np.where(back, lost * force * length, np.nan),
        }
    failed_in = summary[:, reduce.STATUS_IN] > status.NO_CONTACT
    for name, value in values.items():
        cases[name][at] = np.where(failed_in if name in _WAY_IN else failed, np.nan, value)
    cases["status"][at] = number
    cases["positions"][at] = lowered.positions.shape[1]
    cases["iterations"][at] = summary[:, reduce.ITERATIONS].astype(np.int64)


def _joined(parts: list[dict[str, Array]]) -> dict[str, Array]:
    """All curves one behind the other, in the order of the cases: the columns that all have."""
    shared = [name for name in parts[0] if all(name in part for part in parts)]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in shared}
    order = np.argsort(joined["case"], kind="stable")
    return {name: column[order] for name, column in joined.items()}
