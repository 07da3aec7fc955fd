"""Scenes by name or file."""

import os
from pathlib import Path

from fastncm.errors import SceneError
from fastncm.scene.description import Scene
from fastncm.scene.files import read_toml
from fastncm.scene.refusal import nearest

FOLDER = Path(__file__).parent.parent / "scenes"


def shipped_scenes() -> dict[str, str]:
    """The scenes that come with fastncm: name to one-line description."""
    return {
        path.stem: str(read_toml(path).tables["description"])
        for path in sorted(FOLDER.glob("*.toml"))
    }


def load_scene(name_or_path: str | os.PathLike[str]) -> Scene:
    """A shipped scene by its name, or the scene of a TOML file."""
    name = os.fspath(name_or_path)
    names = [path.stem for path in FOLDER.glob("*.toml")]
    if name in names:
        return _load_file(FOLDER / f"{name}.toml")
    if Path(name).suffix == ".toml" or Path(name).exists():
        return _load_file(Path(name))
    raise SceneError(f"no scene and no file is called '{name}'; {nearest(name, sorted(names))}")


def _load_file(path: Path) -> Scene:
    """The scene of a TOML file; without a `name` it takes the file's."""
    file = read_toml(path)
    try:
        return Scene.from_dict({"name": path.stem} | file.tables)
    except SceneError as error:
        raise file.locate(error) from None
