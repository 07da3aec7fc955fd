"""What the measurements share: the machine, where results go, and the truth by shooting."""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "bench" / "results"
DATA = ROOT / "bench" / "data"
VERSIONS = ("numba", "numpy", "scipy", "pandas", "pyarrow", "joblib")

sys.path.append(str(ROOT / "tests"))

import shooting  # noqa: E402, F401  (measurements import it from here)


def machine() -> dict[str, object]:
    """The machine, the versions and the day that a figure belongs to."""
    return {
        "cpu": _cpu_model(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        **{name: version(name) for name in VERSIONS},
        "revision": _revision(),
        "date": date.today().isoformat(),
    }


def write_json(name: str, figures: Mapping[str, object]) -> None:
    """Write the figures to results/NAME.json and say so."""
    RESULTS.mkdir(exist_ok=True)
    file = RESULTS / f"{name}.json"
    file.write_text(json.dumps({"machine": machine(), **figures}, indent=2) + "\n")
    print(f"\n{file.relative_to(ROOT)}")


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A Markdown table, which reads well in a terminal, too."""
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    for row in (head, ["-" * width for width in widths], *rows):
        print("| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |")


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor()


def _revision() -> str:
    """The commit, with "-dirty" where files differ from it; empty outside a clone."""
    command = ["git", "describe", "--always", "--dirty"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip()
