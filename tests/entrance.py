"""Entrances from Python to functions that only compiled code calls."""

from collections.abc import Callable
from typing import Any

import numba


def entrance(function: Callable[..., Any]) -> Any:
    """The function, compiled once more so that Python can call it: an `inlined` one has no wrapper
    (`fastncm.kernels.cache`) and refuses."""
    source = getattr(function, "py_func", None)
    return function if source is None else numba.njit(error_model="numpy")(source)
