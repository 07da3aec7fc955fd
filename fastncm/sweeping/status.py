"""How far a sweep has come, in words; for a folder that is being written to, too."""

import time

from fastncm.sweeping.lock import is_running
from fastncm.sweeping.manifest import read_manifest
from fastncm.sweeping.parts import survey
from fastncm.sweeping.storage import Storage


def describe(storage: Storage) -> list[str]:
    """Lines on the run, its progress and what is not in order. SweepError where there is none."""
    manifest = read_manifest(storage)
    run = manifest.run
    alive = is_running(storage, manifest)
    parts, damage = survey(storage)
    rows = sum(part.rows for part in parts)
    state = "died" if manifest.state == "running" and not alive else manifest.state
    lines = [
        f"{manifest.study['name']}: {state}, {rows} of {manifest.cases} cases in the table, "
        f"{manifest.seconds:.2f} s"
    ]
    lines.append(
        f"  run: process {run.pid} on {run.host} ({run.machine}), {run.backend}, jobs: {run.jobs}, "
        f"begun {_at(run.started)}, last sign {_at(manifest.updated)}"
    )
    if alive:
        waiting = manifest.received - rows
        left = manifest.cases - manifest.received
        lines.append(f"  {waiting} cases solved and not yet written, {left} to be solved")
    elif manifest.state != "complete":
        lines.append("  the same sweep command solves the cases that are missing")
    lines += [f"  found: {sentence}" for sentence in run.found]
    lines += [f"  damaged: {sentence}" for sentence in damage]
    return lines


def _at(seconds: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(seconds))
