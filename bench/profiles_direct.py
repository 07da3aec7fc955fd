"""Performance profiles (Dolan & Moré 2002) over random fingers in direct contact.

Fingers before an ellipse like rubber-ellipse, with random tapers and ellipses, followed along a few
angles, all solvers on the same N intervals. The optimisers start from a base that is turned away
(not timed), as in `bench/ipopt.py`. A solver solves a task where it converges in its own words and
its force is right at every position: within a tolerance of the discretised answer, which must lie
within `NEAR` of shooting on the continuum (`tests/shooting_surface.py`). The discretised answer is
IPOPT's tightest where shooting confirms it, else fastncm's. The cheapest of each solver's settings
that is accurate enough counts; what none solves counts as infinite time.
"""

import importlib.util
import math
import time
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
from profiles_parts.reading import draw, summary, times
from support import RESULTS, read_table, shooting_surface, write_table
from support.one_core import on_one_core
from support.rivals import relative_errors
from support.rivals_surface import SurfaceRival

import fastncm
from fastncm.direct.lowering import lower_surface
from fastncm.direct.solving import solve_surfaces
from fastncm.plot.style import empty_figure, save
from fastncm.scene import Pose, Scene, tabulate

SCENES = 60
SEED = 20261122
INTERVALS = 45
DEGREES = np.linspace(120.0, 96.0, 6)
APPROACH = 20
NEAR = 0.1
"""Of the discretised force to that of the continuum; N = 45 is off by 1 to 3 %."""
ACCURACIES = 1e-2, 1e-6
CASADI = importlib.util.find_spec("casadi") is not None
LADDERS: dict[str, tuple[float, ...]] = {
    "fastncm": (1e-6,),
    "SLSQP": (1e-4, 1e-7, 1e-10, 1e-13),
    "IPOPT": (1e-5, 1e-8, 1e-11),
}
"""Tolerances, from loose to tight; fastncm has none but N here."""
CAP = 10.0
"""CPU seconds at one position after which SLSQP is given up."""
ROUNDS = 2
FORCES = ["force_x_N", "force_y_N"]


@dataclass(frozen=True)
class Task:
    """A scene, and the continuum's forces (P, 2) in N at DEGREES."""

    scene: Scene
    truth: np.ndarray


def main() -> None:
    on_one_core()
    tasks, again = draw_tasks(SCENES)
    print(f"{len(tasks)} scenes, {again} drawn again")
    rows = []
    for number, task in enumerate(tasks):
        rows += runs(number, task)
    table = pd.DataFrame(rows)
    notes = {"seed": SEED, "drawn_again": again, "intervals": INTERVALS, "cap_s": CAP}
    write_table("profiles_direct", table, casadi=CASADI, **notes)
    picture(table)
    print(section())


def draw_tasks(count: int) -> tuple[list[Task], int]:
    """`count` scenes for which shooting finds the answer at all angles, and how many were drawn
    again because it does not: no contact, or one that reaches the finger's end."""
    random, tasks, again = np.random.default_rng(SEED), [], 0
    base = fastncm.load_scene("rubber-ellipse")
    while len(tasks) < count:
        semi = random.uniform(0.06, 0.12), random.uniform(0.045, 0.09)
        clamp, ratio = random.uniform(0.018, 0.036), random.uniform(0.3, 1.0)
        scene = base.replace(
            {
                "target.semi_axes": semi,
                "finger.thickness": (clamp, clamp * ratio),
                "path.y": semi[1] + random.uniform(0.045, 0.065),
                "solver.intervals": INTERVALS,
            }
        )
        try:
            tasks.append(Task(scene, continuum(scene)))
        except ValueError:
            again += 1
    return tasks, again


def continuum(scene: Scene) -> np.ndarray:
    """Forces (P, 2) in N by shooting, which starts from many intervals."""
    thickness = scene.finger.thickness
    assert isinstance(thickness, tuple) and scene.target.semi_axes is not None
    finger = shooting_surface.Finger(
        clamp=thickness[0], tip=thickness[1],
        semi_x=scene.target.semi_axes[0], semi_y=scene.target.semi_axes[1],
    )  # fmt: skip
    angles = np.radians(DEGREES)
    curve = fastncm.solve(scene.replace({"solver.intervals": 8 * INTERVALS}), positions=angles)
    found = []
    for i, row in enumerate(curve.frame().itertuples()):
        if row.status != "converged":
            raise ValueError(row.status)
        pose, moment = scene.pose(angles[i]), curve.shape(i)["moment_Nm"].iloc[0]
        start = [row.force_x_N, row.force_y_N, moment, row.contact_from_m, row.contact_to_m]
        centre = np.array([pose.target_x, pose.target_y])
        found.append(shooting_surface.solve(finger, angles[i], centre, np.array(start)).force)
    return np.array(found)


def runs(number: int, task: Task) -> list[dict[str, object]]:
    """A row for each solver and setting."""
    found = {
        (solver, step): solved(solver, task.scene, step)
        for solver, ladder in LADDERS.items()
        if solver != "IPOPT" or CASADI
        for step in ladder
    }
    truth = np.full_like(task.truth, np.nan)
    for solver in ("IPOPT", "fastncm"):
        tightest = [frame for (name, _), (frame, _) in found.items() if name == solver][-1:]
        for frame in tightest:
            near = relative_errors(frame, task.truth).max() < NEAR
            if near and frame["success"].all() and np.isnan(truth).all():
                truth = frame[FORCES].to_numpy(dtype=float)
    rows = []
    for (solver, step), (frame, seconds) in found.items():
        converged = bool(frame["success"].all())
        error = float(relative_errors(frame, truth).max()) if converged else math.inf
        rows.append(
            {
                "scene": number, "start": "warm", "solver": solver, "step": step,
                "converged": converged, "error": math.inf if math.isnan(error) else error,
                "seconds": seconds,
            }
        )  # fmt: skip
    return rows


def solved(solver: str, scene: Scene, step: float) -> tuple[pd.DataFrame, float]:
    """Rows at DEGREES (success, force_x_N, force_y_N) and the CPU seconds of their solves."""
    angles = np.radians(DEGREES)
    if solver == "fastncm":
        return _ours(scene, angles)
    first = scene.pose(angles[0])
    turned = np.linspace(math.pi, angles[0], APPROACH, endpoint=False)
    poses: list[Pose] = [first._replace(base_angle=angle) for angle in turned]
    poses += [scene.pose(angle) for angle in angles]
    if solver == "IPOPT":
        from ipopt_baseline import Baseline

        run = partial(Baseline(scene, "sparse", step).solve_path, poses)
    else:
        run = partial(SurfaceRival(scene, "SLSQP", step).follow, poses, CAP)
    frames = [run().iloc[APPROACH:].reset_index(drop=True) for _ in range(ROUNDS)]
    return frames[0], min(float(frame["seconds"].sum()) for frame in frames)


def _ours(scene: Scene, angles: np.ndarray) -> tuple[pd.DataFrame, float]:
    frame = fastncm.solve(scene, positions=angles).frame()
    frame = frame.assign(success=frame["status"] == "converged")
    lowered = lower_surface(tabulate(scene, {})[0], angles)
    best = math.inf
    for _ in range(5 * ROUNDS):
        begin = time.process_time()
        list(solve_surfaces(lowered, shapes=False))
        best = min(best, time.process_time() - begin)
    return frame, best


def picture(table: pd.DataFrame) -> None:
    """results/profiles_direct.png."""
    figure = empty_figure(9.0, 3.4)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, accuracy in zip(axes, ACCURACIES, strict=True):
        draw(ax, times(table, "warm", accuracy))
        ax.set_title(f"{len(DEGREES)} angles, force to {accuracy:.0e}", fontsize=10, loc="left")
        ax.set_xlabel("within this many times the time of the fastest")
    axes[0].set_ylabel("share of the scenes solved")
    axes[0].legend(frameon=False, fontsize=8, loc="lower right")
    save(figure, RESULTS / "profiles_direct.png")


def headlines() -> list[str]:
    """For the first page."""
    table, about = read_table("profiles_direct")
    wide = times(table, "warm", min(ACCURACIES))
    solved_by = np.isfinite(wide).sum()
    others = [name for name in wide.columns if name != "fastncm"]
    said = ", ".join(f"{name} {solved_by[name]}" for name in others)
    ratio = {
        name: (wide[name] / wide["fastncm"]).replace(math.inf, math.nan).median() for name in others
    }
    slower = " and ".join(f"{name} {ratio[name]:.0f} times" for name in others)
    return [
        f"Of {len(wide)} random fingers in direct contact (N = {about['intervals']}) fastncm "
        f"solves {solved_by['fastncm']} to {min(ACCURACIES):.0e} ({said}); {slower} as long."
    ]


def section() -> str:
    """The report's part."""
    table, about = read_table("profiles_direct")
    machine = about["machine"]
    assert isinstance(machine, dict)
    return "\n\n".join(
        [
            "## Performance profiles over random fingers in direct contact",
            f"`bench/profiles_direct.py`; {machine['cpu']}, SciPy {machine['scipy']}, revision "
            f"{machine['revision']}, {machine['date']}; seed {about['seed']}.",
            f"{table['scene'].nunique()} random fingers and ellipses ({about['drawn_again']} draws "
            "had no contact at some angle, or one that shooting on the continuum does not close, "
            f"and were drawn again), {len(DEGREES)} angles, N = {about['intervals']} for all. "
            "The optimisers come from a base that is turned away, which is not timed; derivatives "
            "are exact. IPOPT has the sparse form."
            + ("" if about["casadi"] else " CasADi is not installed here: no IPOPT."),
            "![Performance profiles](results/profiles_direct.png)",
            *(summary(table, "warm", accuracy) for accuracy in ACCURACIES),
        ]
    )


if __name__ == "__main__":
    main()
