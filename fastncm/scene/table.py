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
    `jaw.convex`, `finger.side`, `finger.profile`, `target.vertices`, `path.kind`, `path.steps`, and
    whether the path starts at the first touch.
    """

    scene: Scene  # the first of the cases; its options hold for all
    rows: IntArray  # (n,) indices of the cases in the table, ascending
    values: dict[str, FloatArray]  # each (n,), read only, SI units, keys as `Quantity.keys`


def tabulate(
    scene: Scene, columns: Mapping[str, Sequence[object] | NDArray[np.generic]]
) -> list[CaseGroup]:
    """Validate C cases, the scene with one entry of each column applied, and group them.

    `columns`: dotted name to C entries; without columns there is one case, the scene itself.
    `values` holds, in m, Pa, rad and 1, and NaN where a case has no such value: length,
    thickness_clamp, thickness_tip (the ends of a profile), width, young, poisson, shear_modulus,
    mu; of a jaw a_x, a_y, b_x, b_y, jaw_radius, return_angle; of the target target_radius,
    target_length (NaN: endless), semi_x, semi_y, tilt; of the path start (NaN for "touch"), stop,
    y; of direct contact offset, path_angle, path_x, speed_ratio. Raises SceneError naming name,
    value and case.
    """
    groups = resolve(DEFAULTS | scene.flat(), columns)
    return [
        CaseGroup(
            scene=Scene.from_flat(scene.headings(), first_case(group)),
            rows=group.rows,
            values=_filled(group),
        )
        for group in groups
    ]


def _filled(group: Group) -> Values:
    """All keys, each (n,): shapes that are not there are NaN, the shear modulus is worked out."""
    values = {key: np.array([np.nan]) for quantity in QUANTITIES for key in quantity.keys}
    values |= group.values
    profile = group.options.get("finger.profile")
    if isinstance(profile, tuple):
        values["thickness_clamp"] = np.array([profile[0][1]])
        values["thickness_tip"] = np.array([profile[-1][1]])
    shear = values["shear_modulus"]
    isotropic = values["young"] / (2 * (1 + values["poisson"]))
    values["shear_modulus"] = np.where(np.isnan(shear), isotropic, shear)
    return {key: np.broadcast_to(value, group.rows.shape) for key, value in values.items()}
