"""What the Parquet tables look like: columns, types, units, and the study they belong to."""

import json
import platform
from collections.abc import Mapping
from importlib.metadata import version

import numpy as np
import pyarrow as pa

from fastncm import __version__
from fastncm.cases import case_units, curve_units
from fastncm.sweeping.study import TEXT_COLUMNS, Study

WHOLE_COLUMNS = ("positions", "iterations", "contacts", "sticking")
PACKAGES = ("numba", "numpy", "pyarrow", "joblib")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result may depend on."""
    own = {"fastncm": __version__, "python": platform.python_version()}
    return own | {name: version(name) for name in PACKAGES}


def metadata(study: Study) -> dict[str, str]:
    """What each Parquet file says about itself: the full study and the versions, as JSON."""
    return {"study": json.dumps(study.to_dict()), "versions": json.dumps(versions())}


def cases_table(study: Study, case_ids: np.ndarray, cases: Mapping[str, np.ndarray]) -> pa.Table:
    """`case_id`, the axes under their dotted names, and the results of the cases.

    case_ids: shape (C,); cases: result columns as `solve_chunk` returns them, each (C,).
    """
    grid = study.grid
    columns = {"case_id": (pa.array(case_ids), "1")}
    for (name, values), index in zip(grid.axes.items(), grid.positions(case_ids), strict=True):
        columns[name] = _axis_column(values, index), study.scene.unit_of(name)
    return _table(columns | _results(cases, case_units(study.scene)))


def curves_table(study: Study, case_ids: np.ndarray, curves: Mapping[str, np.ndarray]) -> pa.Table:
    """`case_id` and the columns of `Curve.frame()`, one row per case and position.

    curves: columns of shape (rows,); its "case" counts within `case_ids`, shape (C,).
    """
    columns = {"case_id": (pa.array(case_ids[curves["case"]]), "1")}
    return _table(columns | _results(curves, curve_units(study.scene)))


def _axis_column(values: np.ndarray, index: np.ndarray) -> pa.Array:
    """The values of an axis at `index`, shape (C,).

    The type is that of the whole axis, so that all parts of a table agree; values of mixed types (a
    number or "touch") become text.
    """
    if values.dtype != object:
        return pa.array(values[index])
    try:
        axis = pa.array(values.tolist())
    except (pa.ArrowInvalid, pa.ArrowTypeError):
        axis = pa.array([str(value) for value in values])
    return axis.take(pa.array(index))


def _results(
    columns: Mapping[str, np.ndarray], units: Mapping[str, str]
) -> dict[str, tuple[pa.Array, str]]:
    """The columns that `units` names, in its order, as Arrow arrays with their units."""
    return {
        name: (pa.array(columns[name], _type(name)), unit)
        for name, unit in units.items()
        if name in columns
    }


def _type(column: str) -> pa.DataType:
    if column in TEXT_COLUMNS:
        return pa.string()
    return pa.int64() if column in WHOLE_COLUMNS else pa.float64()


def _table(columns: Mapping[str, tuple[pa.Array, str]]) -> pa.Table:
    """A table of named arrays, each with its unit in the field's metadata."""
    fields = [
        pa.field(name, array.type, metadata={"unit": unit})
        for name, (array, unit) in columns.items()
    ]
    return pa.table([array for array, _ in columns.values()], schema=pa.schema(fields))
