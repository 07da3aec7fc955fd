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

from support import ROOT, print_table, write_json

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
    rows = [
        ["first `fastncm solve snapfit-circle`", f"{first:.1f}"],
        ["second one", f"{second:.2f}"],
        ["`fastncm --help`", f"{help_:.2f}"],
    ]
    print_table(["command", "s"], rows)
    write_json("first_use", {"first_s": first, "second_s": second, "help_s": help_})


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
