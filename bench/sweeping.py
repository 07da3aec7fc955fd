"""What a sweep costs beside its solves, what a second core brings, and what a cluster would.

Two studies of a million cases of snapfit-circle: in one every case is a dimensionless problem of
its own, in the other 20 cases share one (bench/million.py). Each measurement is a process of its
own; the machine must have nothing else to do.

Overhead: the CPU time of a sweep in one process, that of taking stock of the finished table
included (what resuming begins with), less the time inside `solve_chunk`, as a share of the latter.
Cluster: the CPU time that the parent takes for a case when two Dask workers on this machine solve
it, start left out; it checks, sends, receives, writes and is the only part of a sweep that more
nodes do not speed up.
"""

import argparse
import dataclasses
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import million
from support import ROOT, markdown_table, read_json, write_json

import fastncm
from fastncm.sweeping import pools, tasks

CASES = 1_000_000
SMALL = 20_000
"""Cases of a sweep that is nearly all start."""
REPEATS = 3
NODES, CORES, DESIGNS = 100, 32, 1_000_000_000
"""Of the cluster that is extrapolated to."""


def own_study() -> "fastncm.Study":
    """Every case a dimensionless problem of its own."""
    side = round(CASES**0.5)
    return fastncm.Study(
        scene=fastncm.load_scene("snapfit-circle"),
        axes={
            "jaw.height": {"linspace": [0.0069, 0.0109, side]},
            "jaw.length": {"linspace": [0.0162, 0.0222, side]},
        },
    )


def shared_study() -> "fastncm.Study":
    """20 cases share a problem: by the paper's rule friction only turns the force."""
    study = million.study(CASES)
    recovered = study.scene.replace({"friction.model": "recovered"})
    return dataclasses.replace(study, scene=recovered)


STUDIES = {"own": own_study, "shared": shared_study}


def measure(kind: str, backend: str, jobs: int) -> dict[str, float]:
    """Run one sweep in this process, then take stock of it; for a process of its own."""
    solving = []
    solve_chunk = tasks.solve_chunk

    def timed(*arguments, **options):
        began = time.process_time()
        result = solve_chunk(*arguments, **options)
        solving.append(time.process_time() - began)
        return result

    def parent_cpu() -> float:
        """CPU time of this process but for its solves."""
        return time.process_time() - sum(solving)

    tasks.solve_chunk = timed
    study = STUDIES[kind]()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "sweep"
        small = fastncm.Study(study.scene, {"jaw.height": {"linspace": [0.0069, 0.0109, SMALL]}})
        fastncm.sweep(small, Path(folder) / "warm", jobs=jobs, backend=backend)
        before = parent_cpu()
        fastncm.sweep(small, Path(folder) / "small", jobs=jobs, backend=backend)
        start = parent_cpu() - before
        earlier = sum(solving)
        began, before = time.perf_counter(), parent_cpu()
        run = fastncm.sweep(study, out, jobs=jobs, backend=backend)
        seconds, cpu = time.perf_counter() - began, parent_cpu() - before
        local = sum(solving) - earlier
        began, before = time.perf_counter(), parent_cpu()
        assert not fastncm.sweep(study, out, jobs=1).fresh
        stock, stock_cpu = time.perf_counter() - began, parent_cpu() - before
        began = time.perf_counter()
        column = fastncm.load(out, columns=["peak_force_N"])
        column_seconds = time.perf_counter() - began
        size = sum(file.stat().st_size for file in out.rglob("*.parquet"))
        assert len(column) == run.rows == CASES
    return {
        "seconds": seconds,
        "start_cpu": start,
        "parent_cpu": cpu,
        "solving_cpu": local,
        "stock": stock,
        "stock_cpu": stock_cpu,
        "column": column_seconds,
        "bytes": size,
        "failed": run.failed,
    }


def in_process(kind: str, backend: str, jobs: int) -> dict[str, float]:
    """`measure` in a process of its own, and the load of the machine before it."""
    command = [sys.executable, __file__, kind, backend, str(jobs)]
    load = os.getloadavg()[0]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout.splitlines()[-1]) | {"load_before": load}


def cold_start() -> dict[str, float]:
    """Elapsed and CPU seconds from the command to the end of a sweep of two cases, no pictures."""
    code = (
        "import sys, fastncm\n"
        "fastncm.sweep(fastncm.Study(fastncm.load_scene('snapfit-circle'),"
        "{'friction.mu': [0.0, 0.2]}), sys.argv[1])"
    )
    return _timed([sys.executable, "-c", code])


def cold_start_of_the_command() -> dict[str, float]:
    """The same through `fastncm sweep`, which draws pictures and prints the best designs."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
        file.write("scene = 'snapfit-circle'\n[axes]\nfriction.mu = [0.0, 0.2]\n")
        file.flush()
        command = [sys.executable, "-m", "fastncm", "sweep", file.name, "--out"]
        return _timed(command)


def _timed(command: list[str]) -> dict[str, float]:
    """The least of several."""
    elapsed, cpu = [], []
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as folder:
            began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(
                [*command, f"{folder}/out"],
                check=True,
                cwd=ROOT,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            elapsed.append(time.perf_counter() - began)
            cpu.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return {"s": min(elapsed), "cpu": min(cpu)}


def cluster(runs: dict[str, dict[str, float]], cases: int) -> list[list[str]]:
    """What DESIGNS cases would take on NODES x CORES, as rows of a table, from a case's cost here.

    The parent's is that of the study of shared problems: so many workers get tasks of 200,000 cases
    (`plan.MAX_ROWS`), and that study's are nearly as large here, with two.
    """
    dask = runs["shared dask 2"]
    parent = (dask["parent_cpu"] - dask["start_cpu"]) / (cases - SMALL)
    solve = {kind: runs[f"{kind} loky 1"]["solving_cpu"] / cases for kind in STUDIES} | {
        "10 ms a path": 0.01
    }
    size = [runs[f"{kind} loky 1"]["bytes"] / cases * DESIGNS / 1e9 for kind in STUDIES]
    return [
        ["a case, one core / µs", *(short(seconds * 1e6) for seconds in solve.values())],
        [
            "all solved on all cores in / s",
            *(short(DESIGNS * s / (NODES * CORES)) for s in solve.values()),
        ],
        ["a case, the parent / µs", *[short(parent * 1e6)] * len(solve)],
        ["one parent feeds them in / s", *[short(DESIGNS * parent)] * len(solve)],
        ["cores that one parent keeps busy", *(short(s / parent) for s in solve.values())],
        ["table / GB", *map(short, size), "as the first"],
    ]


def short(number: float) -> str:
    """Two digits, or all before the point."""
    return f"{number:,.0f}" if number >= 10 else f"{number:.2g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", nargs="?", choices=STUDIES)
    parser.add_argument("backend", nargs="?", choices=pools.BACKENDS)
    parser.add_argument("jobs", nargs="?", type=int)
    options = parser.parse_args()
    if options.kind:
        print(json.dumps(measure(options.kind, options.backend, options.jobs)))
        return

    figures: dict[str, object] = {"cold_start": cold_start()}
    figures["cold_start_of_the_command"] = cold_start_of_the_command()
    runs = {}
    for kind in STUDIES:
        for backend, jobs in (("loky", 1), ("loky", 2), ("threading", 2), ("dask", 2)):
            runs[f"{kind} {backend} {jobs}"] = in_process(kind, backend, jobs)
    write_json("sweeping", figures | {"cases": CASES, "runs": runs})
    print(section())


def overhead(run: dict[str, float]) -> float:
    """CPU time of all that is not solving, resuming included, over that of the solves."""
    return (run["parent_cpu"] + run["stock_cpu"]) / run["solving_cpu"]


def headlines() -> list[str]:
    figures, _ = read_json("sweeping")
    runs = figures["runs"]
    start, shared = figures["cold_start"], runs["shared loky 1"]
    return [
        f"Scheduling, writing and resuming a sweep of {figures['cases']:,} cases take "
        f"{overhead(runs['own loky 1']):.1%} of the CPU time of its solves where every case is a "
        f"problem of its own, {overhead(shared):.0%} where 20 share one and a case takes "
        f"{shared['solving_cpu'] / figures['cases'] * 1e6:.1f} µs.",
        f"A sweep of two cases takes {start['s']:.1f} s from the start of Python to its end, "
        f"{start['cpu']:.1f} s of it CPU time.",
    ]


def section() -> str:
    figures, where = read_json("sweeping")
    runs = figures["runs"]
    load = max(run["load_before"] for run in runs.values())
    rows = []
    for name, run in runs.items():
        kind, _, jobs = name.split()
        shown = f"{overhead(run):.1%}" if jobs == "1" else "-"
        speed_up = runs[f"{kind} loky 1"]["seconds"] / run["seconds"]
        cells = [f"{run['seconds']:.1f}", f"{run['stock']:.2f}", f"{run['column']:.2f}"]
        rows.append([name, *cells, shown, f"{speed_up:.2f}"])
    head = ["study, backend, workers", "s", "stock / s", "one column / s", "overhead", "speed-up"]
    starts = [
        [words, f"{figures[name]['s']:.2f}", f"{figures[name]['cpu']:.2f}"]
        for name, words in (
            ("cold_start", "`fastncm.sweep` in a new process"),
            ("cold_start_of_the_command", "`fastncm sweep`, with its pictures"),
        )
    ]
    return "\n\n".join(
        [
            "## Sweeps",
            f"`bench/sweeping.py`, {where}; load of the machine before the runs up to {load:.1f}, "
            "by which elapsed seconds and speed-ups are as much worse. Two studies of "
            f"{figures['cases']:,} cases of snapfit-circle: every case a problem of its own, or 20 "
            "sharing one. Overhead: CPU time of everything but the solves, taking stock for a "
            "resumed run included, over that of the solves.",
            markdown_table(head, rows),
            "A sweep of two cases, warm cache, best of several:",
            markdown_table(["start", "s", "CPU s"], starts),
            f"{DESIGNS:,} designs on {NODES} nodes of {CORES} cores, extrapolated from the CPU "
            "time that a case takes here, and from what the parent takes for one that two Dask "
            "workers solve:",
            markdown_table(["", *STUDIES, "10 ms a path"], cluster(runs, figures["cases"])),
        ]
    )


if __name__ == "__main__":
    main()
