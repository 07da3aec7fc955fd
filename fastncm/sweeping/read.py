"""Reading a sweep's folder: the tables as pandas, and what can be said of them part by part."""

import json
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from fastncm.errors import SweepError
from fastncm.sweeping.folder import TABLES, read_manifest
from fastncm.sweeping.parts import part_files
from fastncm.sweeping.study import Report

GOOD_STATUS = ("converged", "no_contact")
"""A path that never touches is a result, not a failure."""


def load(
    out: str | os.PathLike[str],
    table: str = "cases",
    *,
    case_ids: Sequence[int] | np.ndarray | None = None,
) -> pd.DataFrame:
    """A sweep's table, sorted by case_id (curves: and along the path); units are in `.attrs`.

    table: "cases", or "curves" where the study asked for them. case_ids: these cases only.
    Rows of a sweep that is running or was broken off are those in its finished parts.
    """
    if table not in TABLES:
        raise SweepError(f"there is no table '{table}': 'cases' and 'curves' are known")
    files = part_files(Path(out) / table)
    if not files:
        manifest = read_manifest(Path(out))
        if table == "curves" and not manifest.study["curves"]:
            raise SweepError(f"{out} has no curves: the study has no [output] curves = true")
        raise SweepError(f"{out} has no finished rows (the sweep is {manifest.state})")
    where = None if case_ids is None else pc.field("case_id").isin(pa.array(case_ids))
    rows = pa.concat_tables(pq.read_table(file, filters=where) for file in files)
    order = np.argsort(rows["case_id"].to_numpy(), kind="stable")
    frame: pd.DataFrame = rows.take(pa.array(order)).to_pandas()
    schema = rows.schema
    frame.attrs["units"] = {field.name: field.metadata[b"unit"].decode() for field in schema}
    frame.attrs["study"] = json.loads(schema.metadata[b"study"])
    return frame


def best_designs(out: Path, report: Report, n: int) -> pd.DataFrame:
    """The n best converged designs within the report's limits, best first; reads part by part."""
    best = pd.DataFrame()
    for file in part_files(out / "cases"):
        rows = pq.read_table(file, filters=pc.field("status") == "converged").to_pandas()
        for column, limit in report.limits.items():
            rows = rows[rows[column] <= limit]
        # Ties go to the smaller case_id, so that the answer does not depend on the parts.
        best = (
            pd.concat([best, rows.dropna(subset=[report.column])])
            .sort_values([report.column, "case_id"], ascending=[report.best == "min", True])
            .head(n)
        )
    return best.reset_index(drop=True)


def count_statuses(out: Path) -> Counter[tuple[str, str]]:
    """Number of cases by (status, advice); reads part by part."""
    counts: Counter[tuple[str, str]] = Counter()
    for file in part_files(out / "cases"):
        table = pq.read_table(file, columns=["status", "advice"])
        groups = table.group_by(["status", "advice"]).aggregate([([], "count_all")])
        for group in groups.to_pylist():
            counts[group["status"], group["advice"]] += group["count_all"]
    return counts


def failed_rows(statuses: Iterable[str]) -> int:
    """How many of the statuses are neither converged nor without contact."""
    return sum(n for status, n in Counter(statuses).items() if status not in GOOD_STATUS)
