"""One run at a time in a folder.

On a local disk, and on network file systems that know locks, the operating system holds the lock
for as long as the process lives: it is gone with a `kill -9` or a power cut, and never in the way
of the next run. Where there are no locks (object stores), the manifest is the lock: a run renews it
every few seconds, and one that has not been renewed for a minute is dead.
"""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager

from fastncm.errors import SweepError
from fastncm.sweeping.file_locks import try_lock
from fastncm.sweeping.manifest import MANIFEST, Manifest, read_manifest
from fastncm.sweeping.storage import Storage, reason

LOCK = ".lock"
DEAD_SECONDS = 60.0
"""A run that has not renewed its manifest for so long is dead."""
PATIENCE_SECONDS = 1.0
"""`fastncm status` holds the lock for some microseconds when it looks whether somebody does."""


@contextmanager
def sole_run(storage: Storage) -> Iterator[None]:
    """Hold the folder. SweepError where another run does."""
    descriptor = _open(storage)
    if descriptor is None:
        _refuse_renewed(storage)
        yield
        return
    try:
        deadline = time.monotonic() + PATIENCE_SECONDS
        while (locked := try_lock(descriptor)) is False:
            if time.monotonic() > deadline:
                raise SweepError(_in_use(storage))
            time.sleep(0.02)
        if locked is None:
            _refuse_renewed(storage)
        yield
    finally:
        os.close(descriptor)  # which lets go of the lock


def is_running(storage: Storage, manifest: Manifest) -> bool:
    """Whether the run of the manifest is alive."""
    if manifest.state != "running":
        return False
    renewed = time.time() - manifest.updated < DEAD_SECONDS
    if storage.local is None or not (storage.local / LOCK).exists():
        return renewed
    descriptor = os.open(storage.local / LOCK, os.O_RDONLY)
    try:
        held = try_lock(descriptor, shared=True) is False
    finally:
        os.close(descriptor)
    # Some network file systems do not tell other machines of a lock.
    return held or (renewed and manifest.run.host != os.uname().nodename)


def _open(storage: Storage) -> int | None:
    """The lock's file, made if missing; None where there are no locks."""
    if storage.local is None:
        return None
    try:
        return os.open(storage.local / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise SweepError(f"cannot write to {storage}: {reason(error)}") from error


def _refuse_renewed(storage: Storage) -> None:
    if not storage.exists(MANIFEST):
        return
    manifest = read_manifest(storage)
    if manifest.state == "running" and time.time() - manifest.updated < DEAD_SECONDS:
        raise SweepError(
            f"{_in_use(storage)}; if it is dead, try again in {DEAD_SECONDS:.0f} seconds"
        )


def _in_use(storage: Storage) -> str:
    try:
        run = read_manifest(storage).run
    except SweepError:
        return f"another run has just begun in {storage}"
    since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(run.started))
    return f"another run is writing to {storage}: process {run.pid} on {run.host} since {since}"
