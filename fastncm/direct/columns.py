"""The tables of scenes in direct contact: how a trace's rows become their columns.

Columns, order and units are those of `fastncm.columns`, which every scene shares; positions are
angles where the base turns, and a contact that is no point has an interval.
"""

import numpy as np

from fastncm.columns import CASE_UNITS, CURVE_UNITS
from fastncm.direct.lowering import LoweredSurface
from fastncm.path import surface_rows as rows
from fastncm.path.surface_reduce import Summary
from fastncm.path.surface_way import AFRESH, COLD, EARLIER
from fastncm.scene import Scene
from fastncm.sqp import status

Array = np.ndarray

_WORDS = np.array(status.WORDS, dtype=object)
_ADVICE = np.array(status.ADVICE, dtype=object)
#: A row whose contact force may be wrong by more than this part says so.
_COARSE = 0.05
#: Columns of a curve that only direct contact has.
_EXTRA_UNITS = {"contact_from_m": "m", "contact_to_m": "m", "advice": ""}


def surface_curve_units(scene: Scene) -> dict[str, str]:
    """Column of a curve to its unit ("1": a pure number, "": a word)."""
    return CURVE_UNITS | _EXTRA_UNITS | {"position": scene.position_unit}


def surface_case_units(scene: Scene) -> dict[str, str]:
    """Column of the cases table to its unit."""
    return CASE_UNITS | {"peak_position": scene.position_unit}


def position_scale(lowered: LoweredSurface, chosen: Array) -> Array:
    """(C,) by which the chosen cases' positions are multiplied: m for lengths, 1 for angles."""
    length: Array = lowered.scale.length[chosen]
    return length if lowered.scene.position_unit == "m" else np.ones_like(length)


def surface_curve_columns(
    table: Array, lowered: LoweredSurface, chosen: Array, design: Array
) -> dict[str, Array]:
    """Columns of a curve, each (C P,), of the chosen cases, from the rows of their designs.

    table: (D, P, rows.COLUMNS); chosen: (C,) cases of `lowered`; design: (C,) each one's in the
    table. A row that is not solved has no numbers but its position; one without contact has no
    contact point.
    """
    picked = table[design]
    number = picked[:, :, rows.STATUS].astype(np.int64)
    solved = number <= status.NO_CONTACT
    touching = number == status.CONVERGED
    length = lowered.scale.length[chosen, None]
    force = lowered.scale.force[chosen, None]
    strain = lowered.scale.strain[chosen, None]

    def where(shown: Array, column: int, unit: Array | float = 1.0) -> Array:
        return np.where(shown, picked[:, :, column] * unit + 0.0, np.nan)  # no -0.0

    def whole(column: int) -> Array:
        return np.where(touching, picked[:, :, column], 0.0).astype(np.int64)

    columns = {
        "position": picked[:, :, rows.POSITION] * position_scale(lowered, chosen)[:, None],
        "status": _WORDS[number],
        "force_x_N": where(solved, rows.FORCE_X, force),
        "force_y_N": where(solved, rows.FORCE_Y, force),
        "insertion_force_N": where(solved, rows.INSERTION, force),
        "normal_force_N": where(solved, rows.NORMAL, force),
        "friction_force_N": where(solved, rows.FRICTION, force),
        "contacts": whole(rows.CONTACTS),
        "sticking": whole(rows.STICKING),
        "contact_s_m": where(touching, rows.S_MEAN, length),
        "contact_x_m": where(touching, rows.X_MEAN, length),
        "contact_y_m": where(touching, rows.Y_MEAN, length),
        "tip_x_m": where(solved, rows.TIP_X, length),
        "tip_y_m": where(solved, rows.TIP_Y, length),
        "tip_angle_rad": where(solved, rows.TIP_ANGLE),
        "energy_J": where(solved, rows.ENERGY, force * length),
        "max_strain": where(solved, rows.STRAIN, strain),
        "iterations": picked[:, :, rows.ITERATIONS].astype(np.int64),
        "kkt_residual": picked[:, :, rows.RESIDUAL],
        "error_estimate": where(solved, rows.ESTIMATE),
        "contact_from_m": where(touching, rows.S_FROM, length),
        "contact_to_m": where(touching, rows.S_TO, length),
        "advice": _advice(picked, number, lowered, chosen),
    }
    return {
        name: np.ascontiguousarray(columns[name]).ravel()
        for name in surface_curve_units(lowered.scene)
        if name in columns
    }


def _advice(picked: Array, number: Array, lowered: LoweredSurface, chosen: Array) -> Array:
    """What to do about each row (C, P), with the figures that are at hand; mostly nothing."""
    advice: Array = _ADVICE[number]
    length = lowered.scale.length[chosen]
    for case, place in zip(*np.nonzero(number == status.INFEASIBLE), strict=True):
        overlap = picked[case, place, rows.OVERLAP] * length[case]
        if overlap > 0.0:
            advice[case, place] += f" The overlap is {overlap:.4g} m."
    unseen = (number == status.NO_CONTACT) & (picked[:, :, rows.OVERLAP] > 0.0)
    for case, place in zip(*np.nonzero(unseen), strict=True):
        overlap = picked[case, place, rows.OVERLAP] * length[case]
        advice[case, place] = (
            f"No node touches, but between two nodes the target lies about {overlap:.4g} m in the "
            "finger's side: use a larger solver.intervals."
        )
    estimate = np.where(number == status.CONVERGED, picked[:, :, rows.ESTIMATE], 0.0)
    for case, place in zip(*np.nonzero(estimate > _COARSE), strict=True):
        advice[case, place] = (
            f"The contact force may be wrong by {estimate[case, place]:.0%}: the contact takes up "
            "few of the intervals; use a larger solver.intervals."
        )
    unit = position_scale(lowered, chosen)
    for case, place in zip(*np.nonzero(picked[:, :, rows.RELEASED] > 0.0), strict=True):
        at, energy = picked[case, place, rows.SNAP], picked[case, place, rows.RELEASED]
        energy *= lowered.scale.force[chosen[case]] * length[case]
        advice[case, place] = (
            f"The path passes a limit point at {_place(at * unit[case], lowered)}: the finger "
            f"snaps from there and releases {energy:.4g} J. {advice[case, place]}"
        ).strip()
    lost, touching = picked[:, :, rows.LOST], number == status.CONVERGED
    failed = (number > status.NO_CONTACT) & (number != status.INFEASIBLE)
    ended = failed | (touching & (lost == AFRESH))
    for case, place in zip(*np.nonzero(ended), strict=True):
        advice[case, place] += _end_of_branch(picked[case, place], unit[case], lowered)
    elsewhere = touching & ((lost == AFRESH) | (lost == EARLIER))
    advice[elsewhere] += (
        " The finger could not be followed to here, as where it snaps: the shape is the one found "
        "beyond, which may be another than the path leads to. Contacts are taken to have slid for "
        "long; the error estimate covers any other friction."
    )
    advice[touching & (lost == COLD)] += (
        " The path begins here in contact: the shape is that of a finger that the target has met "
        "from beside, on the side that touches, and contacts are taken to have slid for long. "
        "There may be other shapes: energy_J and tip_angle_rad tell them apart."
    )
    for case, place in zip(*np.nonzero(ended | elsewhere | (lost == COLD)), strict=True):
        advice[case, place] = advice[case, place].strip()
    return advice


def _place(position: float, lowered: LoweredSurface) -> str:
    """A position of the path in words."""
    if lowered.scene.position_unit == "m":
        return f"{position:.9g} m"
    return f"{position:.9g} rad ({np.degrees(position):.6f} degrees)"


def _end_of_branch(row: Array, unit: float, lowered: LoweredSurface) -> str:
    """What is known of the end of the branch before a row that is not solved."""
    said, at, critical = "", row[rows.END], row[rows.CRITICAL]
    if np.isfinite(at) and not (row[rows.RELEASED] > 0.0 and at == row[rows.SNAP]):
        said = f" The branch ends at {_place(at * unit, lowered)}."
    if critical > 0.0:
        said += (
            f" The finger slides on to this position with friction.mu up to {critical:.7f}: with "
            "more, friction locks."
        )
    elif critical == 0.0:
        said += " It ends before this position without friction, too."
    return said


def surface_case_advice(
    table: Array,
    lowered: LoweredSurface,
    chosen: Array,
    design: Array,
    said: Array,
    sentences: list[str],
) -> Array:
    """What each of the chosen cases is told (C,): the place of it in `sentences`, which begins with
    `status.ADVICE` and is added to.

    That of its status `said` (C,); or what its first row says that is not solved, or, where all
    are, that is on another branch than the one before. Arrays as in `surface_curve_columns`.
    """
    failed: Array = table[:, :, rows.STATUS] > status.NO_CONTACT
    left = (table[:, :, rows.RELEASED] > 0.0) | (table[:, :, rows.LOST] == AFRESH)
    told = np.where(failed.any(axis=1, keepdims=True), failed, left)
    cases = np.flatnonzero((failed | left).any(axis=1)[design])
    first = np.argmax(told, axis=1)[design[cases]]
    picked = table[design[cases], first][:, None]
    number = picked[:, :, rows.STATUS].astype(np.int64)
    places: Array = said.copy()
    places[cases] = len(sentences) + np.arange(len(cases))
    sentences += _advice(picked, number, lowered, chosen[cases])[:, 0].tolist()
    return places


def surface_case_columns(
    summary: Summary, lowered: LoweredSurface, chosen: Array, advice: Array
) -> dict[str, Array]:
    """Columns of the cases table, each (C,), from the summaries (C,) of the chosen cases and what
    they are told (C,); failed cases have no numbers. Words are numbers (`status.WORDS`; places of
    sentences)."""
    force, length = lowered.scale.force[chosen], lowered.scale.length[chosen]
    failed = summary.status > status.NO_CONTACT

    def where(values: Array, unit: Array | float = 1.0) -> Array:
        return np.where(failed, np.nan, values * unit)

    columns = {
        "status": summary.status,
        "peak_force_N": where(summary.peak_force, force),
        "peak_position": where(summary.peak_position, position_scale(lowered, chosen)),
        "max_strain": where(summary.strain, lowered.scale.strain[chosen]),
        "insertion_work_J": where(summary.work, force * length),
        "retention_force_N": where(summary.retention_force, force),
        "withdrawal_work_J": where(summary.withdrawal_work, force * length),
        "hysteresis_J": where(
            summary.work + summary.withdrawal_work - summary.stored, force * length
        ),
        "error_estimate": where(summary.estimate),
        "positions": np.full(len(chosen), lowered.positions.shape[1]),
        "iterations": summary.iterations,
        "advice": advice,
    }
    return {name: columns[name] for name in surface_case_units(lowered.scene) if name in columns}
