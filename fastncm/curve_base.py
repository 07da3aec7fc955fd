"""What every curve can be asked, whatever touches: a jaw (`curve`) or a side (`direct.curve`)."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from fastncm.errors import SceneError
from fastncm.scene import Scene

Array = np.ndarray


class Peak(NamedTuple):
    """The largest insertion force along the path, located, not sampled."""

    position: float  #: in the unit of the path (m or rad)
    insertion_force_N: float


class Curve(ABC):
    """A scene solved along a path. Rows are counted from 0 in the order of the positions."""

    scene: Scene

    @abstractmethod
    def __len__(self) -> int:
        """Number of positions."""

    @abstractmethod
    def frame(self) -> pd.DataFrame:
        """One row per position; ``.attrs["units"]`` has the columns' units."""

    @property
    @abstractmethod
    def status(self) -> str:
        """Status of the whole path: the first row's that failed, else "converged" or
        "no_contact"."""

    @property
    @abstractmethod
    def advice(self) -> str:
        """What to do about the status; empty where nothing is to be done."""

    @property
    @abstractmethod
    def peak(self) -> Peak:
        """The located peak of the insertion force: 0 N where the target never touches, NaN where
        some row on the way in failed, since the true peak may be there."""

    @property
    @abstractmethod
    def retention(self) -> Peak:
        """The located peak of the force that resists withdrawal (`path.withdraw`), like `peak`; NaN
        where the path does not come back."""

    @property
    @abstractmethod
    def insertion_work_J(self) -> float:
        """Work that the target does against the insertion force on its way in, in J; NaN where some
        row there failed."""

    @abstractmethod
    def events(self) -> pd.DataFrame:
        """Located events in the order of the path: event, position, insertion_force_N, interval.

        The event lies behind row `interval`.
        """

    @abstractmethod
    def shape(self, i: int) -> pd.DataFrame:
        """The finger at row `i`: s_m, x_m, y_m, psi_rad, gamma_rad, moment_Nm at points along its
        axis. Raises IndexError for a row that is not there."""

    @abstractmethod
    def contacts(self, i: int) -> pd.DataFrame:
        """The touching points at row `i`: s_m, x_m, y_m, force_x_N, force_y_N (on the finger)."""

    def __repr__(self) -> str:
        counts = self.frame()["status"].value_counts()
        rows = ", ".join(f"{count} {word}" for word, count in counts.items())
        where = f"{self.peak.insertion_force_N:.6g} N at {self.peak.position:.6g}"
        where += f" {self.scene.position_unit}"
        return f"<curve of {self.scene.name or 'a scene'}: {rows}; peak {where}>"

    def _place(self, i: int) -> int:
        """Row `i` counted from 0; negative ones count from the end."""
        if not -len(self) <= i < len(self):
            raise IndexError(f"row {i} is not there: the curve has rows 0 to {len(self) - 1}")
        return i % len(self)


def checked_positions(scene: Scene, positions: Sequence[float] | Array) -> Array:
    """The positions as a (P,) array; SceneError for what is no list of finite numbers."""
    try:
        values = np.asarray(positions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        unit = scene.position_unit
        raise SceneError(f"positions must be a list of numbers in {unit}: {error}") from None
    if values.ndim != 1 or len(values) == 0:
        raise SceneError(f"positions must be a non-empty list of numbers, got {positions!r}")
    if not np.isfinite(values).all():
        bad = int(np.flatnonzero(~np.isfinite(values))[0])
        raise SceneError(f"positions must be finite, positions[{bad}] is {values[bad]}")
    return values
