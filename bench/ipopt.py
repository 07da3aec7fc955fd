"""How many times faster than IPOPT is direct contact, and do both find the same answer?

rubber-ellipse through CasADi and IPOPT (`ipopt_baseline.py`), the same discretisation: first the
answers, which tests compare with (data/ipopt_rubber_ellipse.csv: this file's own output, from a
program that shares nothing but the scene's description), then the time, N = 90, 60 angles, each
warm-started from the last. Of IPOPT's two forms, "reduced" is the obvious one (25 to 120 ms a solve
were measured elsewhere) and "sparse" the fastest that we know of.

The finger reaches the angle of 126 degrees, where the undeformed finger overlaps the ellipse, from
a base turned away to 180 degrees, so that it lies below and to the left of the ellipse: its right
side touches. Straight from the undeformed finger, IPOPT finds a shape whose right side lies beyond
the ellipse, the finger inside.
"""

import json
import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from ipopt_baseline import TOLERANCE, Baseline, Form
from support import DATA, print_table, write_json

import fastncm
from fastncm.scene import Pose, Scene

SCENE = fastncm.load_scene("rubber-ellipse")
DEGREES = (126, 120, 114, 108, 102, 96, 90, 84, 78)
STEPS_BETWEEN = 3
"""IPOPT may leave the branch where the steps are too long."""
APPROACH = np.linspace(math.pi, SCENE.path.start, 20)
DISTANCES = (0.058, 0.055, 0.05, 0.045, 0.04, 0.035, 0.03, 0.025, 0.0225)
"""Positions of the plane in m: the finger's tip touches first, its clamp at 0.0212."""
CASES: dict[str, Mapping[str, object]] = {
    "N = 90": {},
    "N = 180": {"solver.intervals": 180},
    "N = 360": {"solver.intervals": 360},
    "section psi+gamma": {"solver.intervals": 180, "model.section": "psi+gamma"},
    "no shear": {"model.shear": False},
    "axis": {"model.surface": "axis"},
    "thin tip": {"finger.thickness": [0.030, 0.0003]},
    "profile": {"finger.profile": [[0.0, 0.03], [0.05, 0.022], [0.06, 0.012], [0.1524, 0.017]]},
    "tilted": {"target.tilt": 0.3},
    "circle": {"target.shape": "circle", "target.radius": 0.067},
    "plane": {
        "target.shape": "half-plane",
        "target.tilt": math.pi / 2,
        "path.kind": "translation",
        "path.angle": 1.3,
        "path.start": 0.06,
        "path.stop": 0.0225,
    },
}
ANGLES = 60
ROUNDS = 3


def main() -> None:
    table = pd.concat(answers(name, changes) for name, changes in CASES.items())
    if not table["success"].all():
        raise SystemExit(f"IPOPT failed:\n{table[~table['success']]}")
    columns = [column for column in table if column not in ("success", "iterations", "seconds")]
    file = DATA / "ipopt_rubber_ellipse.csv"
    table[columns].to_csv(file, index=False, float_format="%.12g")
    shown = table[table["case"] == "N = 180"]
    print(shown[columns[3:]].to_string(index=False, float_format=lambda x: f"{x:.7g}"))
    print(f"\n{file}")

    times = {form: seconds_per_solve(form) for form in ("sparse", "reduced")}
    print(f"\nN = {SCENE.solver.intervals}, {ANGLES} angles, best of {ROUNDS} rounds:\n")
    print_table(["", "ms a solve"], [[form, f"{1e3 * t:.3g}"] for form, t in times.items()])
    write_json(
        "ipopt",
        {
            "intervals": SCENE.solver.intervals,
            "angles": ANGLES,
            "tolerance": TOLERANCE,
            "ms_per_solve": {form: 1e3 * seconds for form, seconds in times.items()},
        },
    )


def answers(name: str, changes: Mapping[str, object]) -> pd.DataFrame:
    """The rows of one case, one per position of the data file."""
    scene = SCENE.replace(changes)
    turning = scene.path.kind == "rotation"
    chosen = np.radians(DEGREES) if turning else np.array(DISTANCES)
    path = fine(chosen)
    rows = Baseline(scene).solve_path([*approach(scene), *(scene.pose(x) for x in path)])
    picked = rows.iloc[len(rows) - len(path) :: STEPS_BETWEEN].reset_index(drop=True)
    heading = pd.DataFrame({"case": name, "changes": json.dumps(changes), "position": chosen})
    return pd.concat([heading, picked], axis=1)


def approach(scene: Scene) -> Sequence[Pose]:
    """The way to the path's start from a place without contact."""
    if scene.path.kind == "translation":
        return []
    first = scene.pose(SCENE.path.start)
    return [first._replace(base_angle=angle) for angle in APPROACH]


def fine(positions: np.ndarray) -> np.ndarray:
    """The positions with steps in between."""
    at = np.arange((len(positions) - 1) * STEPS_BETWEEN + 1) / STEPS_BETWEEN
    path: np.ndarray = np.interp(at, np.arange(len(positions)), positions)
    return path


def seconds_per_solve(form: Form) -> float:
    """Of IPOPT along the scene's path, best of the rounds."""
    baseline = Baseline(SCENE, form)
    start = list(approach(SCENE))
    path = [SCENE.pose(x) for x in np.linspace(SCENE.path.start, SCENE.path.stop, ANGLES)]
    rounds = (baseline.solve_path(start + path)["seconds"][len(start) :] for _ in range(ROUNDS))
    return min(float(seconds.mean()) for seconds in rounds)


if __name__ == "__main__":
    main()
