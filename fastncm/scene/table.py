"""Many cases of a scene at once: columns under dotted names to arrays, grouped by options."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastncm.scene.columns import FloatArray, IntArray
from fastncm.scene.description import DEFAULTS, Scene
from fastncm.scene.geometry import Values
from fastncm.scene.names import QUANTITIES
from fastncm.scene.resolve import Group, first_case, resolve


@dataclass(frozen=True)
class CaseGroup:
    """Cases that share all options, so that one compiled problem type serves them.

    The options: all of `model`, `friction.model`, `solver`, the shapes of jaw and target,
    `jaw.convex`, `path.steps`, and whether the path starts at the first touch.
    """

    scene: Scene  # the first of the cases; its options hold for all
    rows: IntArray  # (n,) indices of the cases in the table, ascending
    values: dict[str, FloatArray]  # each (n,), read only, SI units, keys as `Quantity.keys`


def tabulate(
    scene: Scene, columns: Mapping[str, Sequence[object] | NDArray[np.generic]]
) -> list[CaseGroup]:
    """Validate C cases, the scene with one entry of each column applied, and group them.

    `columns`: dotted name to C entries; without columns there is one case, the scene itself.
    `values` holds, in m, Pa and 1: length, thickness_clamp, thickness_tip, width, young, poisson,
    shear_modulus, a_x, a_y, b_x, b_y, jaw_radius (NaN for a segment), return_angle, target_radius
    (NaN for a block), target_length (NaN for an endless block and a circle), start (NaN for
    "touch"), stop, y, mu. Raises SceneError naming name, value and case.
    """
    groups = resolve(DEFAULTS | scene.flat(), columns)
    return [
        CaseGroup(
            scene=Scene.from_flat(scene.name, scene.description, first_case(group)),
            rows=group.rows,
            values=_filled(group),
        )
        for group in groups
    ]


def _filled(group: Group) -> Values:
    """All keys, each (n,): shapes that are not there are NaN, the shear modulus is worked out."""
    values = {key: np.array([np.nan]) for quantity in QUANTITIES for key in quantity.keys}
    values |= group.values
    shear = values["shear_modulus"]
    isotropic = values["young"] / (2 * (1 + values["poisson"]))
    values["shear_modulus"] = np.where(np.isnan(shear), isotropic, shear)
    return {key: np.broadcast_to(value, group.rows.shape) for key, value in values.items()}
