"""How long does the first `fastncm solve` take, the second one, and `--help`?

The package is copied to a temporary folder without any compiled code, so that the first run there
is the first one after an installation. Each run is a new process; of the later ones the best
counts.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from support import ROOT, markdown_table, read_json, write_json

REPEATS = 3
SOLVE = ("solve", "snapfit-circle")


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        without_cache = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "fastncm", Path(folder) / "fastncm", ignore=without_cache)
        first, message = timed(folder, *SOLVE)
        second = min(timed(folder, *SOLVE)[0] for _ in range(REPEATS))
        help_ = min(timed(folder, "--help")[0] for _ in range(REPEATS))
    print(f"the first run says: {message}\n")
    write_json("first_use", {"first_s": first, "second_s": second, "help_s": help_})
    print(section())


def headlines() -> list[str]:
    figures, _ = read_json("first_use")
    return [
        f"The first `fastncm solve` after an installation takes {figures['first_s']:.0f} s, since "
        f"it compiles; later ones take {figures['second_s']:.1f} s."
    ]


def section() -> str:
    figures, where = read_json("first_use")
    rows = [
        ["first `fastncm solve snapfit-circle`, which compiles", f"{figures['first_s']:.1f}"],
        ["later ones", f"{figures['second_s']:.2f}"],
        ["`fastncm --help`", f"{figures['help_s']:.2f}"],
    ]
    return "\n\n".join(
        ["## First use", f"`bench/first_use.py`, {where}.", markdown_table(["command", "s"], rows)]
    )


def timed(folder: str, *arguments: str) -> tuple[float, str]:
    """Elapsed seconds of one command with the package in `folder`, and the last thing on stderr."""
    command = [sys.executable, "-m", "fastncm", *arguments]
    environment = os.environ | {"PYTHONPATH": folder}
    begin = time.perf_counter()
    done = subprocess.run(
        command, cwd=folder, env=environment, check=True, capture_output=True, text=True
    )
    return time.perf_counter() - begin, done.stderr.strip().rpartition("\n")[2]


if __name__ == "__main__":
    main()
