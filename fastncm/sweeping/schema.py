"""What the Parquet tables look like: columns, types, units, and the study they belong to."""

import json
import platform
from collections.abc import Collection, Mapping
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from fastncm import __version__
from fastncm.cases import ChunkResult, case_units, curve_units
from fastncm.scene import Scene

if TYPE_CHECKING:
    from fastncm.sweeping.study import Study

PACKAGES = ("numba", "numpy", "pyarrow", "joblib")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result may depend on."""
    own = {"fastncm": __version__, "python": platform.python_version()}
    return own | {name: version(name) for name in PACKAGES}


def metadata(study: "Study") -> dict[str, str]:
    """What each Parquet file says about itself: the full study and the versions, as JSON."""
    return {"study": json.dumps(study.to_dict()), "versions": json.dumps(versions())}


def results_table(scene: Scene, keys: np.ndarray, result: ChunkResult) -> pa.Table:
    """The results of C cases with the cases' identities, shape (C,): all that a worker sends
    back."""
    columns = {"case_key": (pa.array(keys), "1")}
    words = {
        name: pa.DictionaryArray.from_arrays(result.columns[name], known).dictionary_decode()
        for name, known in result.words.items()
    }
    return _table(columns | _results(result.columns | words, case_units(scene)), blanks=())


def cases_table(study: "Study", case_ids: np.ndarray, results: pa.Table) -> pa.Table:
    """`case_id`, the axes under their dotted names, and the results, each of shape (C,)."""
    columns = {"case_id": (pa.array(case_ids), "1")} | {
        name: (axis, study.scene.unit_of(name))
        for name, axis in study.cases.arrow_columns(case_ids).items()
    }
    mixed = [name for name, values in study.cases.axes.items() if values.dtype == object]
    table = _table(columns, blanks=mixed)
    for field in results.schema:
        table = table.append_column(field, results[field.name])
    return table


def curves_table(scene: Scene, case_ids: np.ndarray, curves: Mapping[str, np.ndarray]) -> pa.Table:
    """`case_id` and the columns of `Curve.frame()`, one row per case and position.

    curves: columns of shape (rows,); its "case" counts within `case_ids`, shape (C,).
    """
    columns = {"case_id": (pa.array(case_ids[curves["case"]]), "1")}
    results = _results(curves, curve_units(scene))
    return _table(columns | results, blanks=results)


def _results(
    columns: Mapping[str, np.ndarray | pa.Array], units: Mapping[str, str]
) -> dict[str, tuple[pa.Array, str]]:
    """The columns that `units` names, in its order, as Arrow arrays with their units."""
    return {name: (_arrow(columns[name]), unit) for name, unit in units.items() if name in columns}


def _arrow(column: np.ndarray | pa.Array) -> pa.Array:
    if isinstance(column, pa.Array):
        return column
    return pa.array(column, pa.string() if column.dtype == object else None)


def _table(columns: Mapping[str, tuple[pa.Array, str]], blanks: Collection[str]) -> pa.Table:
    """A table of named arrays, each with its unit in the field's metadata.

    blanks: the columns that may have no value in some row (NaN is one). Parquet keeps a list of the
    rows with a value for each, which takes a quarter of the time of writing.
    """
    fields = [
        pa.field(name, array.type, nullable=name in blanks, metadata={"unit": unit})
        for name, (array, unit) in columns.items()
    ]
    return pa.table([array for array, _ in columns.values()], schema=pa.schema(fields))
