"""Many cases in direct contact at once: one row per case."""

import time
from dataclasses import dataclass

import numpy as np

from fastncm.direct.columns import (
    surface_case_advice,
    surface_case_columns,
    surface_curve_columns,
)
from fastncm.direct.lowering import lower_surface
from fastncm.direct.solving import solve_surfaces
from fastncm.path.surface_reduce import Summary, summarise_surfaces
from fastncm.scene import CaseGroup, Scene

Array = np.ndarray


@dataclass(frozen=True)
class SurfaceCases:
    """Answers to the C cases of a group.

    cases: columns of `surface_case_units`, each (C,). curves: columns of `surface_curve_units`,
    each (C P,), with `case` the row in the table; empty where they are not asked for. shape_paths,
    solves, seconds_compiled as in `fastncm.cases.ChunkResult`.
    """

    cases: dict[str, Array]
    curves: list[dict[str, Array]]
    shape_paths: int
    solves: int
    seconds_compiled: float


def surface_scale_only_names(scene: Scene) -> frozenset[str]:
    """Dotted names that change only the scale of this scene's answers: cases that differ in nothing
    else share one dimensionless problem."""
    names = {"finger.width"}
    if not scene.model.shear:
        names |= {"finger.young", "finger.poisson", "finger.shear_modulus"}
    elif scene.finger.shear_modulus is None:  # it follows from young
        names.add("finger.young")
    return frozenset(names)


def solve_surface_cases(group: CaseGroup, curves: bool, sentences: list[str]) -> SurfaceCases:
    """Solve all cases of a group whose finger touches with its own side. sentences: of advice; what
    is said of one case alone is added."""
    lowered = lower_surface(group)
    count = len(group.rows)
    cases: dict[str, Array] = {}
    parts = []
    solves, compiled = 0, 0.0
    begin = time.perf_counter()
    for solved in solve_surfaces(lowered, shapes=False):
        compiled += time.perf_counter() - begin
        solves += solved.trace.rows.shape[0] * solved.trace.rows.shape[1]
        design = np.full(len(lowered.positions), -1)
        design[solved.designs] = np.arange(len(solved.designs))
        chosen = np.flatnonzero(design[lowered.problem_of] >= 0)
        own = design[lowered.problem_of[chosen]]
        summaries = summarise_surfaces(
            solved.trace.rows, lowered.sense[solved.designs], lowered.turn
        )
        summary = Summary(*(values[own] for values in summaries))
        told = surface_case_advice(
            solved.trace.rows, lowered, chosen, own, summary.status, sentences
        )
        columns = surface_case_columns(summary, lowered, chosen, told)
        for name, values in columns.items():
            cases.setdefault(name, np.empty(count, dtype=values.dtype))[chosen] = values
        if curves:
            curve = surface_curve_columns(solved.trace.rows, lowered, chosen, own)
            curve["case"] = np.repeat(group.rows[chosen], lowered.positions.shape[1])
            parts.append(curve)
        begin = time.perf_counter()
    return SurfaceCases(cases, parts, len(lowered.positions), solves, compiled)
