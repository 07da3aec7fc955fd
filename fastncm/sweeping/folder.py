"""The folder of a sweep: `study.json`, `cases/` and `curves/`, and whose it is.

`study.json` is written before the first row and after the last one. A folder belongs to one study:
another study is refused and touches nothing. The same study finds its table complete and leaves it
alone, or starts over where an earlier run broke off.
"""

import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fastncm.errors import SweepError
from fastncm.scene.description import HEADINGS
from fastncm.sweeping.parts import reason, write_atomically
from fastncm.sweeping.study import Study

MANIFEST = "study.json"
TABLES = ("cases", "curves")


@dataclass
class Manifest:
    """What `study.json` holds."""

    study: dict[str, Any]  # Study.to_dict
    versions: dict[str, str]
    state: str = "running"  # running, complete, interrupted or broken off
    cases: int = 0  # size of the grid
    rows: int = 0  # cases finished
    failed: int = 0  # of these, rows that are neither converged nor without contact
    shape_paths: int = 0  # dimensionless problems solved along the path
    solves: int = 0  # contact solves
    seconds: float = 0.0


def read_manifest(out: Path) -> Manifest:
    """The manifest of a sweep's folder. SweepError where there is none."""
    path = out / MANIFEST
    try:
        return Manifest(**json.loads(path.read_text()))
    except FileNotFoundError:
        raise SweepError(f"{out} holds no sweep: there is no {MANIFEST} in it") from None
    except (OSError, ValueError, TypeError) as error:
        raise SweepError(f"cannot read {path}: {error}") from error


def write_manifest(out: Path, manifest: Manifest) -> None:
    """Replace `study.json`. Raises OSError."""
    text = json.dumps(asdict(manifest), indent=1)
    write_atomically(out / MANIFEST, lambda name: name.write_text(text + "\n"))


def claim(out: Path, study: Study) -> Manifest | None:
    """Whether `study` may write to `out`; touches nothing.

    Returns the manifest of an earlier run of the same study, or None. SweepError where the folder
    holds another study's table.
    """
    if out.exists() and not out.is_dir():
        raise SweepError(f"{out} is a file: the results need a folder")
    if not (out / MANIFEST).exists():
        for name in TABLES:
            if (out / name).exists():
                raise SweepError(
                    f"{out} already holds a folder '{name}' that no sweep of fastncm wrote; "
                    "nothing was touched: choose another folder"
                )
        return None
    manifest = read_manifest(out)
    if not same_table(manifest.study, study.to_dict()):
        raise SweepError(
            f"{out} already holds the table of another study ('{manifest.study.get('name')}'); "
            "nothing was touched: choose another folder, or remove this one"
        )
    return manifest


def same_table(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two studies (as plain values) give the same table, whatever they are called."""

    def relevant(study: Mapping[str, Any]) -> tuple[object, ...]:
        scene = {key: value for key, value in study["scene"].items() if key not in HEADINGS}
        table = json.dumps([scene, study["curves"]], sort_keys=True)
        return table, json.dumps(study["axes"])  # the order of the axes numbers the cases

    return relevant(one) == relevant(other)


def begin(out: Path, manifest: Manifest) -> None:
    """Make the folder ready for the first row; removes what a broken-off run left."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_manifest(out, manifest)
        for name in TABLES:
            if (out / name).exists():
                shutil.rmtree(out / name)
        (out / "cases").mkdir()
        if manifest.study["curves"]:
            (out / "curves").mkdir()
    except OSError as error:
        raise SweepError(f"cannot write to {out}: {reason(error)}") from error
