"""TOML files whose errors name the file and the line."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

from fastncm.errors import SceneError

HEADER = re.compile(r"\s*\[{1,2}([^\[\]]+)\]{1,2}\s*(#.*)?$")
KEY = re.compile(r"\s*([\w\-.\"' ]+?)\s*=")
POSITION = re.compile(r" \(at line (\d+), column \d+\)$")


@dataclass(frozen=True)
class TomlFile:
    """A parsed TOML file that remembers its text, to find the line of a name again."""

    path: Path
    text: str
    tables: dict[str, object]

    def locate(self, error: SceneError) -> SceneError:
        """The same error with the file, and the line of the name at fault, in front."""
        line = self._line_of(error.name)
        where = f"{self.path}:{line}" if line else f"{self.path}"
        return SceneError(f"{where}: {error}", name=error.name)

    def _line_of(self, name: str) -> int | None:
        """The line on which a dotted name is given, or else the nearest table around it."""
        lines: dict[str, int] = {}
        table = ""
        for number, line in enumerate(self.text.splitlines(), start=1):
            if header := HEADER.match(line):
                given = table = _dotted(header[1])
            elif key := KEY.match(line):
                given = f"{table}.{_dotted(key[1])}".lstrip(".")
            else:
                continue
            while given:  # a dotted key gives its tables, too
                lines.setdefault(given, number)
                given = given.rpartition(".")[0]
        while name and name not in lines:
            name = name.rpartition(".")[0]
        return lines.get(name)


def read_toml(path: str | Path) -> TomlFile:
    """Read and parse a TOML file, or raise SceneError with the file and line."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise SceneError(f"{path}: cannot be read: {reason}") from error
    try:
        return TomlFile(path, text, tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        found = POSITION.search(message)
        line = int(found[1]) if found else max(1, len(text.splitlines()))
        raise SceneError(f"{path}:{line}: {POSITION.sub('', message)}") from error


def _dotted(key: str) -> str:
    """A TOML key without quotes and blanks."""
    return ".".join(part.strip().strip("\"'") for part in key.split("."))
