"""Who a case is: a hash of its canonical parameters and of the solver's version.

The canonical parameters are those that `tabulate` resolves: all quantities in SI units and all
options, whether they come from the scene, from an axis, or from `jaw.lead_angle` in place of
`jaw.a`. Two cases with one identity have one answer, in any study and however they are written.

The solver's version is a hash of every source file that decides what comes out: the compiled code,
and the modules of the package that lower scenes and reduce traces. A version constant would be
forgotten; a hash at worst takes a new comment for a new solver. Releases of Numba and the CPU are
left out (they differ in the last digits) and are kept in the manifest instead.
"""

import hashlib
import json
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fastncm.scene import CaseGroup
from fastncm.scene.names import OPTION

IntArray = NDArray[np.int64]
_PACKAGE = Path(__file__).resolve().parent.parent
_NOT_THE_SOLVER = ("cli", "plot", "sweeping", "scene", "scenes", "__pycache__")
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
"""Multipliers of splitmix64 (Steele, Lea & Flood 2014, variant 13 of Stafford)."""


@lru_cache(maxsize=1)
def solver_version() -> str:
    """Hash of the sources that decide a result, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for file in sorted(_PACKAGE.rglob("*.py")):
        path = file.relative_to(_PACKAGE)
        if path.parts[0] not in (*_NOT_THE_SOLVER, "__init__.py", "__main__.py"):
            digest.update(path.as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def case_keys(groups: Sequence[CaseGroup]) -> IntArray:
    """The identities, shape (C,), of the C cases that `tabulate` has made groups of.

    63 bits: whole numbers that every reader of Parquet knows.
    """
    keys = np.empty(sum(len(group.rows) for group in groups), dtype=np.int64)
    for group in groups:
        keys[group.rows] = _group_keys(group)
    return keys


def _group_keys(group: CaseGroup) -> IntArray:
    """One sum of hashes over the parameters, so that shared values are hashed once."""
    options = {name: value for name, value in group.scene.flat().items() if name in OPTION}
    total = np.full(
        len(group.rows), _hash_text(solver_version() + json.dumps(options, sort_keys=True))
    )
    for name, values in group.values.items():
        shared = values[:1] if values.strides == (0,) else values
        canonical = shared + 0.0  # one zero
        canonical[np.isnan(canonical)] = np.nan  # one NaN
        bits = canonical.view(np.uint64)
        bits ^= _hash_text(name)
        total += _mixed(bits)
    return (_mixed(total) >> np.uint64(1)).view(np.int64)


@lru_cache(maxsize=256)
def _hash_text(text: str) -> np.uint64:
    return np.uint64(int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "big"))


def _mixed(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The finaliser of splitmix64, in place: every bit of the input reaches every bit of the
    output."""
    for shift, factor in ((np.uint64(30), _FIRST), (np.uint64(27), _SECOND)):
        bits ^= bits >> shift
        bits *= factor
    bits ^= bits >> np.uint64(31)
    return bits
