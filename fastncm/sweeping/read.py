"""Reading a sweep's folder: the tables as pandas, and what can be said of them part by part."""

import json
import os
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from fastncm.errors import SweepError
from fastncm.sweeping.manifest import MANIFEST, read_manifest
from fastncm.sweeping.parts import TABLES, DamagedPart, files_of, open_part, survey
from fastncm.sweeping.samples import frame_from_arrow
from fastncm.sweeping.storage import Storage
from fastncm.sweeping.study import LISTED, Report, Study

GOOD_STATUS = ("converged", "no_contact")
"""A path that never touches is a result, not a failure."""
CASES_FILE = "design.parquet"
"""The cases of a study that lists them."""


def load(
    out: str | os.PathLike[str],
    table: str = "cases",
    *,
    case_ids: Sequence[int] | np.ndarray | None = None,
    columns: Sequence[str] | None = None,
) -> pd.DataFrame:
    """A sweep's table, sorted by case_id (curves: and along the path); units are in `.attrs`.

    out: a folder, or the URI of one. table: "cases", or "curves" where the study asked for them.
    case_ids, columns: these only. Rows of a sweep that is running or was broken off are those in
    its finished parts.
    """
    if table not in TABLES:
        raise SweepError(f"there is no table '{table}': 'cases' and 'curves' are known")
    storage = Storage(out)
    where = None if case_ids is None else pc.field("case_id").isin(pa.array(case_ids))
    wanted = None if columns is None else list(dict.fromkeys(["case_id", *columns]))
    parts = list(_read(storage, table, wanted, where))
    if not parts:
        manifest = read_manifest(storage)
        if table == "curves" and not manifest.study["curves"]:
            raise SweepError(f"{out} has no curves: the study has no [output] curves = true")
        raise SweepError(f"{out} has no finished rows (the sweep is {manifest.state})")
    rows = pa.concat_tables(parts, promote_options="permissive")
    order = np.argsort(rows["case_id"].to_numpy(), kind="stable")
    if columns is not None:
        rows = rows.select(list(columns))
    frame: pd.DataFrame = rows.take(pa.array(order)).to_pandas()
    frame.attrs["units"] = {field.name: field.metadata[b"unit"].decode() for field in rows.schema}
    frame.attrs["study"] = json.loads(parts[0].schema.metadata[b"study"])
    return frame


def read_study(storage: Storage) -> Study:
    """The study that a folder belongs to."""
    study = read_manifest(storage).study
    if study["design"]["kind"] != LISTED:
        return Study.from_dict(study)
    with storage.filesystem.open_input_file(storage.path(CASES_FILE)) as file:
        return Study.from_dict(study, frame_from_arrow(pq.read_table(file)))


def best_designs(storage: Storage, report: Report, n: int) -> pd.DataFrame:
    """The n best converged designs within the report's limits, best first; reads part by part."""
    best = pd.DataFrame()
    for table in _read(storage, "cases", None, pc.field("status") == "converged"):
        rows = table.to_pandas()
        for column, limit in report.limits.items():
            rows = rows[rows[column] <= limit]
        # Ties go to the smaller case_id, so that the answer does not depend on the parts.
        best = (
            pd.concat([best, rows.dropna(subset=[report.column])])
            .sort_values([report.column, "case_id"], ascending=[report.best == "min", True])
            .head(n)
        )
    return best.reset_index(drop=True)


def count_statuses(storage: Storage) -> Counter[tuple[str, str]]:
    """Number of cases by (status, advice) in the parts that are whole; reads part by part."""
    counts: Counter[tuple[str, str]] = Counter()
    parts, _ = survey(storage)
    for part in parts:
        with open_part(storage, "cases", part.name) as file:
            table = file.read(columns=["status", "advice"])
        groups = table.group_by(["status", "advice"]).aggregate([([], "count_all")])
        for group in groups.to_pylist():
            counts[group["status"], group["advice"]] += group["count_all"]
    return counts


def _read(
    storage: Storage, table: str, columns: list[str] | None, where: pc.Expression | None
) -> Iterator[pa.Table]:
    """The rows of a table, file by file. SweepError where a file is damaged."""
    if not storage.exists(MANIFEST):
        read_manifest(storage)  # says that this is no sweep
    try:
        for name in files_of(storage, table):
            path = storage.path(f"{table}/{name}")
            with storage.filesystem.open_input_file(path) as file:
                yield pq.read_table(
                    file, columns=columns, filters=where, page_checksum_verification=True
                )
    except (DamagedPart, pa.ArrowException, OSError) as error:
        raise SweepError(
            f"{storage}: {error}; the same sweep, run again, solves its cases anew"
        ) from error
