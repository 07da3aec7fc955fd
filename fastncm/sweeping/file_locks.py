"""Locks that the operating system keeps on files, for as long as their process lives.

The one module that needs POSIX.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fastncm.errors import SweepError

try:
    import fcntl
except ImportError:
    raise SweepError(
        "sweeps need Linux, macOS or another POSIX system (under Windows: WSL), whose file locks "
        "and signals keep their tables whole; `fastncm solve` and `solve_cases` do not"
    ) from None


def try_lock(descriptor: int, shared: bool = False) -> bool | None:
    """Whether the lock of an open file is ours now, alone or with others that share it; None where
    the file system knows no locks."""
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


@contextmanager
def locked(path: Path) -> Iterator[int]:
    """Wait until the file, made if missing, is ours alone; its descriptor, for `unlock`."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        os.close(descriptor)  # which lets go of the lock


def unlock(descriptor: int) -> None:
    """Let others have the lock before the file is closed."""
    fcntl.flock(descriptor, fcntl.LOCK_UN)
