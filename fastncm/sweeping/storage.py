"""Where a sweep's results lie: a folder on a local disk, or any URI of pyarrow or fsspec.

A file appears under its name when it is complete and, on a local disk, safely written: it is
written under a temporary name, flushed to the disk and renamed. A part is therefore whole or
absent, whatever happens to the process.
"""

import os
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pyarrow as pa
import pyarrow.fs as pafs

from fastncm.errors import SweepError

READ_BYTES = 2**20
TEMPORARY = ".tmp"
"""Files being written are called `.NAME.tmp`; every reader of Parquet folders skips a dot."""


def reason(error: OSError) -> str:
    """The system's own words; Arrow wraps them in many of its own."""
    return os.strerror(error.errno) if error.errno else str(error)


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Call `write(temporary path)`, then give the file its name. OSErrors leave nothing behind."""
    temporary = path.with_name(f".{path.name}{TEMPORARY}")
    try:
        write(temporary)
        os.replace(temporary, path)
    finally:
        with suppress(OSError):  # a folder that refuses writing refuses this too
            temporary.unlink(missing_ok=True)


class Storage:
    """The folder of one sweep. Names are relative to it, with "/" between folder and file.

    given: what the user wrote; local: the folder's path, None where it is not on a local disk.
    """

    def __init__(self, out: str | os.PathLike[str]) -> None:
        self.given = os.fspath(out)
        self.filesystem, self.root = _resolve(self.given)
        is_local = isinstance(self.filesystem, pafs.LocalFileSystem)
        self.local = Path(self.root) if is_local else None

    def __str__(self) -> str:
        return self.given

    def path(self, name: str) -> str:
        """The path of a file within the file system."""
        return f"{self.root}/{name}" if name else self.root

    def is_file(self, name: str = "") -> bool:
        """Whether there is a file of this name; without a name, whether the folder is one."""
        return bool(self._info(name).type == pafs.FileType.File)

    def exists(self, name: str) -> bool:
        """Whether there is a file or folder of this name."""
        return bool(self._info(name).type != pafs.FileType.NotFound)

    def sizes(self, folder: str) -> dict[str, int]:
        """The files in a folder with their sizes in bytes; empty where there is no folder."""
        selector = pafs.FileSelector(self.path(folder), allow_not_found=True)
        infos = self.filesystem.get_file_info(selector)
        return {info.base_name: info.size for info in infos if info.is_file}

    def read(self, name: str) -> bytes:
        """The bytes of a file. Raises OSError."""
        with self.filesystem.open_input_stream(self.path(name)) as stream:
            return bytes(stream.read())

    def checksum(self, name: str) -> int:
        """CRC-32 of the bytes of a file. Raises OSError."""
        value = 0
        with self.filesystem.open_input_stream(self.path(name)) as stream:
            while data := stream.read(READ_BYTES):
                value = zlib.crc32(data, value)
        return value

    def write(self, name: str, write: Callable[[pa.NativeFile], object]) -> None:
        """Call `write(stream)` and give the file its name when it is complete. Raises OSError."""
        folder, _, base = self.path(name).rpartition("/")
        temporary = f"{folder}/.{base}{TEMPORARY}"
        try:
            with self.filesystem.open_output_stream(temporary) as stream:
                write(stream)
            if self.local is not None:
                _flush_to_disk(temporary)
            self.filesystem.move(temporary, f"{folder}/{base}")
        except BaseException:
            with suppress(OSError):  # a folder that refuses writing refuses this too
                self.filesystem.delete_file(temporary)
            raise

    def delete(self, name: str) -> None:
        """Remove a file; that it is gone already is no error. Raises OSError."""
        with suppress(FileNotFoundError):
            self.filesystem.delete_file(self.path(name))

    def make_folder(self, name: str = "") -> None:
        """Make a folder, and those above it. Raises OSError."""
        self.filesystem.create_dir(self.path(name), recursive=True)

    def _info(self, name: str) -> pafs.FileInfo:
        return self.filesystem.get_file_info(self.path(name))


def _resolve(given: str) -> tuple[pafs.FileSystem, str]:
    """The file system and the path in it. SweepError for a URI that nobody knows."""
    if "://" not in given:
        return pafs.LocalFileSystem(), os.path.abspath(given)
    try:
        filesystem, root = pafs.FileSystem.from_uri(given)
    except pa.ArrowInvalid:
        filesystem, root = _from_fsspec(given)
    except OSError as error:
        raise SweepError(f"cannot reach {given}: {reason(error)}") from error
    return filesystem, root.rstrip("/")


def _from_fsspec(given: str) -> tuple[pafs.FileSystem, str]:
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise SweepError(
            f"{given}: pyarrow does not know this kind of URI, and fsspec is not installed "
            "(pip install 'fastncm[remote]')"
        ) from None
    try:
        filesystem, root = url_to_fs(given)
    except (ValueError, ImportError, OSError) as error:
        raise SweepError(f"cannot reach {given}: {error}") from error
    return pafs.PyFileSystem(pafs.FSSpecHandler(filesystem)), str(root)


def _flush_to_disk(path: str) -> None:
    """A rename may reach the disk before the data: after a power cut the file would be empty."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
