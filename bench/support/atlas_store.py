"""The atlas's pieces of work: each is done once, and what is finished is on disk.

A piece is a function and its arguments, and makes a table; its file is in results/atlas/ (which git
ignores), under the hash of everything that an answer depends on. A run that was stopped goes on
where it was, and one with another package begins anew.
"""

import hashlib
import math
import os
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import extremes
import pandas as pd
import shooting_many
from joblib import Parallel, delayed

import fastncm
from support import ROOT


class Piece(NamedTuple):
    """Its file's name, without the suffix, and what makes its table."""

    name: str
    make: Callable[..., pd.DataFrame]
    arguments: tuple[object, ...]


@cache
def folder() -> Path:
    """Where the files of this package, these scenes and these ways to judge them are."""
    digest = hashlib.sha256()
    package, here = Path(fastncm.__file__).parent, Path(__file__).parent
    judges = [Path(extremes.__file__), Path(shooting_many.__file__)]
    judges += [here / f"atlas_{name}.py" for name in JUDGES]
    for file in [*sorted(package.rglob("*.py")), *judges]:
        digest.update(file.read_bytes())
    return ROOT / "results" / "atlas" / digest.hexdigest()[:16]


JUDGES = ("runs", "bulk", "causes", "overlaps", "truth", "failures", "follow", "slsqp",
          "slsqp_sides")  # fmt: skip
"""Modules of this folder whose tables are kept."""


def run(what: str, pieces: Sequence[Piece], jobs: int, seconds: float = math.inf) -> pd.DataFrame:
    """The tables of all pieces, one below the other, by `jobs` processes. After so many seconds no
    further piece is begun: the table has those that are done, and the next run goes on.

    ``.attrs["cpu_seconds"]`` is what all of them took, in whichever run. How far it is, and
    about how long it will take, is printed.
    """
    home = folder()
    home.mkdir(parents=True, exist_ok=True)
    missing = [piece for piece in pieces if not _file(home, piece.name).exists()]
    begin, until = time.perf_counter(), time.time() + seconds
    tasks = (delayed(_make)(home, piece, until) for piece in missing)
    done = Parallel(n_jobs=jobs, return_as="generator_unordered")(tasks)
    for count, said in enumerate(done, start=1):
        left = (time.perf_counter() - begin) / count * (len(missing) - count)
        whole = len(pieces) - len(missing) + count
        print(f"{what}, {whole} of {len(pieces)}: {said}; about {left:.0f} s left", flush=True)
    files = [_file(home, piece.name) for piece in pieces]
    parts = [pd.read_parquet(file) for file in files if file.exists()]
    table = pd.concat([part for part in parts if len(part)], ignore_index=True)
    table.attrs = {"cpu_seconds": sum(part.attrs["cpu_seconds"] for part in parts)}
    return table


def _file(home: Path, name: str) -> Path:
    return home / f"{name}.parquet"


def _make(home: Path, piece: Piece, until: float) -> str:
    """Make a table and write it, unless it is too late."""
    if time.time() > until:
        return f"{piece.name} left for the next run"
    begin = time.process_time()
    table = piece.make(*piece.arguments)
    table.attrs = {"cpu_seconds": time.process_time() - begin}
    temporary = home / f"{piece.name}.{os.getpid()}"
    table.to_parquet(temporary)
    temporary.replace(_file(home, piece.name))
    return f"{piece.name} took {table.attrs['cpu_seconds']:.0f} s of CPU time"
