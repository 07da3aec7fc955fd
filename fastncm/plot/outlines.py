"""Outlines of finger, jaw and target in the plane, from a solved shape. Points in m, (n, 2)."""

import numpy as np
import pandas as pd

from fastncm.scene import Jaw, Scene

ARC_POINTS = 60


def finger_outline(scene: Scene, shape: pd.DataFrame) -> np.ndarray:
    """The finger's sides: half a thickness from the axis, along the section's direction psi."""
    half = np.interp(shape["s_m"], *np.transpose(scene.finger.stations)) / 2
    axis = shape[["x_m", "y_m"]].to_numpy()
    psi = shape["psi_rad"].to_numpy()
    across = half[:, None] * np.column_stack([-np.sin(psi), np.cos(psi)])
    return np.concatenate([axis + across, (axis - across)[::-1]])


def jaw_outline(scene: Scene, shape: pd.DataFrame) -> np.ndarray:
    """The jaw, carried along by the tip's section: its contour from a to b, closed at the tip.

    Shape (0, 2) where there is none.
    """
    if scene.jaw is None:
        return np.empty((0, 2))
    thickness = scene.finger.stations[-1][1]
    tip = np.array([scene.finger.length, 0.0])
    foot = [[scene.finger.length, -thickness / 2], [scene.finger.length, thickness / 2]]
    undeformed = np.concatenate([contour(scene.jaw), foot]) - tip
    last = shape.iloc[-1]
    cos, sin = np.cos(last["psi_rad"]), np.sin(last["psi_rad"])
    turned = undeformed @ np.array([[cos, sin], [-sin, cos]])
    jaw: np.ndarray = turned + [last["x_m"], last["y_m"]]
    return jaw


def contour(jaw: Jaw) -> np.ndarray:
    """The jaw's contact contour from a to b, undeformed: two points, or points of the arc."""
    a, b = np.array(jaw.a), np.array(jaw.b)
    if jaw.shape == "segment" or jaw.radius is None:
        return np.array([a, b])
    chord = b - a
    left = np.array([-chord[1], chord[0]]) / np.hypot(*chord)  # the outside
    bulge = 1.0 if jaw.convex else -1.0
    centre = (a + b) / 2 - bulge * left * np.sqrt(jaw.radius**2 - chord @ chord / 4)
    half = np.arcsin(np.hypot(*chord) / 2 / jaw.radius)
    middle = np.arctan2(*(bulge * left)[::-1])
    angles = middle + bulge * np.linspace(half, -half, ARC_POINTS)
    arc: np.ndarray = centre + jaw.radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return arc


def target_outline(scene: Scene, position: float, reach: float) -> np.ndarray:
    """The target at a position (m, or rad where the base turns).

    Of a block or a half-plane the part within `reach` m of its corner or reference point.
    """
    target, pose = scene.target, scene.pose(position)
    turn = np.array(
        [
            [np.cos(target.tilt), np.sin(target.tilt)],
            [-np.sin(target.tilt), np.cos(target.tilt)],
        ]
    )
    if target.shape == "block":
        outline = reach * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    elif target.shape == "half-plane":
        outline = reach * np.array([[-1, 0], [-1, -1], [1, -1], [1, 0]]) @ turn
    elif target.shape == "polygon":
        outline = np.array(target.vertices)
    else:
        axes = target.semi_axes or (target.radius, target.radius)
        angles = np.linspace(0, 2 * np.pi, 181)
        outline = axes * np.column_stack([np.cos(angles), np.sin(angles)]) @ turn
    shifted: np.ndarray = outline + [pose.target_x, pose.target_y]
    return shifted
