"""The columns of the tables that people read: their units, and how a trace's rows become them."""

from collections.abc import Container

import numpy as np

from fastncm.lowering import Lowered
from fastncm.path import rows
from fastncm.path.friction import (
    FORCE_X,
    FORCE_Y,
    FRICTION,
    HOLDS,
    INSERTION,
    NORMAL,
    turned_forces,
)
from fastncm.path.snap import END_POSITION
from fastncm.scene import Scene
from fastncm.sqp import status

Array = np.ndarray

#: Column of the cases table to its unit ("1": a pure number, "": a word).
CASE_UNITS = {
    "status": "",
    "peak_force_N": "N",
    "peak_position": "m",
    "max_strain": "1",
    "insertion_work_J": "J",
    "retention_force_N": "N",
    "withdrawal_work_J": "J",
    "hysteresis_J": "J",
    "error_estimate": "1",
    "positions": "1",
    "iterations": "1",
    "advice": "",
}

#: Columns of the way out.
WITHDRAWAL = ("retention_force_N", "withdrawal_work_J", "hysteresis_J")
#: Columns of whole numbers; words are held as their places in a list.
WHOLE = ("status", "positions", "iterations", "advice")

#: Column of a curve to its unit.
CURVE_UNITS = {
    "position": "m",
    "status": "",
    "force_x_N": "N",
    "force_y_N": "N",
    "insertion_force_N": "N",
    "normal_force_N": "N",
    "friction_force_N": "N",
    "contacts": "1",
    "sticking": "1",
    "contact_s_m": "m",
    "contact_x_m": "m",
    "contact_y_m": "m",
    "tip_x_m": "m",
    "tip_y_m": "m",
    "tip_angle_rad": "rad",
    "energy_J": "J",
    "max_strain": "1",
    "iterations": "1",
    "kkt_residual": "1",
    "error_estimate": "1",
}

_WORDS = np.array(status.WORDS, dtype=object)


def curve_columns(table: Array, lowered: Lowered, chosen: Array, design: Array) -> dict[str, Array]:
    """Columns of CURVE_UNITS, each (C N,), of the chosen cases, from the rows of their designs.

    table: (D, N and events, rows.COLUMNS); chosen: (C,) cases of `lowered`; design: (C,) each one's
    in the table. A row that is not solved has no numbers but its position; one without contact has
    no contact point.
    """
    positions = lowered.positions.shape[1]
    turned = np.ascontiguousarray(lowered.turned[chosen])
    forces = np.empty((len(chosen), positions, 7))
    turned_forces(table, design, turned, forces)
    picked = table[design, :positions]
    number = picked[:, :, rows.STATUS].astype(np.int64)
    number[(number == status.CONVERGED) & (forces[:, :, HOLDS] == 0.0)] = status.NO_EQUILIBRIUM
    solved = number <= status.NO_CONTACT
    touching = number == status.CONVERGED
    length = lowered.scale.length[chosen, None]
    force = lowered.scale.force[chosen, None]

    def where(shown: Array, values: Array) -> Array:
        return np.where(shown, values, np.nan)

    columns = {
        "position": picked[:, :, rows.POSITION] * length,
        "status": _WORDS[number],
        "force_x_N": where(solved, forces[:, :, FORCE_X] * force),
        "force_y_N": where(solved, forces[:, :, FORCE_Y] * force),
        "insertion_force_N": where(solved, forces[:, :, INSERTION] * force + 0.0),  # no -0.0
        "normal_force_N": where(solved, forces[:, :, NORMAL] * force),
        "friction_force_N": where(solved, forces[:, :, FRICTION] * force),
        "contacts": np.where(touching, picked[:, :, rows.CONTACTS], 0.0).astype(np.int64),
        "sticking": np.where(touching, picked[:, :, rows.STICKING], 0.0).astype(np.int64),
        "contact_s_m": where(touching, np.broadcast_to(length, touching.shape)),
        "contact_x_m": where(touching, picked[:, :, rows.CONTACT_X] * length),
        "contact_y_m": where(touching, picked[:, :, rows.CONTACT_Y] * length),
        "tip_x_m": where(solved, picked[:, :, rows.TIP_X] * length),
        "tip_y_m": where(solved, picked[:, :, rows.TIP_Y] * length),
        "tip_angle_rad": where(solved, picked[:, :, rows.TIP_ANGLE]),
        "energy_J": where(solved, picked[:, :, rows.ENERGY] * force * length),
        "max_strain": where(solved, picked[:, :, rows.STRAIN] * lowered.scale.strain[chosen, None]),
        "iterations": picked[:, :, rows.ITERATIONS].astype(np.int64),
        "kkt_residual": picked[:, :, rows.RESIDUAL],
        "error_estimate": where(solved, picked[:, :, rows.ESTIMATE]),
    }
    return {name: np.ascontiguousarray(values).ravel() for name, values in columns.items()}


def case_columns(scene: Scene, varied: Container[str]) -> list[str]:
    """The columns of the cases table for cases of `scene` that vary the names `varied`: those of
    the way out only where some case has one."""
    withdraws = scene.path.withdraw or "path.withdraw" in varied
    return [name for name in CASE_UNITS if withdraws or name not in WITHDRAWAL]


def advice(
    ends: Array,
    lowered: Lowered,
    chosen: Array,
    design: Array,
    number: Array,
    sentences: list[str],
) -> Array:
    """For the status numbers (C,) of the chosen cases, the places (C,) of what is advised in
    `sentences`: it begins with `status.ADVICE`, and what is said of one case alone is added.

    ends: (D, ENDS) of a trace: where a branch of equilibria ended; chosen: (C,) cases of `lowered`;
    design: (C,) each one's in `ends`.
    """
    said = number.copy()
    told = (number != status.NO_CONTACT) & (number <= status.NO_EQUILIBRIUM)
    for i in np.flatnonzero(told & (ends[design, END_POSITION] != 0.0)):
        length, force = lowered.scale.length[chosen[i]], lowered.scale.force[chosen[i]]
        _, position, mu, energy = ends[design[i]].tolist()
        said[i] = len(sentences)
        rubs = bool(lowered.mu[lowered.problem_of[chosen[i]]] > 0.0)
        sentences.append(
            status.end_of_branch(
                int(number[i]), rubs, position * length, mu, energy * force * length
            )
        )
    return said
