"""Taking the folder of a sweep: whose it is, what is in it, and that this run has it now."""

import sys

import pyarrow.parquet as pq

from fastncm.errors import SweepError
from fastncm.sweeping.identity import solver_version
from fastncm.sweeping.manifest import (
    MANIFEST,
    Manifest,
    differences,
    in_words,
    read_manifest,
    write_manifest,
)
from fastncm.sweeping.parts import TABLES
from fastncm.sweeping.read import CASES_FILE
from fastncm.sweeping.samples import Samples
from fastncm.sweeping.stock import Stock, clear_away, take_stock
from fastncm.sweeping.storage import Storage, reason
from fastncm.sweeping.study import LISTED, Study


def claim(storage: Storage, study: Study) -> Manifest | None:
    """Whether `study` may write to the folder; touches nothing.

    Returns the manifest of an earlier run of the same study, or None. SweepError where the folder
    holds anything else.
    """
    if storage.is_file():
        raise SweepError(f"{storage} is a file: the results need a folder")
    if not storage.exists(MANIFEST):
        for name in TABLES:
            if storage.sizes(name):
                raise SweepError(
                    f"{storage} already holds a folder '{name}' that no sweep of fastncm wrote; "
                    "nothing was touched: choose another folder"
                )
        return None
    manifest = read_manifest(storage)
    if found := differences(manifest, study.to_dict(), solver_version()):
        raise SweepError(
            f"{storage} already holds the table of another study ('{manifest.study.get('name')}'): "
            f"{in_words(found)}; nothing was touched: choose another folder, or remove this one"
        )
    return manifest


def is_complete(storage: Storage, study: Study, manifest: Manifest) -> bool:
    """Whether the run of the manifest came to its end, every case is in the table, and every file
    of it in order."""
    if manifest.state != "complete":
        return False
    stock = take_stock(storage, study, manifest.checksums)
    return bool(stock.done.all()) and not stock.useless


def make_folders(storage: Storage, study: Study) -> None:
    """Make the folders of the study's tables (SweepError)."""
    try:
        for name in ("", *TABLES[: 1 + study.curves]):
            storage.make_folder(name)
    except OSError as error:
        raise SweepError(f"cannot write to {storage}: {reason(error)}") from error


def begin(storage: Storage, study: Study, manifest: Manifest) -> Stock:
    """Take the folder: from now on the manifest names this run. Returns what is done already."""
    try:
        stock = take_stock(storage, study, manifest.checksums)
        clear_away(storage, stock)
        manifest.run.found = stock.found
        if isinstance(study.cases, Samples) and study.design.kind == LISTED:
            cases = study.cases.to_arrow()
            storage.write(CASES_FILE, lambda stream: pq.write_table(cases, stream))
        write_manifest(storage, manifest)
    except OSError as error:
        raise SweepError(f"cannot write to {storage}: {reason(error)}") from error
    if read_manifest(storage).run.token != manifest.run.token:  # only where there are no locks
        raise SweepError(f"another run has just begun in {storage}")
    for sentence in stock.found:
        print(f"fastncm: {storage}: {sentence}", file=sys.stderr)
    return stock
