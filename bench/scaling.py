"""How the time grows with cases, chunk, cores and N, and how far the kernel is from this core's
limit.

The limit is a model: the additions and multiplications of a solve by the formulas in `operations`,
at the rate that this core reaches in a loop with nothing else, and its sines and cosines at the
rate of `kernels.trig.sincos` in a loop of its own. What memory moves is compared likewise. Single
core and CPU time but for the part on cores.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import throughput
from numba import njit
from support import RESULTS, ROOT, markdown_table, read_table, write_table

import fastncm
from fastncm.kernels.constants import LANES
from fastncm.kernels.trig import sincos
from fastncm.plot.style import empty_figure, legend, open_frame, save

CASES = (1, 8, 32, 100, 1_000, 10_000, 100_000, 1_000_000)
"""Cases of one call of `solve_cases`, every one a jaw of its own."""
POSITIONS = 60
NODES = (45, 90, 180, 360, 720, 1440, 2880, 5760)
JOBS = (1, 2)
CHUNKS = (1, 32, 512, 1_000, 10_000, 20_000)
"""Cases of one of the calls that together solve the last number of cases."""
COLD = 6, 2_000
"""Positions that are solved in one jump from the first touch, and jaws at each."""
SWEPT = 300_000
"""Cases of the sweeps on one and two cores."""
CHAIN = 32
"""Operations on a number before it goes back to memory, in the loop that finds the core's rate."""
LEAST_SECONDS = 0.4
"""A measurement is repeated until it has taken that long; the best counts."""


def main() -> None:
    scene = throughput.SCENE.replace({"path.steps": POSITIONS})
    cases = [over_cases(scene, count) for count in CASES]
    write_table("scaling_cases", pd.DataFrame(cases), rtol=throughput.RTOL, positions=POSITIONS)
    nodes = [over_nodes(intervals) for intervals in NODES]
    write_table("scaling_nodes", pd.DataFrame(nodes), positions=POSITIONS)
    write_table("scaling_cores", pd.DataFrame([over_cores(jobs) for jobs in JOBS]), cases=SWEPT)
    reached = rates()
    write_table("scaling_limit", limit(scene, cases[5], reached), **reached)
    chunks = [over_chunks(scene, size) for size in CHUNKS]
    write_table("scaling_chunks", pd.DataFrame(chunks), cases=CHUNKS[-1])
    write_table("scaling_starts", pd.DataFrame([warm_start() | cold_solves(scene)]))
    picture()
    print(section())


def best(run: Callable[[], object]) -> float:
    """Least CPU seconds of a call."""
    spent, least = 0.0, np.inf
    while spent < LEAST_SECONDS:
        began = time.process_time()
        run()
        least = min(least, time.process_time() - began)
        spent += least
    return least


def over_cases(scene: fastncm.Scene, count: int) -> dict[str, float]:
    frame = pd.DataFrame({"jaw.height": np.linspace(*throughput.HEIGHTS, count)})
    table = fastncm.solve_cases(scene, frame)
    seconds = best(lambda: fastncm.solve_cases(scene, frame))
    return {
        "cases": count,
        "us_per_solve": seconds / count / POSITIONS * 1e6,
        "us_per_case": seconds / count * 1e6,
        "iterations_per_solve": table["iterations"].mean() / POSITIONS,
        "failed": int((~table["status"].isin(["converged", "no_contact"])).sum()),
    }


def over_chunks(scene: fastncm.Scene, size: int) -> dict[str, float]:
    """The same cases in calls of `size` each; of the smallest ones only a part."""
    whole = pd.DataFrame({"jaw.height": np.linspace(*throughput.HEIGHTS, CHUNKS[-1])})
    calls = min(len(whole) // size, 200)
    parts = [whole.iloc[i * size : (i + 1) * size] for i in range(calls)]
    seconds = best(lambda: [fastncm.solve_cases(scene, part) for part in parts])
    return {"chunk": size, "us_per_solve": seconds / calls / size / POSITIONS * 1e6}


def cold_solves(scene: fastncm.Scene) -> dict[str, float]:
    """µs and iterations of a solve along the path, and of one from the first touch in one jump."""
    positions, jaws = COLD
    heights = np.linspace(*throughput.HEIGHTS, jaws)
    touch = fastncm.solve(scene.replace({"path.start": "touch"})).frame()["position"].iloc[0]
    ends = touch + np.linspace(0.1, 1.0, positions) * (scene.path.stop - touch)
    jumps = pd.DataFrame(
        {"jaw.height": np.tile(heights, positions), "path.stop": np.repeat(ends, jaws)}
    )
    found = {}
    for name, frame, steps, solves in (
        ("along", pd.DataFrame({"jaw.height": heights}), POSITIONS, POSITIONS),
        ("jump", jumps, 2, 1),
    ):
        made = scene.replace({"path.start": "touch", "path.steps": steps})
        table = fastncm.solve_cases(made, frame)
        seconds = best(lambda made=made, frame=frame: fastncm.solve_cases(made, frame))
        found[f"us_{name}"] = seconds / len(frame) / solves * 1e6
        found[f"iterations_{name}"] = table["iterations"].mean() / solves
    return found


def over_nodes(intervals: int) -> dict[str, float]:
    scene = fastncm.load_scene("rubber-ellipse").replace(
        {"solver.intervals": intervals, "path.steps": POSITIONS}
    )
    frame = pd.DataFrame({"friction.mu": [0.0]})
    table = fastncm.solve_cases(scene, frame)
    seconds = best(lambda: fastncm.solve_cases(scene, frame))
    return {
        "N": intervals,
        "us_per_solve": seconds / POSITIONS * 1e6,
        "iterations_per_solve": float(table["iterations"][0]) / POSITIONS,
        "status": str(table["status"][0]),
    }


def over_cores(jobs: int) -> dict[str, float]:
    side = round(SWEPT**0.5)
    axes = {
        "jaw.height": {"linspace": [0.0069, 0.0109, side]},
        "jaw.length": {"linspace": [0.0162, 0.0222, side]},
    }
    study = fastncm.Study(fastncm.load_scene("snapfit-circle"), axes)
    seconds = []
    for _ in range(2):
        with tempfile.TemporaryDirectory() as folder:
            began = time.perf_counter()
            run = fastncm.sweep(study, Path(folder) / "out", jobs=jobs)
            seconds.append(time.perf_counter() - began)
    return {
        "jobs": jobs,
        "cases": run.rows,
        "sweep_seconds": min(seconds),
        "solves_per_second": throughput.rate_on(jobs),
    }


def warm_start() -> dict[str, float]:
    """Seconds of `fastncm solve` in a new process; compiling, as `first_use.py` measured it."""
    command = [sys.executable, "-m", "fastncm", "solve", "snapfit-circle"]
    seconds = []
    for _ in range(3):
        began = time.perf_counter()
        subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
        seconds.append(time.perf_counter() - began)
    return {"warm_s": min(seconds)}


@njit(fastmath=True)
def _multiply_and_add(values, factor, rounds):
    """2 x CHAIN x LANES x rounds operations on numbers that stay in registers."""
    for _ in range(rounds):
        for lane in range(LANES):
            value = values[lane]
            for _ in range(CHAIN):
                value = value * factor + 1e-9
            values[lane] = value


@njit(fastmath=True)
def _sines(angles, out, rounds):
    for _ in range(rounds):
        for lane in range(LANES):
            s, c = sincos(angles[lane])
            out[lane] += s + c


@njit(fastmath=True)
def _triad(a, b, out):
    for i in range(a.shape[0]):
        out[i] = a[i] + 3.0 * b[i]


def rates() -> dict[str, float]:
    """What this core reaches: operations, sine-cosine pairs and bytes in a nanosecond."""
    values, lanes = np.ones(LANES), np.linspace(-1.0, 1.0, LANES)
    a, b, out = np.ones(4_000_000), np.ones(4_000_000), np.empty(4_000_000)
    rounds = 100_000
    for run in (lambda: _multiply_and_add(values, 0.999, 1), lambda: _sines(lanes, lanes * 0, 1)):
        run()
    adding = best(lambda: _multiply_and_add(values, 0.999, rounds))
    sines = best(lambda: _sines(lanes, np.zeros(LANES), rounds))
    _triad(a, b, out)
    moving = best(lambda: _triad(a, b, out))
    return {
        "operations_per_ns": 2 * CHAIN * LANES * rounds / adding / 1e9,
        "sincos_per_ns": LANES * rounds / sines / 1e9,
        "bytes_per_ns": 3 * 8 * len(a) / moving / 1e9,
    }


def operations(modes: int, points: int, iterations: float) -> pd.DataFrame:
    """Additions and multiplications of one position, counted from the formulas.

    An iteration has an evaluation and a factor with its step; one evaluation comes first. Products
    over modes and Gauss points count two operations for each pair.
    """
    pairs, half = modes * points, modes * (modes + 1) // 2
    evaluation = 7 * pairs + 4 * points + 14 * modes + 60  # angles, gradient, pose, gap, residual
    factor = 4 * points + 3 * points * half + 6 * half + modes**3 // 3 + 3 * 2 * modes**2
    estimate = 4 * points**2 + 3 * 6 * points + 4 * pairs
    predictor = 8 * modes + 8
    parts = {
        "evaluations": ((iterations + 1) * evaluation, (iterations + 1) * (points + 1)),
        "Hessian, factor and step": (iterations * factor, 0),
        "row and error estimate": (estimate, 0),
        "predictor": (predictor, 0),
    }
    return pd.DataFrame(
        [{"part": name, "operations": o, "sincos": s} for name, (o, s) in parts.items()]
    )


def limit(
    scene: fastncm.Scene, measured: dict[str, float], reached: dict[str, float]
) -> pd.DataFrame:
    """The model beside the measurement, in ns a position."""
    order = fastncm.solve(scene).order
    table = operations(order, order + 3, measured["iterations_per_solve"])
    table["ns_at_the_limit"] = (
        table["operations"] / reached["operations_per_ns"]
        + table["sincos"] / reached["sincos_per_ns"]
    )
    row = {"part": "measured", "ns_at_the_limit": measured["us_per_solve"] * 1e3}
    # shape, row and multiplier of a position, written once and read by the summaries
    bytes_moved = 2 * 8 * (order + 40)
    moved = {"part": "results in memory", "ns_at_the_limit": bytes_moved / reached["bytes_per_ns"]}
    return pd.concat([table, pd.DataFrame([moved, row])], ignore_index=True).fillna(0.0)


def picture() -> None:
    cases, nodes = read_table("scaling_cases")[0], read_table("scaling_nodes")[0]
    figure = empty_figure(8.0, 3.2)
    left, right = figure.subplots(1, 2)
    for ax, x, table, label in (
        (left, "cases", cases, "cases in one call (snapfit-circle)"),
        (right, "N", nodes, "intervals N (rubber-ellipse)"),
    ):
        open_frame(ax)
        ax.loglog(table[x], table["us_per_solve"], "o-", color="#1b2a49", ms=3)
        ax.set(xlabel=label, ylabel="µs of CPU time a solve")
    ends = nodes["N"].iloc[[0, -1]].to_numpy()
    line = nodes["us_per_solve"].iloc[-1] * ends / ends[-1]
    right.loglog(ends, line, color="0.8", lw=0.8, zorder=0, label="proportional to N")
    legend(right, "")
    save(figure, RESULTS / "scaling.png")


def slope(nodes: pd.DataFrame) -> float:
    """Exponent of N in the time, for N >= 90."""
    some = nodes[nodes["N"] >= 90]
    return float(np.polyfit(np.log(some["N"]), np.log(some["us_per_solve"]), 1)[0])


def next_to_remove(parts: pd.DataFrame) -> str:
    """What a position's time consists of by the model, in a sentence."""
    model = parts[parts["part"] != "measured"].set_index("part")["ns_at_the_limit"]
    measured = parts.loc[parts["part"] == "measured", "ns_at_the_limit"].iloc[0]
    rest = 1.0 - model.sum() / measured
    return (
        f"The largest part of the limit is {model.idxmax()}, {model.max() / measured:.0%} of the "
        f"time measured: removing it wins no more. {rest:.0%} of the time is beyond the limit of "
        "all parts: the code runs below the core's peak there, or does what the formulas do not "
        "need, so the next thing to remove is there."
    )


def headlines() -> list[str]:
    cases, _ = read_table("scaling_cases")
    nodes, _ = read_table("scaling_nodes")
    cores, _ = read_table("scaling_cores")
    parts, _ = read_table("scaling_limit")
    ours = parts[parts["part"] != "measured"]["ns_at_the_limit"].sum()
    measured = parts[parts["part"] == "measured"]["ns_at_the_limit"].iloc[0]
    speed_up = cores["solves_per_second"].iloc[1] / cores["solves_per_second"].iloc[0]
    last = cases.iloc[-1]
    return [
        f"A jaw's solve takes {cases['us_per_solve'].min():.2f} µs in large batches, "
        f"{last['us_per_solve']:.2f} µs in one call of {last['cases']:,.0f} cases; this core's "
        f"limit by the model is {ours / 1e3:.2f} µs, {measured / ours:.1f} times less.",
        "A curve of direct contact by `solve`, with all that is not solving, takes time "
        f"proportional to N^{slope(nodes):.2f} from 90 to {nodes['N'].max():,} intervals.",
        f"Two cores solve {speed_up:.2f} times as much as one.",
    ]


def section() -> str:
    cases, about = read_table("scaling_cases")
    nodes, _ = read_table("scaling_nodes")
    cores, _ = read_table("scaling_cores")
    parts, reached = read_table("scaling_limit")
    starts, _ = read_table("scaling_starts")
    chunks, of = read_table("scaling_chunks")
    start = starts.iloc[0]
    compiling = json.loads((RESULTS / "first_use.json").read_text())
    memory = json.loads((RESULTS / "million.json").read_text())["sweeps"]
    share = json.loads((RESULTS / "throughput.json").read_text())["share_outside_compiled"]
    speed = [cores[name].iloc[1] / cores[name].iloc[0] for name in ("solves_per_second",)]
    sweeps = cores["sweep_seconds"].iloc[0] / cores["sweep_seconds"].iloc[1]
    text = [
        "## Scaling",
        f"`bench/scaling.py`, {about['machine']['cpu']}, revision "
        f"{about['machine']['revision']}, {about['machine']['date']}. CPU time on one core, the "
        "best of several calls.",
        "![time over cases and over N](results/scaling.png)",
        f"snapfit-circle, {about['positions']} positions a case, rtol {about['rtol']:g}; every "
        f"case is a jaw of its own. {LANES} designs are solved side by side, so that a call with "
        "fewer cases leaves lanes empty:",
        markdown_table(
            ["cases in one call", "µs a solve", "µs a case", "iterations a solve", "failed"],
            [
                [f"{r.cases:,}", f"{r.us_per_solve:.3g}", f"{r.us_per_case:.4g}"]
                + [f"{r.iterations_per_solve:.2f}", f"{r.failed}"]
                for r in cases.itertuples()
            ],
        ),
        f"The same, {of['cases']:,} cases in calls (chunks) of a size:",
        markdown_table(
            ["cases in a chunk", "µs a solve"],
            [[f"{r.chunk:,}", f"{r.us_per_solve:.3g}"] for r in chunks.itertuples()],
        ),
        f"Warm and cold: a solve along the path takes {start['us_along']:.2g} µs and "
        f"{start['iterations_along']:.2g} iterations, one in a single jump from the first touch "
        f"{start['us_jump']:.2g} µs and {start['iterations_jump']:.2g}, events and summaries "
        "included.",
        f"rubber-ellipse, over N (exponent {slope(nodes):.2f} from N = 90 on):",
        markdown_table(
            ["N", "µs a solve", "iterations a solve", "status"],
            [
                [f"{r.N}", f"{r.us_per_solve:.4g}", f"{r.iterations_per_solve:.2f}", r.status]
                for r in nodes.itertuples()
            ],
        ),
        "Cores:",
        markdown_table(
            ["processes", "solves a second", f"sweep of {cores['cases'].iloc[0]:,} cases / s"],
            [
                [f"{r.jobs}", f"{r.solves_per_second:.3g}", f"{r.sweep_seconds:.1f}"]
                for r in cores.itertuples()
            ],
        ),
        f"Two against one: {speed[0]:.2f} times the solves, sweeps {sweeps:.2f} times as fast.",
        f"`fastncm solve` in a new process: {start['warm_s']:.1f} s with a warm cache; "
        f"compiling first: {_cold(compiling)} (`bench/first_use.py`). Outside compiled code: "
        f"{share:.1%} of the time of a batch (`bench/throughput.py`). Peak memory of a sweep "
        "(`bench/million.py`): "
        + ", ".join(
            f"{s['cases']:,} cases{' with curves' if s['curves'] else ''} "
            f"{s['parent_peak_MB']:.0f} MB"
            for s in memory
        )
        + ".",
        "What a position needs by the formulas, and how long this core takes for that at least "
        f"({reached['operations_per_ns']:.1f} operations, {reached['sincos_per_ns']:.2f} pairs of "
        f"sine and cosine, {reached['bytes_per_ns']:.1f} bytes in a nanosecond):",
        markdown_table(
            ["part", "operations", "sine and cosine", "ns"],
            [
                [r.part, f"{r.operations:.0f}", f"{r.sincos:.1f}", f"{r.ns_at_the_limit:.0f}"]
                for r in parts.itertuples()
            ],
        ),
        next_to_remove(parts),
    ]
    return "\n\n".join(text)


def _cold(compiling: dict[str, object]) -> str:
    """All seconds in first_use.json, by name."""
    return ", ".join(
        f"{name.replace('_', ' ')} {value:.3g} s"
        for name, value in compiling.items()
        if isinstance(value, float)
    )


if __name__ == "__main__":
    main()
