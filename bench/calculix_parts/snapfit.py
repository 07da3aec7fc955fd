"""Finite-element models of the two snap-fit scenes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fastncm.scene import Scene

from .mesh import block, cuts, ruled
from .model import Face, Model, Part, joined

MM = 1e3
RIGID = 1e3
"""Stiffness of the jaw in multiples of the finger's."""
CORNER = 0.4
"""Length of either face at a sharp corner whose nodes must not enter the other body, mm."""
RIM = np.radians([225.0, 275.0])
"""The part of the circle that may touch."""
UNDERSIDE = 10.0
"""Length of the block's underside, as much as the path needs, mm."""


@dataclass(frozen=True)
class Fineness:
    """Elements along and through the finger, length of the small faces in contact in mm, and the
    penalty in MPa/mm."""

    along: int
    through: int
    face: float
    stiffness: float

    @property
    def small(self) -> int:
        """Small faces along CORNER."""
        return max(round(CORNER / self.face), 1)


def snapfit(
    scene: Scene, fineness: Fineness, positions: Sequence[float], lift: float = 0.0
) -> Model:
    """The finger with its jaw, and a target that goes from its place at the first position (m),
    where it must not touch, to the others. It begins `lift` mm above its path and is down at the
    second position. The model's time is the way in mm."""
    finger, jaw = finger_part(scene, fineness), jaw_part(scene, fineness)
    place = _circle if scene.target.shape == "circle" else _block
    begin = MM * np.array([positions[0], scene.path.y]) + [0.0, lift]
    target, edge = place(scene, fineness, begin)
    nodes, parts = joined([finger, jaw, target])
    clamp, moved = np.flatnonzero(nodes[:, 0] < 1e-9), np.unique(parts["TARGET"])
    travel = MM * (positions[0] - np.asarray(positions[1:]))
    times = lift + travel
    young, poisson = scene.finger.young / MM**2, scene.finger.poisson
    stiff = "RIGID", f"*ELASTIC\n{RIGID * young:.12g}, {poisson:g}"
    return Model(
        nodes=nodes,
        parts=parts,
        materials={
            "FINGER": ("FINGER", f"*ELASTIC\n{young:.12g}, {poisson:g}"),
            "JAW": stiff,
            "TARGET": stiff,
        },
        surfaces={
            "LINE": jaw.faces("top"),
            "CORNER": [
                *jaw.faces("top", slice(fineness.small)),
                *jaw.faces("left", slice(-fineness.small, None)),
            ],
            "EDGE": edge,
            "UNDERSIDE": target.faces("bottom"),
        },
        pairs=[("EDGE", "LINE"), ("CORNER", "UNDERSIDE")],
        stiffness=fineness.stiffness,
        clamp=clamp,
        motions=[
            np.column_stack([np.append(0.0, times), np.append(0.0, -travel)]),
            np.array([[0.0, 0.0], [times[0], -lift], [times[-1] + 1.0, -lift]]),
            np.array([[0.0, 0.0], [times[-1], 0.0]]),
        ],
        driven=[
            *((node, direction, direction - 1) for node in moved for direction in (1, 2)),
            *((node, direction, 2) for node in clamp for direction in (1, 2)),
        ],
        times=times,
        width=MM * scene.finger.width,
    )


def finger_part(scene: Scene, fineness: Fineness) -> Part:
    """The finger, along x from the clamp at the origin."""
    x = cuts([0.0, MM * scene.finger.length], [fineness.along])
    half = np.full(len(x), 0.5 * MM * scene.finger.thickness)
    low, high = np.column_stack([x, -half]), np.column_stack([x, half])
    return Part("FINGER", block(ruled(low, high, cuts([0.0, 1.0], [fineness.through]))))


def jaw_part(scene: Scene, fineness: Fineness) -> Part:
    """From the finger's tip section to the jaw's line or arc; small faces at corner a."""
    half = 0.5 * MM * scene.finger.thickness
    a, b = MM * np.array(scene.jaw.a), MM * np.array(scene.jaw.b)
    reach, rise = np.hypot(*(b - a)), a[1] + half
    u = cuts([0.0, CORNER / reach, 1.0], [fineness.small, 8])
    top = a + np.outer(u, b - a)
    if scene.jaw.shape == "arc":
        top = on_arc(a, b, MM * scene.jaw.radius, scene.jaw.convex, u)
    bottom = np.column_stack([np.linspace(a[0], b[0], len(u)), np.full(len(u), -half)])
    heights = cuts(
        [0.0, 2 * half / rise, 1.0 - CORNER / rise, 1.0], [fineness.through, 2, fineness.small]
    )
    return Part("JAW", block(ruled(bottom, top, heights)))


def on_arc(a: np.ndarray, b: np.ndarray, radius: float, convex: bool, u: np.ndarray) -> np.ndarray:
    """Points (n, 2) on the arc from a to b at the parts u of its length; outside is on the left
    from a to b, and a convex arc bulges towards it."""
    chord = b - a
    half = np.arcsin(0.5 * np.hypot(*chord) / radius)
    left = np.array([-chord[1], chord[0]]) / np.hypot(*chord)
    sense = 1.0 if convex else -1.0
    centre = 0.5 * (a + b) - sense * left * radius * np.cos(half)
    angle = sense * half * (1.0 - 2.0 * u)
    cos, sin = np.cos(angle), np.sin(angle)
    out = sense * radius * left
    return centre + np.column_stack([cos * out[0] - sin * out[1], sin * out[0] + cos * out[1]])


def _circle(scene: Scene, fineness: Fineness, centre: np.ndarray) -> tuple[Part, list[Face]]:
    """The rim, one element deep, and its faces."""
    radius = MM * scene.target.radius
    angle = cuts(RIM, [round(radius * np.ptp(RIM) / fineness.face)])
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    inner = centre + (radius - 1.0) * rim
    part = Part("TARGET", block(ruled(centre + radius * rim, inner, cuts([0.0, 1.0], [1]))))
    return part, part.faces("bottom")


def _block(scene: Scene, fineness: Fineness, corner: np.ndarray) -> tuple[Part, list[Face]]:
    """The block's lower left part, and the small faces at its sharp corner."""
    x = corner[0] + cuts([0.0, CORNER, UNDERSIDE], [fineness.small, 10])
    bottom = np.column_stack([x, np.full(len(x), corner[1])])
    rise = cuts([0.0, CORNER / 2.0, 1.0], [fineness.small, 1])
    part = Part("TARGET", block(ruled(bottom, bottom + [0.0, 2.0], rise)))
    small = slice(fineness.small)
    return part, [*part.faces("bottom", small), *part.faces("left", small)]
