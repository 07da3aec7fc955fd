"""One core for measurements of solvers that are compared."""

import os
import sys


def on_one_core() -> None:
    """Start this script again with a single thread for BLAS, which asks only when it is loaded."""
    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        os.execv(sys.executable, [sys.executable, *sys.argv])
