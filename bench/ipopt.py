"""How many times faster than IPOPT is direct contact, and do both find the same answer?

rubber-ellipse through CasADi and IPOPT (`ipopt_baseline.py`), the same discretisation: first the
answers, which tests compare with (data/ipopt_rubber_ellipse.csv: this file's own output, from a
program that shares nothing but the scene's description), then the CPU time, N = 90, 60 angles,
each warm-started from the last. Of IPOPT's two forms, "reduced" is the obvious one (25 to 120 ms a
solve were measured elsewhere) and "sparse" the fastest that we know of.

The finger reaches the angle of 126 degrees, where the undeformed finger overlaps the ellipse, from
a base turned away to 180 degrees, so that it lies below and to the left of the ellipse: its right
side touches. Straight from the undeformed finger, IPOPT finds a shape whose right side lies beyond
the ellipse, the finger inside.
"""

import json
import math
import time
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from ipopt_baseline import TOLERANCE, Baseline, Form
from support import DATA, markdown_table, print_table, read_json, write_json

import fastncm
from fastncm.direct.lowering import lower_surface
from fastncm.direct.solving import solve_surfaces
from fastncm.scene import Pose, Scene, tabulate

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
DESIGNS = 100
ROUNDS = 5
FORMS: tuple[Form, ...] = ("sparse", "reduced")


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

    ours, theirs = rounds()
    print(f"\nN = {SCENE.solver.intervals}, {ANGLES} angles, best of {ROUNDS} rounds:\n")
    print_table(
        ["", "µs a solve", *(f"times as fast as {form}" for form in theirs)],
        [
            [name, f"{1e6 * t:.3g}", *(f"{seconds / t:.0f}" for seconds in theirs.values())]
            for name, t in (ours | theirs).items()
        ],
    )
    apart = difference()
    print(f"\nlargest difference of a force along the path: {apart:.1e}")
    write_json(
        "ipopt",
        {
            "intervals": SCENE.solver.intervals,
            "angles": ANGLES,
            "designs": DESIGNS,
            "tolerance": TOLERANCE,
            "us_per_solve": {name: 1e6 * seconds for name, seconds in (ours | theirs).items()},
            "ratio": {
                name: {form: other / seconds for form, other in theirs.items()}
                for name, seconds in ours.items()
            },
            "force_difference": apart,
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


def rounds() -> tuple[dict[str, float], dict[str, float]]:
    """CPU seconds a solve, ours and IPOPT's, in turn in this process, best of the rounds."""
    table = pd.DataFrame({"path.y": np.linspace(0.1197, SCENE.path.y, DESIGNS)})
    lowered = lower_surface(tabulate(SCENE, {})[0])
    baselines = {form: Baseline(SCENE, form) for form in FORMS}
    runs = {
        "one path, compiled code": (ANGLES, lambda: list(solve_surfaces(lowered, shapes=False))),
        f"{DESIGNS} designs by solve_cases": (
            ANGLES * DESIGNS,
            lambda: fastncm.solve_cases(SCENE, table),
        ),
    }
    ours = dict.fromkeys(runs, math.inf)
    theirs: dict[str, float] = dict.fromkeys(FORMS, math.inf)
    for _, run in runs.values():
        run()  # compiles
    for _ in range(ROUNDS):
        for form, baseline in baselines.items():
            seconds = path_of(baseline)["seconds"].mean()
            theirs[form] = min(theirs[form], float(seconds))
        for name, (solves, run) in runs.items():
            begin = time.process_time()
            run()
            ours[name] = min(ours[name], (time.process_time() - begin) / solves)
    return ours, theirs


def path_of(baseline: Baseline) -> pd.DataFrame:
    """IPOPT's rows along the scene's own path."""
    start = list(approach(SCENE))
    path = [SCENE.pose(x) for x in np.linspace(SCENE.path.start, SCENE.path.stop, ANGLES)]
    return baseline.solve_path(start + path).iloc[len(start) :]


def difference() -> float:
    """Between our forces and IPOPT's along the path, relative to the force."""
    columns = ["force_x_N", "force_y_N"]
    theirs = path_of(Baseline(SCENE))[columns].to_numpy()
    ours = fastncm.solve(SCENE).frame()[columns].to_numpy()
    return float((np.hypot(*(ours - theirs).T) / np.hypot(*theirs.T)).max())


def headlines() -> list[str]:
    """For the first page."""
    figures, _ = read_json("ipopt")
    ours = min(figures["ratio"], key=lambda name: figures["us_per_solve"][name])
    ratio = figures["ratio"][ours]
    return [
        f"rubber-ellipse with N = {figures['intervals']}: {figures['us_per_solve'][ours]:.3g} µs a "
        f"solve, {ratio['sparse']:.0f} times as fast as IPOPT in the best form known, "
        f"{ratio['reduced']:.0f} times in the obvious one (the goal was 1,000); the forces differ "
        f"by {figures['force_difference']:.0e} at most."
    ]


def section() -> str:
    """The report's part."""
    figures, about = read_json("ipopt")
    rows = []
    for name, us in figures["us_per_solve"].items():
        ratios = figures["ratio"].get(name)
        cells = [f"{ratios[form]:.0f}" if ratios else "-" for form in FORMS]
        rows.append([name if ratios else f"IPOPT, {name}", f"{us:.4g}", *cells])
    return "\n\n".join(
        [
            "## Direct contact against IPOPT",
            f"`bench/ipopt.py`, {about}: rubber-ellipse with N = {figures['intervals']} along "
            f"{figures['angles']} angles, the same discretisation through CasADi and IPOPT "
            f"(tolerance {figures['tolerance']:.0e}), warm-started, CPU time on one core. "
            '"Sparse" keeps the positions as unknowns, the fastest form that we know of; '
            '"reduced" writes them out as sums, as one would at first.',
            markdown_table(
                ["", "µs a solve", *(f"times as fast as {form}" for form in FORMS)], rows
            ),
            "Largest difference of a force along the path: "
            f"{figures['force_difference']:.0e} of the force.",
        ]
    )


if __name__ == "__main__":
    main()
