"""What the user types: `--set` assignments and file names."""

import tomllib
from collections.abc import Sequence
from pathlib import Path

from fastncm.errors import SceneError

OUT_SUFFIXES = (".csv", ".parquet")
PLOT_SUFFIXES = (".png", ".pdf", ".svg")


def settings(assignments: Sequence[str]) -> dict[str, object]:
    """`NAME=VALUE` with the value in TOML; a bare word is a string."""
    values: dict[str, object] = {}
    for assignment in assignments:
        name, equals, value = (part.strip() for part in assignment.partition("="))
        if not equals or not name or not value:
            raise SceneError(f"--set {assignment}: expected NAME=VALUE")
        try:
            values[name] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            values[name] = value
    return values


def check_file(file: Path | None, option: str, suffixes: Sequence[str]) -> None:
    """Refuse a file that could not be written, before any work is done."""
    if file is None:
        return
    if file.suffix not in suffixes:
        raise SceneError(f"{option} {file}: the name must end in {' or '.join(suffixes)}")
    if not file.absolute().parent.is_dir():
        raise SceneError(f"{option} {file}: there is no folder {file.parent}")
