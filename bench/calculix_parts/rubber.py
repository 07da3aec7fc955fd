"""Finite-element models of a rubber finger whose side is pressed against an ellipse."""

from collections.abc import Sequence

import numpy as np

from fastncm.scene import Scene

from .mesh import block, cuts, ruled
from .model import Model, Part, joined
from .snapfit import MM, Fineness

MATERIALS = {
    "St Venant-Kirchhoff": ("FINGER", "*ELASTIC"),
    "Ciarlet": ("CIARLET_EL", "*USER MATERIAL, CONSTANTS=2"),
}
"""Name and card of each law: CalculiX's linear elasticity, which with NLGEOM takes Green's strain
and loses its stiffness in strong compression, and a hyperelastic law that it knows by its name,
with the same stiffness in small strains."""
RIM = np.radians([130.0, 330.0])
"""The ellipse's parameter where it may touch."""
ASIDE = 100.0
"""The ellipse begins so much to the right of its path, mm, and comes in ..."""
COMING = 20.0
"""... in so much of the model's time."""
EVERY = 0.25
"""Spacing of the tables of motion, degrees."""


def rubber(scene: Scene, fineness: Fineness, degrees: Sequence[float], material: str) -> Model:
    """The finger at the first angle, against which the ellipse comes from the right; then the
    clamp turns to the other angles and the ellipse moves along. The model's time is the angle
    turned through in degrees."""
    start = np.radians(degrees[0])
    finger = finger_part(scene, fineness, start)
    centre = MM * np.array([ellipse_x(scene, start), scene.path.y]) + [ASIDE, 0.0]
    target = ellipse_part(scene, fineness, centre)
    nodes, parts = joined([finger, target])
    clamp = np.unique(finger.block.elements[:: fineness.along][:, [0, 3, 7]])
    sense = np.sign(degrees[-1] - degrees[0])
    times = COMING + np.abs(np.asarray(degrees) - degrees[0])
    table = np.union1d(np.arange(0.0, times[-1], EVERY), times)
    angle = start + sense * np.radians(np.maximum(table - COMING, 0.0))
    along = MM * (ellipse_x(scene, angle) - ellipse_x(scene, start))
    motions = [along - ASIDE * np.minimum(table / COMING, 1.0), 0.0 * table]
    driven = [(node, k, k - 1) for node in np.unique(parts["TARGET"]) for k in (1, 2)]
    for node in clamp:
        driven += [(node, 1, len(motions)), (node, 2, len(motions) + 1)]
        motions += list(turned(nodes[node], angle - start).T)
    young, poisson, (law, card) = (
        scene.finger.young / MM**2,
        scene.finger.poisson,
        MATERIALS[material],
    )
    return Model(
        nodes=nodes,
        parts=parts,
        materials={
            "FINGER": (law, f"{card}\n{young:.12g}, {poisson:g}"),
            "TARGET": ("TARGET", f"*ELASTIC\n{young:.12g}, {poisson:g}"),
        },
        surfaces={"SIDE": finger.faces("bottom"), "ELLIPSE": target.faces("bottom")},
        pairs=[("SIDE", "ELLIPSE")],
        stiffness=fineness.stiffness,
        clamp=clamp,
        motions=[np.column_stack([table, motion]) for motion in motions],
        driven=driven,
        times=times,
        width=MM * scene.finger.width,
    )


def ellipse_x(scene: Scene, angle: np.ndarray) -> np.ndarray:
    """Of the ellipse's centre where the base has the given angle (rad), m."""
    return scene.path.x + scene.path.speed_ratio * (angle - 0.5 * np.pi)


def turned(point: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Displacements (n, 2) of a point that turns about the origin by the given angles."""
    cos, sin = np.cos(angle) - 1.0, np.sin(angle)
    return np.column_stack([cos * point[0] - sin * point[1], sin * point[0] + cos * point[1]])


def finger_part(scene: Scene, fineness: Fineness, angle: float) -> Part:
    """The straight finger along the given direction, its right side at the block's bottom."""
    s = cuts([0.0, MM * scene.finger.length], [fineness.along])
    along = np.array([np.cos(angle), np.sin(angle)])
    left = np.array([-along[1], along[0]])
    axis = np.outer(MM * scene.finger.offset + s, along)
    half = 0.5 * MM * np.interp(s, s[[0, -1]], scene.finger.thickness)
    side = np.outer(half, left)
    grid = ruled(axis - side, axis + side, cuts([0.0, 1.0], [fineness.through]))
    return Part("FINGER", block(grid))


def ellipse_part(scene: Scene, fineness: Fineness, centre: np.ndarray) -> Part:
    """The ellipse's rim, one element deep."""
    axes = MM * np.array(scene.target.semi_axes)
    around = cuts(RIM, [round(axes.max() * np.ptp(RIM) / fineness.face)])
    rim = np.column_stack([np.cos(around), np.sin(around)])
    inner = centre + 0.95 * axes * rim
    return Part("TARGET", block(ruled(centre + axes * rim, inner, cuts([0.0, 1.0], [1]))))
