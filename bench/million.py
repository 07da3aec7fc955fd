"""One million designs to Parquet: time, file size, and memory that does not grow with their number.

A sweep over thickness x friction x jaw height x jaw length of snapfit-circle on all cores. Every
fifth design is a dimensionless problem of its own: 200,000 paths of 60 positions are solved, the
other designs scale them. Each sweep runs in a fresh process; its peak memory and that
of its largest worker are the operating system's. Parts are written at 64 MB, so the parent's memory
rises until its buffer is full, and no further: three millions show it. No worker is started where
that would take longer than solving. Two sweeps write curves, too: 60 rows for each design.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from joblib import cpu_count
from joblib.externals.loky import get_reusable_executor
from support import markdown_table, read_json, write_json

import fastncm

FRICTION = {"linspace": [0.0, 0.4, 4]}
THICKNESS = {"linspace": [0.0022, 0.0042, 5]}
GRIDS = {10_000: (25, 20), 100_000: (50, 100), 1_000_000: (250, 200), 3_000_000: (500, 300)}
"""Number of cases to the numbers of jaw heights and jaw lengths."""
KILOBYTES = 1024 if sys.platform == "linux" else 1
"""Unit of `ru_maxrss` in bytes."""
WITH_CURVES = (10_000, 1_000_000)


def study(cases: int, curves: bool = False) -> "fastncm.Study":
    heights, lengths = GRIDS[cases]
    return fastncm.Study(
        scene=fastncm.load_scene("snapfit-circle"),
        axes={
            "finger.thickness": THICKNESS,
            "friction.mu": FRICTION,
            "jaw.height": {"linspace": [0.0069, 0.0109, heights]},
            "jaw.length": {"linspace": [0.0162, 0.0222, lengths]},
        },
        name=f"{cases} designs",
        curves=curves,
    )


def measure(cases: int, jobs: int, curves: bool) -> dict[str, object]:
    """Run the sweep here and say what it took; for a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "sweep"
        run = fastncm.sweep(study(cases, curves), out, jobs=jobs)
        files = list(out.rglob("*.parquet"))
        size = sum(file.stat().st_size for file in files)
    get_reusable_executor().shutdown(wait=True)  # a worker's memory is known when it has ended
    return {
        "cases": run.rows,
        "curves": curves,
        "files": len(files),
        "failed": run.failed,
        "shape_paths": run.shape_paths,
        "solves": run.solves,
        "seconds": run.seconds,
        "file_MB": size / 1e6,
        "parent_peak_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * KILOBYTES / 1e6,
        "worker_peak_MB": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * KILOBYTES / 1e6,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, choices=GRIDS, help="run one sweep in this process")
    parser.add_argument("--curves", action="store_true", help="with the table of curves")
    parser.add_argument("--jobs", type=int, default=cpu_count())
    options = parser.parse_args()
    if options.cases:
        print(json.dumps(measure(options.cases, options.jobs, options.curves)))
        return

    results = []
    sweeps = [(cases, []) for cases in GRIDS] + [(cases, ["--curves"]) for cases in WITH_CURVES]
    for cases, curves in sweeps:
        command = [sys.executable, __file__, f"--cases={cases}", f"--jobs={options.jobs}", *curves]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        results.append(json.loads(done.stdout))
    write_json("million", {"jobs": options.jobs, "sweeps": results})
    print(section())


def growth(sweeps: list[dict], curves: bool) -> float:
    """Peak memory of a million designs' parent over that of 10,000."""
    peak = {s["cases"]: s["parent_peak_MB"] for s in sweeps if s["curves"] == curves}
    return peak[1_000_000] / peak[10_000]


def headlines() -> list[str]:
    figures, _ = read_json("million")
    sweeps = figures["sweeps"]
    million = next(s for s in sweeps if s["cases"] == 1_000_000 and not s["curves"])
    return [
        f"A million designs take {million['seconds']:.0f} s on {figures['jobs']} cores and "
        f"{million['file_MB']:.0f} MB of Parquet; the parent's peak memory is "
        f"{growth(sweeps, False):.2f} times that of 10,000, with curves "
        f"{growth(sweeps, True):.2f} times."
    ]


def section() -> str:
    figures, where = read_json("million")
    head = ["designs", "paths solved", "failed", "s", "files", "MB", "parent / MB", "worker / MB"]
    rows = []
    for s in figures["sweeps"]:
        cells = [f"{s['cases']:,}{', curves' if s['curves'] else ''}", f"{s['shape_paths']:,}"]
        cells += [f"{s['failed']}", f"{s['seconds']:.1f}", f"{s['files']}", f"{s['file_MB']:,.1f}"]
        cells += [f"{s['parent_peak_MB']:.0f}", f"{s['worker_peak_MB']:.0f}"]
        rows.append(cells)
    return "\n\n".join(
        [
            "## A million designs",
            f"`bench/million.py`, {where}, {figures['jobs']} workers: thickness x friction x jaw "
            "height x jaw length of snapfit-circle, 60 positions each. Peak memory is the "
            "operating system's; a worker of 0 MB was not started, since that takes longer than "
            "solving.",
            markdown_table(head, rows),
        ]
    )


if __name__ == "__main__":
    main()
