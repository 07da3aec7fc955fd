"""Tasks in worker processes of this machine, which may be killed at any moment.

Results come back through files. A process that is killed while it writes into the pipe that all
workers share would leave half a message there, and the parent would wait for the other half for
ever (seen with joblib 1.6, one kill in four). The name of a file is shorter than PIPE_BUF: such a
message is written whole or not at all (POSIX, write()).
"""

import os
import pickle
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from fastncm.errors import SweepError
from fastncm.sweeping.storage import reason
from fastncm.sweeping.tasks import Finished, Task, run_in_worker

_FOLDERS: set[str] = set()
"""Folders for results that this worker has written to."""


@contextmanager
def exchange() -> Iterator[str]:
    """A folder for results on their way; gone at the end."""
    folder = tempfile.mkdtemp(prefix="fastncm-")
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def run_in_process(task: Task, folder: str) -> str:
    """`run_in_worker`; the result is in the file whose name is returned."""
    _leave_to_parent(folder)
    finished = run_in_worker(task)
    try:
        descriptor, name = tempfile.mkstemp(dir=folder)
        with open(descriptor, "wb") as file:
            pickle.dump(finished, file, protocol=pickle.HIGHEST_PROTOCOL)
    except OSError as error:
        raise SweepError(
            f"cannot write to {folder}: {reason(error)}; TMPDIR names another place"
        ) from error
    return name


def collect(name: str) -> Finished:
    """The result that `run_in_process` left, and the file removed."""
    path = Path(name)
    finished: Finished = pickle.loads(path.read_bytes())
    path.unlink()
    return finished


def _leave_to_parent(folder: str) -> None:
    """In a worker: it ends with its parent and clears the folder, and Ctrl-C is the parent's."""
    _FOLDERS.add(folder)
    _watch_parent()


@cache
def _watch_parent() -> None:
    """Once in a worker: start the thread that looks after the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        for folder in _FOLDERS:
            shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="parent-watch").start()
