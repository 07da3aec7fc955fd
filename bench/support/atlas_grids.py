"""The atlas's grids: one or two ranges at a time on the shipped scenes; and condition numbers."""

from collections.abc import Iterator

import extremes
import numpy as np
import pandas as pd
import shooting_many

import fastncm
from fastncm.curve import JawCurve
from fastncm.path import rows
from fastncm.scene import Scene

POSITIONS = {"snapfit-circle": 0.066, "snapfit-corner": 0.062}
TAPERS = np.geomspace(1e-3, 1e3, 13)
ORDERS = (2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)
LENGTHS = np.geomspace(1e-6, 1e3, 10)
MODULI = np.geomspace(1e-3, 1e15, 10)
SLENDERNESSES = np.geomspace(1e-5, 0.5, 10)
INTERVALS = (4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048)
FINEST = 10_000
ANGLE = np.radians(102.0)
TWIN_CORNERS, TWIN_SIZE = 5, 0.08
TWIN_INTERVALS = (8, 16, 32, 64, 128)
APART = (1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2)
"""Of two corners, in units of the polygon's size (m)."""
POINTS = (10, 30, 100, 300, 1000, 3000)


def grid() -> pd.DataFrame:
    """All grids in one table: grid, x, y, status, error, error_estimate, rounding, condition."""
    parts = (_tapers(), _shears(), _scales(), _intervals(), _twins(), _points())
    return pd.DataFrame([row for part in parts for row in part])


def _shot(scene: Scene, position: float) -> dict[str, object]:
    """One row at a position, with its true error by shooting."""
    frame = fastncm.solve(scene, positions=[position]).frame()
    row = frame.iloc[-1]
    outcome = {"status": row["status"], "error_estimate": row["error_estimate"]}
    if row["status"] != "converged":
        return outcome | {"error": np.nan, "rounding": np.nan}
    case = _columns(scene)
    zero = np.zeros(1, dtype=int)
    length, unit = case["finger.length"][0], shooting_many.force_unit(case, zero)[0]
    claim = shooting_many.Claim(
        np.array([[row["force_x_N"], row["force_y_N"]]]) / unit,
        np.array([[row["contact_x_m"], row["contact_y_m"]]]) / length,
        np.array([[row["tip_x_m"] / length, row["tip_y_m"] / length, row["tip_angle_rad"]]]),
    )
    fingers = shooting_many.fingers(case, zero, np.array([position]))
    truth = shooting_many.exact(fingers, claim, np.zeros(1))
    error = abs(row["normal_force_N"] / unit / truth.normal[0] - 1.0) if truth.found[0] else np.nan
    rounding = truth.rounding[0] / abs(truth.normal[0])
    return outcome | {"error": error, "rounding": rounding}


def _columns(scene: Scene) -> dict[str, np.ndarray]:
    """A scene as a table of one case."""
    values = scene.to_dict()
    columns: dict[str, np.ndarray] = {}
    for part, fields in values.items():
        if isinstance(fields, dict):
            for name, value in fields.items():
                columns[f"{part}.{name}"] = np.array([value], dtype=None)
    thickness = columns["finger.thickness"]
    if thickness.ndim == 1:
        columns["finger.thickness"] = np.repeat(thickness[:, None], 2, axis=1)
    columns.setdefault("jaw.return_angle", np.array([0.5 * np.pi]))
    columns.setdefault("target.length", np.array(["endless"], dtype=object))
    if columns["jaw.shape"][0] == "segment":
        columns.pop("jaw.radius", None)
    return columns


def _tapers() -> Iterator[dict[str, object]]:
    for name, position in POSITIONS.items():
        scene = fastncm.load_scene(name)
        for taper in TAPERS:
            for order in ORDERS:
                ends = (0.0032 * min(1.0, 5.0 / taper), 0.0032 * min(taper, 5.0))
                changes = {"finger.thickness": ends, "solver.order": order}
                yield {"grid": f"{name}: taper and order", "x": order, "y": taper} | _shot(
                    scene.replace(changes), position
                )


def _shears() -> Iterator[dict[str, object]]:
    for name, position in POSITIONS.items():
        scene = fastncm.load_scene(name)
        for slenderness in SLENDERNESSES:
            for order in ORDERS:
                thick = 0.057 * slenderness
                changes = {"finger.thickness": thick, "model.shear": True, "solver.order": order}
                yield {
                    "grid": f"{name}: w/L with shear and order", "x": order, "y": slenderness
                } | _shot(scene.replace(changes), position)  # fmt: skip


def _scales() -> Iterator[dict[str, object]]:
    """Everything as large, and Young's modulus: the dimensionless answer stays the same."""
    scene = fastncm.load_scene("snapfit-circle")
    for length in LENGTHS:
        times = length / 0.057
        for young in MODULI:
            changes = {
                "finger.length": length, "finger.thickness": 0.0032 * times,
                "finger.width": 0.0095 * times, "finger.young": young,
                "jaw.a": (0.057 * times, 0.0105 * times),
                "jaw.b": (0.0762 * times, 0.0016 * times), "target.radius": 0.0089 * times,
                "path.y": 0.0105 * times, "path.stop": 0.06 * times,
            }  # fmt: skip
            yield {"grid": "snapfit-circle: L and E", "x": young, "y": length} | _shot(
                scene.replace(changes), 0.066 * times
            )


def _intervals() -> Iterator[dict[str, object]]:
    """rubber-ellipse against the finest intervals."""
    scene = fastncm.load_scene("rubber-ellipse")

    def solved(taper: float, intervals: int) -> pd.Series:
        ends = (0.03 * min(1.0, 2.0 / taper), 0.03 * min(taper, 2.0))
        made = scene.replace({"finger.thickness": ends, "solver.intervals": intervals})
        return fastncm.solve(made, positions=[np.radians(126.0), ANGLE]).frame().iloc[-1]

    for taper in TAPERS[::2]:
        finest = solved(taper, FINEST)
        truth = np.array([finest["force_x_N"], finest["force_y_N"]], dtype=float)
        for intervals in INTERVALS:
            row = solved(taper, intervals)
            force = np.array([row["force_x_N"], row["force_y_N"]], dtype=float)
            yield {
                "grid": "rubber-ellipse: taper and N", "x": intervals, "y": taper,
                "status": row["status"], "error_estimate": row["error_estimate"],
                "error": np.hypot(*(force - truth)) / np.hypot(*truth),
                "rounding": finest["error_estimate"],
            }  # fmt: skip


def _twins() -> Iterator[dict[str, object]]:
    """rubber-ellipse with a polygon in place of the ellipse, each corner split into two that are
    `apart` from each other: almost the same constraint twice. Against single corners; that the
    target is smaller is in `rounding`."""
    scene = fastncm.load_scene("rubber-ellipse")
    angles = 2.0 * np.pi * (np.arange(TWIN_CORNERS) + 0.3) / TWIN_CORNERS
    corners = TWIN_SIZE * np.column_stack([np.cos(angles), np.sin(angles)])
    ways = [np.roll(corners, shift, axis=0) - corners for shift in (1, -1)]
    ways = [way / np.hypot(*way.T)[:, None] for way in ways]
    for intervals in TWIN_INTERVALS:
        for apart in (0.0, *APART):
            twins = np.stack([corners + 0.5 * apart * TWIN_SIZE * way for way in ways], axis=1)
            split = corners if apart == 0.0 else twins.reshape(-1, 2)
            changes = {"target.shape": "polygon", "target.vertices": split.tolist(),
                       "solver.intervals": intervals, "path.steps": 4}  # fmt: skip
            last = fastncm.solve(scene.replace(changes)).frame().iloc[-1]
            force = np.array([last["force_x_N"], last["force_y_N"]], dtype=float)
            if apart == 0.0:
                truth = force
                continue
            yield {
                "grid": "two corners apart and N", "x": apart, "y": intervals,
                "status": last["status"], "error_estimate": last["error_estimate"],
                "error": np.hypot(*(force - truth)) / np.hypot(*truth), "rounding": 10.0 * apart,
            }  # fmt: skip


def _points() -> Iterator[dict[str, object]]:
    """rubber-ellipse with M points on the target, many for each interval: nearly dependent
    constraints. Against the finest intervals with the closest places. The estimate knows nothing
    of the points."""
    scene = fastncm.load_scene("rubber-ellipse")
    angles = [np.radians(126.0), ANGLE]
    finest = fastncm.solve(scene.replace({"solver.intervals": FINEST}), positions=angles).frame()
    truth = finest[["force_x_N", "force_y_N"]].iloc[-1].to_numpy(dtype=float)
    for intervals in INTERVALS[:6]:
        for points in POINTS:
            changes = {"solver.contact": "points-on-target", "solver.points": points}
            made = scene.replace(changes | {"solver.intervals": intervals})
            row = fastncm.solve(made, positions=angles).frame().iloc[-1]
            force = row[["force_x_N", "force_y_N"]].to_numpy(dtype=float)
            yield {
                "grid": "rubber-ellipse: points (10b) and N", "x": points, "y": intervals,
                "status": row["status"], "error_estimate": np.nan,
                "error": np.hypot(*(force - truth)) / np.hypot(*truth), "rounding": 0.0,
            }  # fmt: skip


def conditions(count: int = 15) -> pd.DataFrame:
    """Condition numbers of the KKT matrix at the last rows of random scenes without friction."""
    found = []
    for kind in extremes.JAW_KINDS:
        for index in range(count):
            changes = extremes.one(kind, index) | {"friction.mu": 0.0}
            scene = fastncm.load_scene(extremes.base_scene(kind)).replace(changes)
            curve = fastncm.solve(scene)
            if curve.frame()["contacts"].iloc[-1] == 1:
                found.append({"kind": kind, "index": index, "condition": _condition(curve)})
    return pd.DataFrame(found)


def _condition(curve: JawCurve) -> float:
    """Of the matrix of modes and contact, the contact's row scaled to length one, without the
    curvature of the contact itself."""
    problem, last = curve._solved.problem, len(curve) - 1
    row, u = curve._solved.trace.rows[0, last], curve._solved.trace.shapes[0, last]
    order = curve.order
    slope, end = problem.profile.slope[0, :order], problem.profile.end[0, :order]
    if len(u) > order:
        scale = 1.0 / np.sqrt(problem.shear_stiffness[0])
        slope = np.vstack([slope, scale * problem.profile.shear[0, :order]])
        end = np.concatenate([end, np.zeros(order)])
    theta = u @ slope
    weights = problem.rule.weights
    normal = row[[rows.NORMAL_X, rows.NORMAL_Y]]
    force = row[rows.FORCE] * normal
    pull = weights * (force[0] * np.cos(theta) + force[1] * np.sin(theta))
    hessian = np.eye(len(u)) + (slope * pull) @ slope.T
    arm = row[[rows.CONTACT_X, rows.CONTACT_Y]] - row[[rows.TIP_X, rows.TIP_Y]]
    turn = arm[0] * normal[1] - arm[1] * normal[0]
    across = weights * (normal[1] * np.cos(theta) - normal[0] * np.sin(theta))
    contact = slope @ across + turn * end
    contact = contact / np.linalg.norm(contact)
    matrix = np.block([[hessian, contact[:, None]], [contact[None, :], np.zeros((1, 1))]])
    return float(np.linalg.cond(matrix))
