"""Jaws that touch in two places, slip off a corner or snap, as shooting cases and as scenes."""

from shooting import ShootingCase

import fastncm
from fastncm.scene import Scene

STEEP = ShootingCase(a=(0.057, 0.0002), b=(0.0668, -0.0262), path_y=-0.0195)
"""A steep straight edge, which comes to lie flat on the block's face and then slips off it."""
SNAPPING = ShootingCase(
    a=(0.057, 0.0218527),
    b=(0.0814125, 0.0025831),
    path_y=0.01305698,
    target_radius=0.00791234,
    jaw_radius=0.1027423,
)
"""A circle that the finger lets slip: found among random scenes, one row of its path failed."""
CUP = ShootingCase(
    a=(0.057, 0.0100), b=(0.0700, 0.0010), path_y=0.0120, target_radius=0.0120, jaw_radius=0.0095,
    convex=False,
)  # fmt: skip
"""A circle too large for the cup: it lies on both ends of the arc."""


def scene(case: ShootingCase, **changes: object) -> Scene:
    """The scene of a shooting case, solved with enough modes for ten digits."""
    name = "snapfit-circle" if case.target_radius else "snapfit-corner"
    values: dict[str, object] = {
        "jaw.shape": "arc" if case.jaw_radius else "segment",
        "jaw.a": case.a,
        "jaw.b": case.b,
        "path.y": case.path_y,
        "path.start": "touch",
        "friction.mu": 0.0,
        "solver.order": 16,
    }
    if case.jaw_radius:
        values |= {"jaw.radius": case.jaw_radius, "jaw.convex": case.convex}
    if case.target_radius:
        values["target.radius"] = case.target_radius
    return fastncm.load_scene(name).replace(values | changes)
