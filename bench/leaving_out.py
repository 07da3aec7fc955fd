"""What leaving out saves: for each thing that a scene may not need, time and unknowns with it and
without it, and how far the answers differ.

Most things can be forced in by a scene that asks for them with no effect: a shear modulus of 1e30
Pa, a taper of one part in 1e15, a friction coefficient of 1e-300. What only the program could
leave out is measured on a copy of the package with that line changed (`VARIANTS`), compiled and
run in a process of its own: that is how a build without friction, without the error estimate, or
with all nodes in the subproblem is had. CPU time on one core, both sides in turn, the best of
ROUNDS. Two processes of one build differ, too, by where their code and data happen to lie: builds
are compared in STARTS sets of three processes, the package twice and the other build, in ROUNDS
rounds in turn; of each set the median of the rounds' ratios counts, of the sets the median, and the
package against itself gives the noise.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from support import markdown_table, read_table, write_table

import fastncm
from fastncm.cases import solve_chunk

ROUNDS = 9
STARTS = 5
JAWS = 2_000
"""Jaws of a batch; each is a problem of its own."""
CIRCLE = fastncm.load_scene("snapfit-circle").replace(
    {"friction.mu": 0.0, "solver.order": 4, "solver.rtol": 1e-12}
)
RUBBER = fastncm.load_scene("rubber-ellipse").replace({"solver.intervals": 90})
POINTS = 50
COMPARED = ["peak_force_N", "max_strain"]
WORK = ["insertion_work_J"]
"""Integrated with the force's rate, which comes from the last factor of Newton's method: it depends
on how many iterations that took, by the length of the last step."""

VARIANTS = {
    "friction (a build without it)": (
        "circle",
        "path/*.py",
        r"if lanes\.(rubs|holds)\[0\]:",
        "if False:",
        "the build has no branch for friction",
    ),
    "error estimate": (
        "circle",
        "path/rows.py",
        r"\n    _estimate\(problem, lanes, at\)",
        "\n    for lane in range(LANES):\n        at.row[ESTIMATE, lane] = 0.0",
        "the build makes no estimate",
    ),
    "far nodes, and the straight part beyond the last contact": (
        "rubber",
        "sqp/surface_state.py",
        r"\nNEAR = [0-9.e-]+\n",
        "\nNEAR = 1e9\n",
        "the build has all nodes in every subproblem",
    ),
}
"""What only another build leaves out or forces in: scene, files, pattern, replacement, meaning."""
FORCED_IN = ("far nodes, and the straight part beyond the last contact",)
"""Variants that do more than the package, not less."""


def main() -> None:
    rows = [
        shear_of_a_jaw(),
        shear_in_direct_contact(),
        taper(),
        friction(),
        discretised_contact(),
        positions_before_touch(),
        curves(),
        shared_problems(),
        *(variant(name) for name in VARIANTS),
    ]
    write_table("leaving_out", pd.DataFrame(rows), rounds=ROUNDS, jaws=JAWS)
    print(section())


def heights(count: int = JAWS) -> pd.DataFrame:
    return pd.DataFrame({"jaw.height": np.linspace(0.0069, 0.0109, count)})


def heights_of_the_ellipse(count: int = 8) -> pd.DataFrame:
    return pd.DataFrame({"path.y": RUBBER.path.y * np.linspace(1.0, 1.002, count)})


def in_turn(*runs: Callable[[], object]) -> list[float]:
    """Least CPU seconds of each, measured in turn."""
    least = [np.inf] * len(runs)
    for run in runs:
        run()
    for _ in range(ROUNDS):
        for i, run in enumerate(runs):
            began = time.process_time()
            run()
            least[i] = min(least[i], time.process_time() - began)
    return least


def differences(one: pd.DataFrame, other: pd.DataFrame) -> dict[str, float]:
    """Largest relative differences of force and strain, and of the work."""
    found = {}
    for name, columns in (("difference", COMPARED), ("work_difference", WORK)):
        a, b = one[columns].to_numpy(), other[columns].to_numpy()
        found[name] = float((np.abs(a - b) / np.abs(a).max(axis=0)).max())
    return found


def compare(
    what: str,
    forced: tuple[fastncm.Scene, pd.DataFrame],
    left: tuple[fastncm.Scene, pd.DataFrame],
    unknowns: tuple[int, int],
    how: str,
) -> dict[str, object]:
    """One row: a batch with the thing forced in against one with it left out."""
    seconds = in_turn(*(lambda s=s, f=f: fastncm.solve_cases(s, f) for s, f in (forced, left)))
    solves = len(left[1]) * left[0].path.steps
    return {
        "left_out": what,
        "how": how,
        "us_forced_in": seconds[0] / solves * 1e6,
        "us_left_out": seconds[1] / solves * 1e6,
        "unknowns_forced_in": unknowns[0],
        "unknowns_left_out": unknowns[1],
        **differences(fastncm.solve_cases(*forced), fastncm.solve_cases(*left)),
    }


STIFF = {"model.shear": True, "finger.shear_modulus": 1e30}


def shear_of_a_jaw() -> dict[str, object]:
    order = fastncm.solve(CIRCLE).order
    forced, left = CIRCLE.replace(STIFF), CIRCLE.replace({"model.shear": False})
    batch = heights()
    how = "a shear modulus of 1e30 Pa"
    return compare("shear (jaw)", (forced, batch), (left, batch), (2 * order, order), how)


def shear_in_direct_contact() -> dict[str, object]:
    forced, left = RUBBER.replace(STIFF), RUBBER.replace({"model.shear": False})
    batch = heights_of_the_ellipse()
    intervals = RUBBER.solver.intervals
    how = "a shear modulus of 1e30 Pa"
    return compare(
        "shear (direct contact)",
        (forced, batch),
        (left, batch),
        (2 * intervals, intervals),
        how,
    )


def taper() -> dict[str, object]:
    thickness = CIRCLE.finger.thickness
    clamp = float(np.ravel(thickness)[0])
    batch = heights()
    tip = clamp * (1.0 + 1e-15 * (1 + np.arange(JAWS)))
    tapered = batch.assign(**{"finger.thickness": [[clamp, t] for t in tip]})
    order = fastncm.solve(CIRCLE).order
    how = "every finger its own taper, of a few parts in 1e15"
    return compare("taper", (CIRCLE, tapered), (CIRCLE, batch), (order, order), how)


def friction() -> dict[str, object]:
    batch = heights()
    order = fastncm.solve(CIRCLE).order
    forced = CIRCLE.replace({"friction.mu": 1e-300})
    how = "a friction coefficient of 1e-300"
    return compare("friction", (forced, batch), (CIRCLE, batch), (order + 1, order), how)


def discretised_contact() -> dict[str, object]:
    """snapfit-corner while the block's corner, which is one of its points, slides on the jaw."""
    corner = fastncm.load_scene("snapfit-corner").replace(
        {"friction.mu": 0.0, "solver.order": 6, "solver.rtol": 1e-12}
    )
    curve = fastncm.solve(corner)
    touch, peak = curve.events()["position"].iloc[0], curve.peak.position
    scene = corner.replace({"path.stop": touch + 0.8 * (peak - touch)})
    points = scene.replace({"solver.contact": "points-on-target", "solver.points": POINTS})
    batch = pd.DataFrame({"jaw.height": curve.scene.jaw.height * np.linspace(1.0, 1.05, 64)})
    how = f"{POINTS} points of the target (10b), the corner among them"
    row = compare("discretised contact", (points, batch), (scene, batch), (6 + POINTS, 7), how)
    return row | {"work_difference": np.nan}  # the point forms have no located events


def positions_before_touch() -> dict[str, object]:
    """What a position without contact costs beside one with contact.

    The last jaw is the highest and touches first.
    """
    batch = heights()
    first = fastncm.solve(CIRCLE.replace(batch.iloc[-1].to_dict()))
    position = first.frame()["position"].to_numpy()
    start, steps, more = position[0], len(position), len(position) // 4
    before = start + more * (position[0] - position[1])
    longer = CIRCLE.replace({"path.start": before, "path.steps": steps + more})
    shorter = CIRCLE.replace({"path.start": start})
    seconds = in_turn(*(lambda s=s: fastncm.solve_cases(s, batch) for s in (longer, shorter)))
    return {
        "left_out": "positions before first touch",
        "how": f"{more} positions more: one with contact against one without",
        "us_forced_in": seconds[1] / (JAWS * steps) * 1e6,
        "us_left_out": max(seconds[0] - seconds[1], 0.0) / (JAWS * more) * 1e6,
        "unknowns_forced_in": first.order + 1,
        "unknowns_left_out": 0,
        **differences(*(fastncm.solve_cases(s, batch) for s in (longer, shorter))),
    }


def curves() -> dict[str, object]:
    columns = {"jaw.height": heights()["jaw.height"].to_numpy()}
    seconds = in_turn(
        lambda: solve_chunk(CIRCLE, columns, curves=True),
        lambda: solve_chunk(CIRCLE, columns, curves=False),
    )
    tables = [
        pd.DataFrame(solve_chunk(CIRCLE, columns, curves=wanted).cases) for wanted in (True, False)
    ]
    solves = JAWS * CIRCLE.path.steps
    return {
        "left_out": "output of curves",
        "how": "the long table of all positions, in memory",
        "us_forced_in": seconds[0] / solves * 1e6,
        "us_left_out": seconds[1] / solves * 1e6,
        "unknowns_forced_in": -1,
        "unknowns_left_out": -1,
        **differences(*tables),
    }


def shared_problems() -> dict[str, object]:
    """The shipped study's grid; apart, every case's jaw is moved by its own last digits."""
    grid = pd.MultiIndex.from_product(
        [
            np.linspace(0.0022, 0.0042, 21),
            np.linspace(0.0, 0.4, 9),
            np.linspace(0.0069, 0.0109, 11),
        ],
        names=["finger.thickness", "friction.mu", "jaw.height"],
    ).to_frame(index=False)
    scene = CIRCLE.replace({"friction.model": "recovered"})
    digits = 1.0 + 2.5e-16 * np.arange(len(grid))
    apart = grid.assign(**{"jaw.height": grid["jaw.height"] * digits})
    how = "every case's jaw its own in the last digits"
    row = compare(
        "cases that share a dimensionless problem", (scene, apart), (scene, grid), (-1, -1), how
    )
    paths = [fastncm.solve_cases(scene, frame).attrs["shape_paths"] for frame in (apart, grid)]
    return row | {"how": f"{how}: {paths[0]:,} paths solved, not {paths[1]:,}"}


def variant(name: str) -> dict[str, object]:
    """The package against a copy of it with `VARIANTS[name]`."""
    scene, files, pattern, replacement, how = VARIANTS[name]
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder) / "fastncm"
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(Path(fastncm.__file__).parent, package, ignore=ignore)
        changed = 0
        for file in package.glob(files):
            text, count = re.subn(pattern, replacement, file.read_text())
            file.write_text(text)
            changed += count
        if not changed:
            raise LookupError(f"{name}: nothing in {files} reads {pattern}")
        home = str(Path(fastncm.__file__).parents[1])
        sets = [_in_turn_apart((home, folder, home), scene) for _ in range(STARTS + 1)]
    apart = np.array(
        [seconds for seconds, _ in sets[1:]]
    )  # the first compiles; (starts, rounds, 3)
    ratios = np.median(apart / apart[:, :, :1], axis=1)
    ratio = float(np.median(ratios[:, 1]))
    noise = float(np.abs(ratios[:, 2] - 1.0).max())
    us = apart.min(axis=(0, 1))[:2]
    _, (ours, other, _) = sets[-1]
    unknowns = ours["unknowns"]
    more = name in FORCED_IN
    return {
        "left_out": name,
        "how": how,
        "us_forced_in": us[1 if more else 0],
        "us_left_out": us[0 if more else 1],
        "ratio": ratio if more else 1.0 / ratio,
        "noise": noise,
        "unknowns_forced_in": unknowns[0],
        "unknowns_left_out": unknowns[1 if more else 0],
        **differences(pd.DataFrame(ours["answers"]), pd.DataFrame(other["answers"])),
    }


def _in_turn_apart(homes: Sequence[str], scene: str) -> tuple[np.ndarray, list[dict]]:
    """CPU time (rounds, builds) in us a solve of the packages in `homes`, in turn, each in a
    process of its own, and what they say of themselves and their answers."""
    children = [_start(home, scene) for home in homes]
    try:
        about = [json.loads(_answer(child)) for child in children]
        for one, home in zip(about, homes, strict=True):
            assert one["package"] == str(Path(home) / "fastncm")
        us = np.array([[float(_answer(child, "go")) for child in children] for _ in range(ROUNDS)])
    finally:
        for child in children:
            child.communicate()
    return us, about


def _start(home: str, scene: str) -> subprocess.Popen[str]:
    """`serve` with the package in `home`."""
    return subprocess.Popen(
        [sys.executable, __file__, scene],
        env=os.environ | {"PYTHONPATH": home},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=home,
    )


def _answer(child: subprocess.Popen[str], question: str = "") -> str:
    """The next line that a process says, after a line to it if there is a question."""
    assert child.stdin and child.stdout
    if question:
        print(question, file=child.stdin, flush=True)
    line = child.stdout.readline()
    if not line:
        raise RuntimeError(f"a process with another build ended with {child.wait()}")
    return line


def serve(scene: str) -> None:
    """One side of a variant: says `about` and then, for each line that it gets, the CPU time of a
    run in us a solve."""
    case, batch, solves = batch_of(scene)
    print(json.dumps(about(scene)), flush=True)
    for _ in sys.stdin:
        began = time.process_time()
        fastncm.solve_cases(case, batch)
        print((time.process_time() - began) / solves * 1e6, flush=True)


def batch_of(scene: str) -> tuple[fastncm.Scene, pd.DataFrame, int]:
    """What a variant is measured with: scene, cases, and the number of solves."""
    case, batch = (CIRCLE, heights()) if scene == "circle" else (RUBBER, heights_of_the_ellipse())
    return case, batch, len(batch) * case.path.steps


def about(scene: str) -> dict[str, object]:
    """Where the package is, its answers, and the unknowns of a solve with all nodes and with those
    up to the last contact."""
    case, batch, _ = batch_of(scene)
    if scene == "circle":
        unknowns = [fastncm.solve(CIRCLE).order] * 2
    else:
        frame, intervals = fastncm.solve(RUBBER).frame(), RUBBER.solver.intervals
        touching = frame["contact_to_m"].mean() / RUBBER.finger.length
        unknowns = [2 * intervals, round(2 * intervals * touching)]
    table = fastncm.solve_cases(case, batch)
    return {
        "package": str(Path(fastncm.__file__).parent),
        "answers": table[COMPARED + WORK].to_dict("list"),
        "unknowns": unknowns,
    }


def headlines() -> list[str]:
    table, _ = read_table("leaving_out")
    gain = _ratio(table)
    most = table.assign(gain=gain).nlargest(3, "gain")
    build = table[table["left_out"] == "friction (a build without it)"].iloc[0]
    said = ", ".join(f"{r.left_out} ({r.gain:.1f} times)" for r in most.itertuples())
    return [
        f"Leaving out pays most for: {said}; the answers differ by at most "
        f"{table['difference'].max():.0e} in force and strain.",
        "Against a build without friction a frictionless scene takes "
        f"{gain[build.name] - 1.0:+.1%} of time; a build against itself differs by up to "
        f"{build['noise']:.1%}.",
    ]


def _ratio(table: pd.DataFrame) -> pd.Series:
    """Time with a thing over time without it: where builds are compared the median of the ratios,
    else that of the best times."""
    return table["ratio"].fillna(table["us_forced_in"] / table["us_left_out"])


def section() -> str:
    table, about = read_table("leaving_out")

    def count(number: int) -> str:
        return f"{number}" if number >= 0 else "-"

    rows = [
        [
            r.left_out,
            r.how,
            f"{r.us_forced_in:.3g}",
            f"{r.us_left_out:.3g}",
            f"{r.gain:.2f}" + (f" ± {r.noise:.2f}" if np.isfinite(r.noise) else ""),
            f"{count(r.unknowns_forced_in)} / {count(r.unknowns_left_out)}",
            f"{r.difference:.0e}",
            f"{r.work_difference:.0e}" if np.isfinite(r.work_difference) else "-",
        ]
        for r in table.assign(gain=_ratio(table)).itertuples()
    ]
    head = ["what", "how it is forced in", "µs a solve with it", "without", "ratio"]
    head += ["unknowns with / without", "difference of force and strain", "of the work"]
    return "\n\n".join(
        [
            "## What leaving out saves",
            f"`bench/leaving_out.py`, {about['machine']['cpu']}, revision "
            f"{about['machine']['revision']}, {about['machine']['date']}. CPU time on one core, "
            f"the best of {about['rounds']} rounds in turn. Where another "
            "build "
            "is compared, the ratio is the median over several starts of both, and ± the largest "
            "deviation of the package from itself.",
            markdown_table(head, rows),
            "The work is integrated with the force's rate, which comes from the last factor of "
            "Newton's method and so depends on the number of iterations. The first touch of an "
            "earlier start is part of the work, too.",
        ]
    )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        serve(sys.argv[1])
    else:
        main()
