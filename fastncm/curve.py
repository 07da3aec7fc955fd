"""One scene along its target's path: forces, shapes, contacts and the located peak.

`solve` for every scene, and the curve of a finger with a jaw.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from fastncm.columns import CURVE_UNITS, advice, curve_columns
from fastncm.curve_base import Curve, Peak, checked_positions
from fastncm.direct.curve import solve_surface
from fastncm.first_use import prepare
from fastncm.kernels import basis
from fastncm.kernels import constants as c
from fastncm.lowering import Lowered, lower
from fastncm.path import reduce, rows, snap
from fastncm.path.friction import INSERTION, turned_forces
from fastncm.path.peaks import refine_peaks
from fastncm.path.reduce import summarise
from fastncm.scene import Scene, tabulate
from fastncm.sqp import status
from fastncm.trace import Solved, kkt_tolerance, solve_paths

__all__ = ["Curve", "JawCurve", "Peak", "solve"]

Array = np.ndarray

#: Points along the finger in `Curve.shape`.
_SHAPE_POINTS = 101
#: What the kinds of located events are called.
_EVENT_NAMES = {
    rows.TOUCH: "touch",
    rows.RELEASE: "release",
    rows.BEFORE_CHANGE: "before_change",
    rows.AFTER_CHANGE: "after_change",
}


def solve(scene: Scene, positions: Sequence[float] | Array | None = None) -> Curve:
    """Solve `scene` along its path, or at the `positions` (path values, m, or rad where the base
    turns) in the order given.

    What does not converge is a row with a status, not an error. Raises SceneError for positions
    that are not a list of finite numbers.
    """
    if positions is not None:
        positions = checked_positions(scene, positions)
    prepare(scene)
    if scene.jaw is None:
        return solve_surface(scene, positions)
    group = tabulate(scene, {})[0]
    lowered = lower(group, positions)
    solved = next(solve_paths(lowered))
    zero = np.zeros(1, dtype=np.int64)
    summary = np.empty((1, reduce.COLUMNS))
    count = lowered.positions.shape[1]
    summarise(solved.trace.rows, count, zero, lowered.turned, summary)
    tolerance = kkt_tolerance(scene.solver.rtol)
    refine_peaks(solved.problem, tolerance, solved.trace, zero, lowered.turned, summary)
    return JawCurve(scene, lowered, solved, summary[0])


@dataclass(frozen=True, repr=False)
class JawCurve(Curve):
    """A scene with a jaw, solved along a path."""

    scene: Scene
    _lowered: Lowered
    _solved: Solved
    _summary: Array

    def __len__(self) -> int:
        return int(self._lowered.positions.shape[1])

    @property
    def order(self) -> int:
        """Modes per field that were used: `solver.order`, or what `solver.rtol` asked for."""
        return self._solved.order

    def frame(self) -> pd.DataFrame:
        """One row per position, columns as in `fastncm.columns.CURVE_UNITS`, and `advice`: what to
        do about a row that failed, and where the finger snaps. ``.attrs["units"]`` has the units.
        """
        zero = np.zeros(1, dtype=np.int64)
        table = curve_columns(self._solved.trace.rows, self._lowered, zero, zero)
        frame = pd.DataFrame(table | {"advice": self._advice_of_rows()})
        frame.attrs["units"] = CURVE_UNITS | {"advice": ""}
        return frame

    def _advice_of_rows(self) -> list[str]:
        """What is said of each row: where the branch has ended before it, that; else what is said
        of its status."""
        number = self._solved.trace.rows[0, : len(self), rows.STATUS].astype(np.int64)
        end = self._solved.trace.ends[0]
        ended = end[snap.END_POSITION] != 0.0
        begin = int(end[snap.END_ROW]) if ended else len(self)
        said = []
        for i, state in enumerate(number.tolist()):
            failed = state > status.NO_CONTACT
            told = i >= begin and (failed or i == begin)
            said.append(self._advice(state) if told else status.ADVICE[state] if failed else "")
        return said

    @property
    def status(self) -> str:
        """Status of the whole path: the first row's that failed, else "converged" or
        "no_contact"."""
        return status.WORDS[int(self._summary[reduce.STATUS])]

    @property
    def advice(self) -> str:
        """What to do about the status; empty where nothing is to be done."""
        return self._advice(int(self._summary[reduce.STATUS]))

    def _advice(self, number: int) -> str:
        """What is said of a status number, and of the place where the branch ends."""
        zero, sentences = np.zeros(1, dtype=np.int64), list(status.ADVICE)
        ends, numbers = self._solved.trace.ends, np.array([number])
        return sentences[int(advice(ends, self._lowered, zero, zero, numbers, sentences)[0])]

    @property
    def peak(self) -> Peak:
        """The located peak of the insertion force: 0 N where the target never touches, NaN where
        some row on the way in failed, since the true peak may be there."""
        if self._summary[reduce.STATUS_IN] > status.NO_CONTACT:
            return Peak(float("nan"), float("nan"))
        return Peak(
            float(self._summary[reduce.PEAK_POSITION] * self._lowered.scale.length[0]),
            float(self._summary[reduce.PEAK_FORCE] * self._lowered.scale.force[0]),
        )

    @property
    def insertion_work_J(self) -> float:
        """Work that the target does against the insertion force on its way in, in J; NaN where some
        row there failed."""
        if self._summary[reduce.STATUS_IN] > status.NO_CONTACT:
            return float("nan")
        scale = self._lowered.scale
        return float(self._summary[reduce.WORK] * scale.force[0] * scale.length[0])

    @property
    def retention(self) -> Peak:
        """The located peak of the force that resists withdrawal (`path.withdraw`), like `peak`; NaN
        where the path does not come back."""
        comes_back = self._lowered.turn < len(self) - 1
        if self._summary[reduce.STATUS] > status.NO_CONTACT or not comes_back:
            return Peak(float("nan"), float("nan"))
        return Peak(
            float(self._summary[reduce.RETENTION_POSITION] * self._lowered.scale.length[0]),
            float(self._summary[reduce.RETENTION] * self._lowered.scale.force[0]),
        )

    def events(self) -> pd.DataFrame:
        """Located events in the order of the path: event, position, insertion_force_N, energy_J,
        interval.

        The event lies behind row `interval`. At a change of the contact feature the force may jump
        or have a kink: it is given as it is just before and just after. So is the energy stored in
        the finger; what is missing after it was released.
        """
        table = self._solved.trace.rows
        one = np.zeros(1, dtype=np.int64)
        forces = np.empty((1, table.shape[1], 7))
        turned_forces(table, one, self._lowered.turned, forces)
        behind = np.arange(len(self), table.shape[1])
        used = behind[table[0, behind, rows.KIND] != rows.AT_POSITION]
        scale = self._lowered.scale
        return pd.DataFrame(
            {
                "event": [_EVENT_NAMES[int(kind)] for kind in table[0, used, rows.KIND]],
                "position": table[0, used, rows.POSITION] * scale.length[0],
                "insertion_force_N": forces[0, used, INSERTION] * scale.force[0] + 0.0,  # no -0.0
                "energy_J": table[0, used, rows.ENERGY] * scale.force[0] * scale.length[0],
                "interval": table[0, used, rows.INTERVAL].astype(np.int64),
            }
        )

    def shape(self, i: int) -> pd.DataFrame:
        """The finger at row `i`: s_m, x_m, y_m, psi_rad, gamma_rad, moment_Nm at points along its
        axis.

        The moment is that of the contact force, which is exact for the given force (positive where
        it turns psi up). Raises IndexError for a row that is not there.
        """
        self._place(i)
        s = np.linspace(0.0, 1.0, _SHAPE_POINTS)
        psi, gamma = self._angles(i, s)
        # running integrals of the axis' direction by a Gauss rule of their own on each [0, s], a
        # part of the taper and thus one itself
        rule = basis.quadrature(basis.quadrature_points(c.MAX_ORDER))
        tip = 1.0 + (float(self._lowered.ratio[0]) - 1.0) * s
        parts = [basis.stretch(part, rule.nodes) for part in tip.tolist()]
        inner = s[:, None] * np.array([arc for arc, _ in parts])
        weights = s[:, None] * rule.weights * np.array([pace for _, pace in parts])
        inner_psi, inner_gamma = self._angles(i, inner.ravel())
        theta = (inner_psi + inner_gamma).reshape(inner.shape)
        x = (np.cos(theta) * weights).sum(axis=1)
        y = (np.sin(theta) * weights).sum(axis=1)
        scale = self._lowered.scale
        moment = np.zeros_like(s)
        for px, py, fx, fy in self._forces(i):
            moment += (px - x) * fy - (py - y) * fx
        return pd.DataFrame(
            {
                "s_m": s * scale.length[0],
                "x_m": x * scale.length[0],
                "y_m": y * scale.length[0],
                "psi_rad": psi,
                "gamma_rad": gamma,
                "moment_Nm": moment * scale.force[0] * scale.length[0],
            }
        )

    def contacts(self, i: int) -> pd.DataFrame:
        """The touching points at row `i`: s_m, x_m, y_m, force_x_N, force_y_N (on the finger).

        A jaw's force enters the finger at its tip, hence s_m is the finger's length.
        """
        row, scale = self._row(i), self._lowered.scale
        forces = self._forces(i) if row[rows.STATUS] == status.CONVERGED else np.empty((0, 4))
        if len(forces) and self._lowered.turned[0] > 0.0:  # by the recovered rule, all together
            columns = ["contact_x_m", "contact_y_m", "force_x_N", "force_y_N"]
            together = self.frame().loc[[self._place(i)], columns].to_numpy(float)
            forces = together / np.repeat([scale.length[0], scale.force[0]], 2)
        return pd.DataFrame(
            {
                "s_m": np.full(len(forces), scale.length[0]),
                "x_m": forces[:, 0] * scale.length[0],
                "y_m": forces[:, 1] * scale.length[0],
                "force_x_N": forces[:, 2] * scale.force[0],
                "force_y_N": forces[:, 3] * scale.force[0],
            }
        )

    def _forces(self, i: int) -> Array:
        """Place (x, y) and force (x, y), dimensionless, of each contact at row `i`, (C, 4), with
        the shape's own forces."""
        row, contacts = self._row(i), self._solved.trace.contacts[0, self._place(i)]
        if row[rows.CONTACTS] > 1.0:
            found: Array = contacts[(contacts[:, 2:] != 0.0).any(axis=1)]
            return found
        force, rub = row[rows.FORCE], row[rows.RUB]
        fx = force * row[rows.NORMAL_X] - rub * row[rows.NORMAL_Y]
        fy = force * row[rows.NORMAL_Y] + rub * row[rows.NORMAL_X]
        return np.array([[row[rows.CONTACT_X], row[rows.CONTACT_Y], fx, fy]])

    def _row(self, i: int) -> Array:
        """The trace's row of position `i`; negative ones count from the end."""
        row: Array = self._solved.trace.rows[0, self._place(i)]
        return row

    def _angles(self, i: int, s: Array) -> tuple[Array, Array]:
        """psi and gamma of row `i` at the points `s` (0 ... 1)."""
        shear = self.scene.model.shear
        slope, gamma = basis.fields(float(self._lowered.ratio[0]), self._solved.order, shear, s)
        u = self._solved.trace.shapes[0, i % len(self)]
        psi: Array = u[: self._solved.order] @ slope
        if not shear:
            return psi, np.zeros_like(psi)
        stiffness = self._lowered.shear_stiffness[0]
        return psi, u[self._solved.order :] @ gamma / np.sqrt(stiffness)
