"""What the measurements share: the machine, where results go, and the truth by shooting.

A study of the report (`bench/report.py`) is a script in this folder with three functions:
``main()`` runs it and writes `write_table` and pictures; ``section()`` gives its part of the
report in Markdown and ``headlines()`` its sentences for the first page, both from the written
tables alone.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "bench" / "results"
DATA = ROOT / "bench" / "data"
VERSIONS = ("numba", "numpy", "scipy", "pandas", "pyarrow", "joblib")

sys.path.append(str(ROOT / "tests"))

import shooting  # noqa: E402, F401  (measurements import both from here)
import shooting_surface  # noqa: E402, F401


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
    print(f"\n{file.name}")


def read_json(name: str) -> tuple[dict, str]:
    """The figures of results/NAME.json, and the machine, the revision and the day that they belong
    to, in words."""
    figures = json.loads((RESULTS / f"{name}.json").read_text())
    about = figures["machine"]
    where = f"{about['cpu']}, {about['cores']} cores, revision {about['revision']}, {about['date']}"
    return figures, where


def write_table(name: str, table: pd.DataFrame, **notes: object) -> None:
    """Write a table to results/NAME.parquet, with the machine and the notes (seeds, settings) in
    its metadata, and say so."""
    RESULTS.mkdir(exist_ok=True)
    file = RESULTS / f"{name}.parquet"
    arrow = pa.Table.from_pandas(table, preserve_index=False)
    about = json.dumps({"machine": machine(), **notes})
    pq.write_table(arrow.replace_schema_metadata({**arrow.schema.metadata, b"bench": about}), file)
    print(f"\n{file.name}: {len(table)} rows")


def read_table(name: str) -> tuple[pd.DataFrame, dict[str, object]]:
    """The table results/NAME.parquet and what was noted with it, the machine among that."""
    arrow = pq.read_table(RESULTS / f"{name}.parquet")
    return arrow.to_pandas(), json.loads(arrow.schema.metadata[b"bench"])


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown, which reads well in a terminal, too."""
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    lines = (head, ["-" * width for width in widths], *rows)
    return "\n".join(
        "| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |"
        for row in lines
    )


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table in Markdown."""
    print(markdown_table(head, rows))


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
