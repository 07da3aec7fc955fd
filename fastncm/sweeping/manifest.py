"""`study.json`: the study that a folder belongs to, who works on it, and how far it has come.

It is replaced as a whole every few seconds, so that `fastncm status` can be asked at any time and
from any machine that sees the folder. Progress in it may lag behind the parts, which are the truth.
"""

import json
import os
import platform
import socket
import time
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from fastncm.errors import SweepError
from fastncm.scene.description import HEADINGS
from fastncm.sweeping.storage import Storage, reason

MANIFEST = "study.json"
SHOWN_DIFFERENCES = 4
LONGEST_VALUE = 40


@dataclass
class Run:
    """The process that works, or worked last, on a folder."""

    backend: str
    jobs: int
    host: str = field(default_factory=socket.gethostname)
    pid: int = field(default_factory=os.getpid)
    machine: str = field(
        default_factory=lambda: f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    )
    started: float = field(default_factory=time.time)  # seconds since 1970
    token: str = field(default_factory=lambda: uuid.uuid4().hex)
    found: list[str] = field(default_factory=list)  # sentences on what an earlier run left


@dataclass
class Manifest:
    """What `study.json` holds."""

    study: dict[str, Any]  # Study.to_dict
    solver: str  # identity.solver_version
    versions: dict[str, str]
    run: Run
    state: str = "running"  # running, complete, interrupted or broken off
    cases: int = 0  # of the study
    rows: int = 0  # cases in the table
    received: int = 0  # cases solved, in the table or about to be written
    failed: int = 0  # of the rows, those that are neither converged nor without contact
    shape_paths: int = 0  # dimensionless problems solved along the path
    solves: int = 0  # contact solves
    seconds: float = 0.0  # of all runs together
    checksums: dict[str, int] = field(default_factory=dict)  # CRC-32 of parts of the cases table
    updated: float = 0.0  # seconds since 1970


def read_manifest(storage: Storage) -> Manifest:
    """The manifest of a sweep's folder. SweepError where there is none."""
    try:
        plain = json.loads(storage.read(MANIFEST))
        return Manifest(**plain | {"run": Run(**plain["run"])})
    except FileNotFoundError:
        raise SweepError(f"{storage} holds no sweep: there is no {MANIFEST} in it") from None
    except OSError as error:
        raise SweepError(f"cannot read {storage}/{MANIFEST}: {reason(error)}") from error
    except (ValueError, TypeError, KeyError) as error:
        raise SweepError(f"{storage}/{MANIFEST} is not one of this fastncm: {error!r}") from error


def write_manifest(storage: Storage, manifest: Manifest) -> None:
    """Replace `study.json`. Raises OSError."""
    manifest.updated = time.time()
    text = json.dumps(asdict(manifest), indent=1) + "\n"
    storage.write(MANIFEST, lambda stream: stream.write(text.encode()))


def differences(theirs: Manifest, study: Mapping[str, Any], solver: str) -> list[str]:
    """In which values another table differs from the one asked for, in words; empty: in none.

    What a study is called and how it is reported is no part of its table.
    """
    there = {"solver's version": theirs.solver} | dict(_flat(_relevant(theirs.study)))
    here = {"solver's version": solver} | dict(_flat(_relevant(study)))
    return [
        f"{name} is {_shown(there.get(name))} there, {_shown(here.get(name))} here"
        for name in {**there, **here}
        if there.get(name) != here.get(name)
    ]


def in_words(found: list[str]) -> str:
    """The first few differences."""
    more = len(found) - SHOWN_DIFFERENCES
    return "; ".join(found[:SHOWN_DIFFERENCES]) + (f"; and {more} more" if more > 0 else "")


def _relevant(study: Mapping[str, Any]) -> dict[str, Any]:
    """As JSON gives it back, so that tuples and lists are the same."""
    scene = {key: value for key, value in study["scene"].items() if key not in HEADINGS}
    table = {key: study[key] for key in ("design", "curves")} | {"scene": scene}
    if len(study["axes"]) > 1:
        table["order of the axes"] = list(study["axes"])  # it numbers the cases
    table["axes"] = {f"'{name}'": axis for name, axis in study["axes"].items()}
    return dict(json.loads(json.dumps(table)))


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        if isinstance(value, dict) and prefix != "axes.":
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _shown(value: object) -> str:
    if value is None:
        return "not given"
    text = str(value)
    if len(text) <= LONGEST_VALUE:
        return text
    length = f" ({len(value)} values)" if isinstance(value, list) else ""
    return text[:LONGEST_VALUE] + "..." + length
