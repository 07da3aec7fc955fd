"""One scene in direct contact along its path: forces, shapes, distributed contacts, the peak."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from fastncm.curve_base import Curve, Peak
from fastncm.direct.columns import position_scale, surface_curve_columns, surface_curve_units
from fastncm.direct.lowering import LoweredSurface, lower_surface
from fastncm.direct.solving import SolvedSurface, contacts_at, finger_at, solve_surfaces
from fastncm.path import surface_rows as rows
from fastncm.path.surface_reduce import Summary, parabola_vertex, summarise_surfaces
from fastncm.scene import CaseGroup, Scene, tabulate
from fastncm.sqp import status

Array = np.ndarray

#: Columns of `Curve.shape` and `Curve.contacts`.
_SHAPE_COLUMNS = ("s_m", "x_m", "y_m", "psi_rad", "gamma_rad", "moment_Nm")
_CONTACT_COLUMNS = ("s_m", "x_m", "y_m", "force_x_N", "force_y_N")
#: Positions of a closer look at an interval; each makes it this much shorter.
_CLOSER = 17
#: The peak is searched until its interval is this part of the path, and a parabola does the rest.
_PEAK_SHARE = 1e-5
#: So far (finger lengths, rad) before and behind a snap are its forces and energies: twice what it
#: is located to.
_BESIDE_SNAP = 1e-6
#: Touch and release are located to this part of the path.
_EVENT_SHARE = 1e-10


def solve_surface(scene: Scene, positions: Array | None) -> "SurfaceCurve":
    """Solve a scene without a jaw along its path, or at the positions (P,) in m or rad."""
    group = tabulate(scene, {})[0]
    lowered = lower_surface(group, positions)
    solved = next(iter(solve_surfaces(lowered, shapes=True)))
    return SurfaceCurve(scene, group, lowered, solved)


@dataclass(frozen=True, repr=False)
class SurfaceCurve(Curve):
    """A scene whose finger touches with its own side, solved along a path."""

    scene: Scene
    _group: CaseGroup
    _lowered: LoweredSurface
    _solved: SolvedSurface

    def __len__(self) -> int:
        return int(self._lowered.positions.shape[1])

    def frame(self) -> pd.DataFrame:
        """One row per position, columns as `surface_curve_units` has them; ``.attrs["units"]`` has
        the units."""
        zero = np.zeros(1, dtype=np.int64)
        table = self._solved.trace.rows
        frame = pd.DataFrame(surface_curve_columns(table, self._lowered, zero, zero))
        units = surface_curve_units(self.scene)
        frame.attrs["units"] = {name: units[name] for name in frame.columns}
        return frame

    @cached_property
    def _summary(self) -> Summary:
        lowered = self._lowered
        return summarise_surfaces(self._solved.trace.rows, lowered.sense, lowered.turn)

    @property
    def status(self) -> str:
        """Status of the whole path: the first row's that failed, else "converged" or
        "no_contact"."""
        return status.WORDS[int(self._summary.status[0])]

    @property
    def advice(self) -> str:
        """What to do about the status, where the finger first snaps, or what to do about the row
        with the largest error where that is large; empty where nothing is to be done."""
        frame = self.frame()
        snaps = self._solved.trace.rows[0, :, rows.RELEASED] > 0.0
        if self.status == status.WORDS[status.CONVERGED] and snaps.any():
            return str(frame["advice"][snaps].iloc[0])
        if self.status == status.WORDS[status.NO_CONTACT]:
            return status.ADVICE[status.NO_CONTACT]
        if self.status != status.WORDS[status.CONVERGED]:
            return str(frame["advice"][frame["status"] == self.status].iloc[0])
        worst = frame.iloc[int(frame["error_estimate"].fillna(0.0).argmax())]
        where = f"At {worst['position']:.6g} {self.scene.position_unit}: "
        return f"{where}{worst['advice']}" if worst["advice"] else ""

    @property
    def insertion_work_J(self) -> float:
        """Work that the target does against the insertion force on its way in, in J; NaN where some
        row there failed."""
        if self._failed_until(self._lowered.turn):
            return float("nan")
        scale = self._lowered.scale
        return float(self._summary.work[0] * scale.force[0] * scale.length[0])

    @cached_property
    def peak(self) -> Peak:
        """The located peak of the insertion force: 0 N where the target never touches, NaN where
        some row on the way in failed, since the true peak may be there.

        The interval around the largest row is solved again, ever closer.
        """
        return self._located_peak(0, self._lowered.turn)

    @cached_property
    def retention(self) -> Peak:
        """The located peak of the force that resists withdrawal (`path.withdraw`), like `peak`;
        NaN where the path does not come back."""
        if self._lowered.turn == len(self) - 1:
            return Peak(float("nan"), float("nan"))
        return self._located_peak(self._lowered.turn + 1, len(self) - 1)

    def _failed_until(self, end: int) -> bool:
        """Whether some row up to `end` failed."""
        state = self._solved.trace.rows[0, : end + 1, rows.STATUS]
        return bool((state > status.NO_CONTACT).any())

    def _located_peak(self, begin: int, end: int) -> Peak:
        """The largest insertion force between the rows `begin` and `end`."""
        table, position = self._solved.trace.rows[0], self._positions
        if self._failed_until(end):
            return Peak(float("nan"), float("nan"))
        force = table[:, rows.INSERTION]
        at = begin + int(force[begin : end + 1].argmax())
        if force[at] <= 0.0:
            return Peak(float(position[at]), 0.0)
        sampled = Peak(position[at], force[at])
        span = float(np.ptp(position))
        first, last = max(at - 1, begin), min(at + 1, end)
        x, f = position[first : last + 1], force[first : last + 1]
        while abs(x[-1] - x[0]) > _PEAK_SHARE * span and _one_way(x):
            x = np.linspace(x[0], x[-1], _CLOSER)
            closer = self._closer(first, x)
            f = np.where(_loaded(closer), closer[:, rows.INSERTION], -np.inf)
            at = int(f.argmax())
            x, f = x[max(at - 1, 0) : at + 2], f[max(at - 1, 0) : at + 2]
        at = int(f.argmax())
        best, value = x[at], f[at]
        if at == 1 and len(x) == 3 and _one_way(x):
            vertex, place = parabola_vertex(x, f)
            if np.isfinite(vertex):
                value, best = vertex, place
        if value < sampled.insertion_force_N:  # the row could not be followed to (see its advice)
            best, value = sampled
        return Peak(float(best), float(value * self._lowered.scale.force[0]))

    def events(self) -> pd.DataFrame:
        """Located events in the order of the path: event, position, insertion_force_N, energy_J,
        interval.

        The event lies behind row `interval`: where contact begins ("touch") and ends ("release",
        with the force on the side of the contact), and where the finger snaps, as it is just before
        ("before_change") and just after ("after_change"). What energy is missing there was
        released.
        """
        table = self._solved.trace.rows[0]
        touching, snaps = _loaded(table), table[:, rows.RELEASED] > 0.0
        found = []
        for k in np.flatnonzero((touching[1:] != touching[:-1]) | snaps[1:]).tolist():
            if not touching[k] and touching[k + 1]:
                found.append(("touch", *self._change(k), k))
            if snaps[k + 1]:
                before, after = self._snap(k)
                found += [("before_change", *before, k), ("after_change", *after, k)]
            if touching[k] and not touching[k + 1]:
                found.append(("release", *self._change(k), k))
        columns = ["event", "position", "insertion_force_N", "energy_J", "interval"]
        events = pd.DataFrame(found, columns=columns)
        force, length = self._lowered.scale.force[0], self._lowered.scale.length[0]
        events["insertion_force_N"] *= force
        events["energy_J"] *= force * length
        return events

    def shape(self, i: int) -> pd.DataFrame:
        """The finger at row `i`: s_m, x_m, y_m, psi_rad, gamma_rad, moment_Nm at its nodes.

        The moment is that of the contact forces beyond, which is exact for the given forces
        (positive where it turns psi up). Raises IndexError for a row that is not there.
        """
        finger = finger_at(self._lowered, self._solved, 0, self._place(i))
        return self._in_units(finger, _SHAPE_COLUMNS)

    def contacts(self, i: int) -> pd.DataFrame:
        """The touching points at row `i`: s_m, x_m, y_m, force_x_N, force_y_N (on the finger).

        s_m is that of the section whose side touches. A row that is not solved has none.
        """
        row = self._solved.trace.rows[0, self._place(i)]
        points = contacts_at(self._lowered, self._solved, 0, self._place(i))
        if row[rows.STATUS] != status.CONVERGED:
            points = {name: values[:0] for name, values in points.items()}
        return self._in_units(points, _CONTACT_COLUMNS)

    def _in_units(self, values: dict[str, Array], columns: tuple[str, ...]) -> pd.DataFrame:
        """Dimensionless values, under the names of the `columns` without their units, in SI
        units."""
        scale = self._lowered.scale
        length, force = float(scale.length[0]), float(scale.force[0])
        units = {"m": length, "N": force, "Nm": force * length, "rad": 1.0}
        scaled = {}
        for column in columns:
            name, unit = column.rsplit("_", 1)
            scaled[column] = values[name] * units[unit]
        return pd.DataFrame(scaled)

    @property
    def _positions(self) -> Array:
        """(P,) in m or rad."""
        position: Array = self.frame()["position"].to_numpy()
        return position

    def _closer(self, first: int, x: Array) -> Array:
        """Rows (len(x), surface_rows.COLUMNS) at the positions `x` behind row `first`, reached
        along the path's rows up to there, so that they lie on the same branch."""
        way = np.concatenate([self._positions[:first], x])
        solved = next(iter(solve_surfaces(lower_surface(self._group, way), shapes=False)))
        table: Array = solved.trace.rows[0, first:]
        if self._lowered.turn <= first < len(self) - 1:  # positions of one's own have no way out
            table[:, rows.INSERTION] *= -1.0
        return table

    def _snap(self, k: int) -> Array:
        """Position (m or rad), insertion force and energy (dimensionless), (2, 3), just before and
        just after the snap on the way to row k + 1."""
        unit = float(position_scale(self._lowered, np.zeros(1, dtype=np.int64))[0])
        at, (near, far) = (
            self._solved.trace.rows[0, k + 1, rows.SNAP] * unit,
            self._positions[k : k + 2],
        )
        aside = np.copysign(_BESIDE_SNAP * unit, far - near)
        beside = np.clip([at - aside, at + aside], min(near, far), max(near, far))
        found = self._closer(k + 1, beside)[:, [rows.POSITION, rows.INSERTION, rows.ENERGY]]
        found[:, 0] = at
        return found

    def _change(self, k: int) -> tuple[float, float, float]:
        """Between rows k and k + 1, where contact begins or ends: position (m or rad), and
        insertion force and energy (dimensionless) on the side of the contact."""
        position = self._positions
        share = _EVENT_SHARE * float(np.ptp(position))
        table = self._solved.trace.rows[0, k : k + 2]
        x = position[k : k + 2]
        while True:
            touching = _loaded(table)
            at = int(np.flatnonzero(touching[1:] != touching[:-1])[0])
            insertion, energy = table[at + int(touching[at + 1]), [rows.INSERTION, rows.ENERGY]]
            ends = x[at], x[at + 1]
            if abs(ends[1] - ends[0]) <= share:
                return float(ends[int(touching[at + 1])]), float(insertion), float(energy)
            x = np.linspace(*ends, _CLOSER)
            closer = self._closer(k, x)
            changed = _loaded(closer)
            if (changed == changed[0]).all():  # the change hangs on the way there: as sampled
                return float(ends[int(touching[at + 1])]), float(insertion), float(energy)
            table = closer


def _loaded(table: Array) -> Array:
    """Which rows are solved and in contact."""
    touching: Array = table[:, rows.STATUS] == status.CONVERGED
    return touching


def _one_way(x: Array) -> bool:
    """Whether the positions go on in one sense."""
    steps = np.diff(x)
    return bool((steps > 0.0).all() or (steps < 0.0).all())
