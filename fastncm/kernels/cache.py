"""The one decorator for compiled code, and where its machine code is kept.

Numba's own ``cache=True`` looks only at the file of the function itself: after an edit to a helper
in *another* file it runs stale machine code and gives wrong answers. Here the cache directory
carries a hash of every source file that holds compiled code, so that an edit to any of them starts
a new one.
"""

import ctypes
import functools
import gc
import getpass
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from llvmlite import binding as llvm
from numba.core import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags

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


#: What `is_compiled` has found: every solve asks.
_found: set[str] = set()


def is_compiled(entry: str) -> bool:
    """True where machine code of the function `entry` ("module.function", one that Python calls) is
    on disk, or none is wanted."""
    if not JIT_OFF and entry not in _found and any(cache_directory().glob(f"{entry}-*.nbi")):
        _found.add(entry)
    return JIT_OFF or entry in _found


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


#: A function of Python's C interface that takes anything and raises TypeError.
_REFUSE = ctypes.cast(ctypes.pythonapi.PyErr_BadArgument, ctypes.c_void_p).value or 0


class _LinkedLibrary(JITCodeLibrary):
    """Code of a function that only compiled code calls: kept as it was lowered, to be optimised and
    turned into machine code with each function that Python calls, and not once more by itself."""

    def _optimize_final_module(self) -> None:
        """Left to the callers."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        engine = self._codegen._engine
        for variable in self._final_module.global_variables:
            # Numba writes into each function's environment right after this
            if variable.name.startswith("_ZN08NumbaEnv") and not engine.is_symbol_defined(
                variable.name
            ):
                module = llvm.parse_assembly(f'@"{variable.name}" = common global ptr null')
                module.data_layout = self._codegen._data_layout
                module.triple = self._final_module.triple
                self._codegen._add_module(module)
                engine.finalize_object()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Where a call from Python goes: to a TypeError."""
        self._ensure_finalized()
        return _REFUSE


class _SetFlags(Flags):
    """Flags that are equal where the same ones are set to the same.

    Numba's own comparison asks for each of thirty by its name, and it looks them up for every
    operator that it compiles.
    """

    def __hash__(self) -> int:
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Flags) and self._values == other._values


class _KernelCompiler(CompilerBase):
    """Numba's compiler, a quarter quicker: with `_SetFlags`, and without the garbage collector, to
    which the millions of small objects that compiling leaves look like work."""

    def __init__(self, typing, target, library, arguments, result, flags, names):
        super().__init__(typing, target, library, arguments, result, _SetFlags(flags), names)

    def define_pipelines(self) -> list[Any]:
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]

    def _compile_core(self) -> Any:
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super()._compile_core()
        finally:
            if collecting:
                gc.enable()


class _LinkedCompiler(_KernelCompiler):
    """The same with a `_LinkedLibrary`."""

    def define_pipelines(self) -> list[Any]:
        codegen = self.state.targetctx.codegen()
        self.state.library = codegen.create_library(self.state.func_id.func_qualname)
        self.state.library.__class__ = _LinkedLibrary
        return super().define_pipelines()


_OPTIONS: dict[str, Any] = {
    "nogil": True,
    # lets divisions vectorise
    "error_model": "numpy",
    # multiplications may be fused; sums keep their order, else the first lanes, whose part of a
    # loop LLVM peels off, differ from the others in the last digit; NaN and infinity stay honest
    "fastmath": {"contract", "nsz", "arcp"},
}


def _compile(function: Callable[..., Any], **extra: Any) -> Any:
    if JIT_OFF:
        return function
    options: dict[str, Any] = {**_OPTIONS, **extra, "no_cfunc_wrapper": True}
    if "no_cpython_wrapper" in extra:
        return numba.njit(pipeline_class=_LinkedCompiler, **options)(function)
    compiled: Any = numba.njit(pipeline_class=_KernelCompiler, **options)(function)
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
    """Like `kernel`, for functions that only compiled code calls: without a wrapper for calls from
    Python, and optimised with their callers only.

    LLVM decides where it puts them into their callers. Most stay functions of their own, which
    makes a fifth of the machine code, and of the time that it takes, of what all together would.
    """
    return _compile(function, _nrt=False, no_cpython_wrapper=True)


def driver(function: Callable[..., Any]) -> Any:
    """Like `kernel`, for the few functions that allocate (workspaces, results)."""
    return _compile(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Like `inner`, for the small functions inside the loop over lanes: always inlined by LLVM.

    A call that returns a tuple of 13 numbers costs 40 ns, the gap itself 3 ns.
    """
    return _compile(function, _nrt=False, forceinline=True, no_cpython_wrapper=True)
