"""The one decorator for compiled code, and where its machine code is kept.

Numba's own ``cache=True`` looks only at the file of the function itself: after an edit to a helper
in *another* file it runs stale machine code and gives wrong answers. Here the cache directory
carries a hash of every source file that holds compiled code, so that an edit to any of them starts
a new one.
"""

import functools
import getpass
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

#: True where Numba is told to compile nothing (``NUMBA_DISABLE_JIT=1``), for coverage.
JIT_OFF = bool(getattr(config, "DISABLE_JIT", False))

_PACKAGE = Path(__file__).resolve().parent.parent
#: Folders whose files hold compiled code.
COMPILED_FOLDERS = ("kernels", "sqp", "path")


def source_hash() -> str:
    """Hash of all sources that hold compiled code, and of what else changes the machine code."""
    digest = hashlib.sha256()
    for folder in COMPILED_FOLDERS:
        for file in sorted((_PACKAGE / folder).rglob("*.py")):
            digest.update(file.relative_to(_PACKAGE).as_posix().encode())
            digest.update(file.read_bytes())
    switches = [getattr(config, name) for name in ("BOUNDSCHECK", "OPT")]
    digest.update(f"{numba.__version__} {switches}".encode())
    return digest.hexdigest()[:16]


@functools.lru_cache(maxsize=1)
def cache_directory() -> Path:
    """The directory of this version's machine code; made when missing, older versions removed.

    It lies in the package; where that is read-only, in ``$XDG_CACHE_HOME`` or the temporary folder.
    """
    name = f"fastncm-{source_hash()}"
    roots = [
        _PACKAGE / "__pycache__",
        Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "fastncm",
        Path(tempfile.gettempdir()) / f"fastncm-{getpass.getuser()}",
    ]
    for root in roots:
        try:
            (root / name).mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=root / name).close()
        except OSError:
            continue
        for old in root.glob("fastncm-*"):
            if old.name != name:
                shutil.rmtree(old, ignore_errors=True)
        return root / name
    raise OSError(f"no writable folder for compiled code; tried {', '.join(map(str, roots))}")


def is_cold(jaw: bool) -> bool:
    """True where the next solve has to compile first: no machine code of this version on disk for
    fingers with a jaw, or for direct contact."""
    entry = "trace_lanes" if jaw else "trace_surfaces"
    return not JIT_OFF and not any(cache_directory().glob(f"*.{entry}-*.nbi"))


class _KernelLocator(_CacheLocator):
    """Keeps the machine code of every kernel in the hashed directory."""

    def __init__(self, py_func: Callable[..., Any]):
        self._py_file = py_func.__code__.co_filename
        self._lineno = py_func.__code__.co_firstlineno

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "_KernelLocator":
        return cls(py_func)

    def get_cache_path(self) -> str:
        return str(cache_directory())

    def get_source_stamp(self) -> str:
        return cache_directory().name

    def get_disambiguator(self) -> str:
        return f"{Path(self._py_file).parent.name}-{self._lineno}"


class _KernelCacheImpl(CompileResultCacheImpl):
    _locator_classes = [_KernelLocator]  # type: ignore[list-item]


class _KernelCache(FunctionCache):
    _impl_class = _KernelCacheImpl


_OPTIONS: dict[str, Any] = {
    "nogil": True,
    # lets divisions vectorise
    "error_model": "numpy",
    # sums may be reordered and multiplications fused; NaN and infinity stay honest
    "fastmath": {"reassoc", "contract", "nsz", "arcp"},
}


def _compile(function: Callable[..., Any], **extra: Any) -> Any:
    if JIT_OFF:
        return function
    options: dict[str, Any] = {**_OPTIONS, **extra, "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(**options)(function)
    compiled._cache = _KernelCache(function)
    return compiled


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that allocates nothing, in nopython mode, without the GIL, cached as
    above.

    Compiled without Numba's reference counts (``_nrt=False``): their atomic operations on every
    array of every named tuple made a contact solve five times slower, and compilation three times.
    """
    return _compile(function, _nrt=False)


def inner(function: Callable[..., Any]) -> Any:
    """Like `kernel`, for functions of the whole state that only compiled code calls.

    They have no wrapper for calls from Python: unboxing a named tuple of 40 arrays is most of their
    code.
    """
    return _compile(function, _nrt=False, no_cpython_wrapper=True)


def driver(function: Callable[..., Any]) -> Any:
    """Like `kernel`, for the few functions that allocate (workspaces, results)."""
    return _compile(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Like `kernel`, for the small functions inside the loop over lanes: always inlined by LLVM.

    A call that returns a tuple of 13 numbers costs 40 ns, the gap itself 3 ns.
    """
    return _compile(function, _nrt=False, forceinline=True)


def inlined_in_order(function: Callable[..., Any]) -> Any:
    """Like `inlined`, for arithmetic whose order matters: sums are not reordered."""
    return _compile(function, _nrt=False, forceinline=True, fastmath={"contract", "nsz", "arcp"})
