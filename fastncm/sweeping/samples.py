"""Cases given one by one: a list, a table, or a sample drawn from ranges.

Samples are drawn by scipy.stats.qmc, scrambled with the study's seed, so that the same study
file gives the same cases.
"""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from fastncm.errors import SceneError
from fastncm.sweeping.arrow import arrow_values
from fastncm.sweeping.axes import Axis, Range, axis_values, sampled_axis

DRAWN = ("latin-hypercube", "sobol", "halton")


@dataclass(frozen=True)
class Samples:
    """Cases row by row; a case's number is its row.

    axes: dotted name -> values, each shape (size,).
    """

    axes: Mapping[str, np.ndarray]

    @property
    def size(self) -> int:
        return len(next(iter(self.axes.values()), ()))

    def columns(self, case_ids: np.ndarray) -> dict[str, np.ndarray]:
        """Values of the cases, shape (C,): one column of shape (C,) per axis."""
        return {name: values[case_ids] for name, values in self.axes.items()}

    def arrow_columns(self, case_ids: np.ndarray) -> dict[str, pa.Array]:
        """The same for a table. The type is that of the whole axis, so that all parts agree."""
        index = pa.array(case_ids)
        return {name: values.take(index) for name, values in self._arrow.items()}

    @cached_property
    def _arrow(self) -> dict[str, pa.Array]:
        return {name: arrow_values(values) for name, values in self.axes.items()}

    def to_arrow(self) -> pa.Table:
        """All cases for a file; what is no number is written as JSON."""
        return pa.table(
            {
                name: [json.dumps(value) for value in values] if values.dtype == object else values
                for name, values in self.axes.items()
            }
        )

    def task_order(self, scale_only: Collection[str]) -> "SampleOrder":
        """The order in which cases are solved: shared and similar problems side by side."""
        return SampleOrder(self, scale_only)


class SampleOrder:
    """Samples sorted by the axes that change the problem (all but those that only scale it)."""

    group = 1

    def __init__(self, samples: Samples, scale_only: Collection[str]) -> None:
        keys = [
            pd.factorize(values)[0] if values.dtype == object else values
            for name, values in samples.axes.items()
            if name not in scale_only
        ]
        self._order = np.lexsort(keys) if keys else np.arange(samples.size)

    def case_ids(self, start: int, stop: int) -> np.ndarray:
        """The cases at places `start` to `stop` of the order, shape (stop - start,)."""
        return self._order[start:stop]


def listed(axes: Mapping[str, Axis] | pd.DataFrame) -> Samples:
    """The i-th case has the i-th value of every axis. SceneError where their numbers differ."""
    if isinstance(axes, pd.DataFrame):
        axes = {str(name): _column(axes[name]) for name in axes.columns}
    values = {name: axis_values(name, axis) for name, axis in axes.items()}
    counts = {name: len(column) for name, column in values.items()}
    if len(set(counts.values())) > 1:
        found = ", ".join(f"{name} has {count}" for name, count in counts.items())
        raise SceneError(f"the axes of a list must be equally long: {found}", name="axes")
    return Samples(values)


def frame_from_arrow(table: pa.Table) -> pd.DataFrame:
    """The cases of `Samples.to_arrow` as a data frame."""
    frame: pd.DataFrame = table.to_pandas()
    for name in frame.columns:
        if frame[name].dtype.kind not in "iuf":
            frame[name] = pd.Series([json.loads(value) for value in frame[name]], dtype=object)
    return frame


def drawn(axes: Mapping[str, Axis], kind: str, samples: int, seed: int) -> Samples:
    """A sample of the axes' ranges; a listed axis takes each of its values equally often."""
    from scipy.stats import qmc

    sources = {name: sampled_axis(name, axis) for name, axis in axes.items()}
    engines: dict[str, Any] = {
        "latin-hypercube": qmc.LatinHypercube,
        "sobol": qmc.Sobol,
        "halton": qmc.Halton,
    }
    engine = engines[kind](d=len(sources), rng=np.random.default_rng(seed))
    if kind == "sobol" and samples & (samples - 1) == 0:
        points = engine.random_base2(samples.bit_length() - 1)
    else:
        points = engine.random(samples)
    columns = {}
    for (name, source), fractions in zip(sources.items(), points.T, strict=True):
        if isinstance(source, Range):
            columns[name] = source.at(fractions)
        else:
            columns[name] = source[(fractions * len(source)).astype(np.int64)]
    return Samples(columns)


def _column(series: pd.Series) -> np.ndarray:
    """A column of a data frame as an array of numbers, or of plain Python objects."""
    values = series.to_numpy()
    if values.dtype.kind in "iuf":
        return values
    plain = np.empty(len(values), dtype=object)
    plain[:] = [_plain(value) for value in values.tolist()]
    return plain


def _plain(value: object) -> object:
    """Pairs as tuples, whatever they come as."""
    return tuple(value) if isinstance(value, list | np.ndarray) else value
