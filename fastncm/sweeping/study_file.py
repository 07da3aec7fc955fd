"""Study files: TOML that names a scene and the axes to vary.

scene = "snapfit-circle"            # a shipped scene, or a file beside this one

[set]                               # optional: values that differ from the scene's
"solver.rtol" = 1e-8

[axes]                              # a full grid over all axes
"finger.thickness" = { linspace = [0.0022, 0.0042, 21] }    # or geomspace
"friction.mu" = [0.0, 0.2, 0.4]

[design]                            # optional: cases other than the full grid
kind = "sobol"                      # also "latin-hypercube", "halton", "list"
samples = 1024                      # the axes then say { uniform = [low, high] }, or loguniform
seed = 1
# table = "samples.csv"             # or all cases from a file (.csv, .parquet), without [axes]

[output]
curves = true                       # write the long table of curves, too

[report]                            # which designs are printed as the best
column = "peak_force_N"
best = "min"
limits = { max_strain = 0.02 }      # largest values allowed
"""

import os
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from fastncm.errors import SceneError
from fastncm.scene import Scene, TomlFile, load_scene, read_toml
from fastncm.scene.refusal import refusal, unknown
from fastncm.sweeping.axes import RANGES, SPACES
from fastncm.sweeping.study import LISTED, Design, Report, Study

KEYS = ("name", "scene", "set", "axes", "design", "output", "report")
TABLE_SUFFIXES = (".csv", ".parquet")


def load_study(path: str | os.PathLike[str]) -> Study:
    """The validated study of a TOML file. SceneError with file and line for what is wrong."""
    file = read_toml(Path(path))
    try:
        study = _study(file)
        study.check()
    except SceneError as error:
        if error.name.startswith("axes.") and not file.tables.get("axes"):
            error = SceneError(str(error), name="design.table")  # where the axes come from
        raise file.locate(error) from None
    return study


def read_cases(path: str | os.PathLike[str]) -> pd.DataFrame:
    """Cases from a CSV or Parquet file, one row per case, dotted names as columns (SceneError)."""
    path = Path(path)
    if path.suffix not in TABLE_SUFFIXES:
        raise SceneError(f"{path}: the name of a table must end in {' or '.join(TABLE_SUFFIXES)}")
    try:
        frame = pd.read_csv(path) if path.suffix == ".csv" else pd.read_parquet(path)
    except (OSError, ValueError) as error:  # Arrow's and pandas' own are among these
        raise SceneError(f"cannot read {path}: {error}") from error
    if len(frame) == 0 or len(frame.columns) == 0:
        raise SceneError(f"{path} holds no cases")
    return frame


def _study(file: TomlFile) -> Study:
    tables = file.tables
    _refuse_unknown("", tables, KEYS)
    name = tables.get("name", file.path.stem)
    if not isinstance(name, str):
        raise refusal("name", name, "a string")
    output = _table(tables, "output")
    _refuse_unknown("output.", output, ("curves",))
    curves = output.get("curves", False)
    if not isinstance(curves, bool):
        raise refusal("output.curves", curves, "true or false")
    report = _table(tables, "report")
    _refuse_unknown("report.", report, ("column", "best", "limits"))
    _table(report, "limits", "report.limits")
    design = _table(tables, "design")
    _refuse_unknown("design.", design, ("kind", "samples", "seed", "table"))
    axes: object = dict(_dotted(_table(tables, "axes")))
    if "table" in design:
        axes = _listed_cases(file, design, axes)
        design = {"kind": LISTED}
    return Study(
        scene=_scene(file),
        axes=axes,  # type: ignore[arg-type]
        name=name,
        curves=curves,
        report=Report(**report),  # type: ignore[arg-type]
        design=Design(**design),  # type: ignore[arg-type]
    )


def _listed_cases(file: TomlFile, design: Mapping[str, object], axes: object) -> pd.DataFrame:
    """The table of cases beside the study file."""
    table = design["table"]
    if not isinstance(table, str):
        raise refusal("design.table", table, "the name of a file")
    if axes or len(design) > 1:
        raise SceneError(
            "a table holds all cases: [axes], design.kind, samples and seed must be left out",
            name="design.table",
        )
    try:
        return read_cases(file.path.parent / table)
    except SceneError as error:
        raise SceneError(str(error), name="design.table") from None


def _scene(file: TomlFile) -> Scene:
    """The scene with the study's [set] applied; a path is relative to the study file."""
    name = file.tables.get("scene")
    if not isinstance(name, str):
        raise SceneError("scene is missing: the name of a scene or of its file", name="scene")
    beside = file.path.parent / name
    try:
        scene = load_scene(beside if beside.is_file() else name)
    except SceneError as error:
        raise SceneError(str(error), name="scene") from None
    changes = dict(_dotted(_table(file.tables, "set")))
    try:
        return scene.replace(changes)
    except SceneError as error:
        raise SceneError(str(error), name=f"set.{error.name}") from None


def _table(tables: Mapping[str, object], key: str, shown: str = "") -> dict[str, object]:
    """A table of the file; empty where it is left out."""
    table = tables.get(key, {})
    if not isinstance(table, dict):
        raise SceneError(f"{shown or key} must be a table", name=shown or key)
    return table


def _refuse_unknown(prefix: str, table: Mapping[str, object], known: tuple[str, ...]) -> None:
    for key in table:
        if key not in known:
            raise SceneError(str(unknown(key, known)), name=prefix + key)


def _dotted(table: Mapping[str, object], prefix: str = "") -> list[tuple[str, object]]:
    """Entries by dotted name, whether the key is written in quotes or as nested tables."""
    entries: list[tuple[str, object]] = []
    for key, value in table.items():
        if isinstance(value, dict) and not {*SPACES, *RANGES} & value.keys() and "." not in key:
            entries += _dotted(value, f"{prefix}{key}.")
        else:
            entries.append((prefix + key, value))
    return entries
