"""What the commands print and write."""

from pathlib import Path
from typing import TYPE_CHECKING

from fastncm.cli.codes import DONE, SOME_FAILED

if TYPE_CHECKING:
    import pandas as pd

    from fastncm.curve import Curve

SHOWN_ROWS = 16
SHOWN_COLUMNS = (
    "position",
    "status",
    "insertion_force_N",
    "contacts",
    "max_strain",
    "error_estimate",
)


def print_curve(curve: "Curve") -> None:
    """The curve at a glance: some of its rows, and the located peaks."""
    import numpy as np

    frame = curve.frame()
    rows = np.unique(np.linspace(0, len(frame) - 1, SHOWN_ROWS).round().astype(int))
    print(table(frame.iloc[rows][list(SHOWN_COLUMNS)]))
    if len(rows) < len(frame):
        print(f"({len(rows)} of {len(frame)} positions; --out FILE writes all rows and columns)")
    for name, peak in (("peak", curve.peak), ("retention", curve.retention)):
        if np.isfinite(peak.position):
            unit = curve.scene.position_unit
            print(f"{name}: {peak.insertion_force_N:.6g} N at position {peak.position:.7g} {unit}")


def table(frame: "pd.DataFrame") -> str:
    """Rows and columns as text."""
    return str(frame.to_string(index=False, float_format=lambda x: f"{x + 0.0:.6g}"))


def write_frame(frame: "pd.DataFrame", file: Path) -> None:
    """By suffix; whole or not at all."""
    from fastncm.sweeping.storage import write_atomically

    if file.suffix == ".csv":
        write_atomically(file, lambda name: frame.to_csv(name, index=False))
    else:
        write_atomically(file, lambda name: frame.to_parquet(name, index=False))


def report_failed_cases(folder: Path | str) -> int:
    """Print what failed in a sweep and what can be done about it; the exit code."""
    from fastncm.sweeping.read import GOOD_STATUS, count_statuses
    from fastncm.sweeping.storage import Storage

    counts = count_statuses(Storage(folder))
    failed = {key: n for key, n in counts.items() if key[0] not in GOOD_STATUS}
    for (word, advice), number in sorted(failed.items()):
        print(f"failed: {number} cases {word}. {advice}")
    return SOME_FAILED if failed else DONE
