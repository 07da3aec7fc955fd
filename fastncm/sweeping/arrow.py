"""From NumPy columns to Arrow arrays whose type depends on the whole column."""

import numpy as np
import pyarrow as pa


def arrow_values(values: np.ndarray) -> pa.Array:
    """A column, shape (n,), as Arrow array; values of mixed types (a number or "touch") become
    text."""
    if values.dtype != object:
        return pa.array(values)
    plain = [value.tolist() if isinstance(value, np.ndarray) else value for value in values]
    try:
        return pa.array(plain)
    except (pa.ArrowInvalid, pa.ArrowTypeError):
        return pa.array([str(value) for value in plain])
