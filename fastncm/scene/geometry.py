"""Rules between several values of a case: the jaw's end points, its arc, the path's ends, what
friction can be solved with.

`values` maps the keys of names.py to arrays over the cases, each (C,) or (1,); `options` the
dotted names to their values.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fastncm.errors import SceneError
from fastncm.scene.columns import FloatArray, IntArray
from fastncm.scene.refusal import refusal

Values = dict[str, FloatArray]

#: A profile may end this much (relative) beside the finger's tip: a length in other digits.
_ROUNDED = 1e-9


def move_jaw(values: Values, rows: IntArray) -> None:
    """Replace "height", "span" (jaw.length) and "lead_angle" by the a and b they mean, in place.

    a keeps its x and b its y: the height moves a, the length moves b. A lead angle alone keeps the
    length; with one of the two it gives the other. The order in which they are given is no matter.
    """
    moves = {key: values.pop(key) for key in ("height", "span", "lead_angle") if key in values}
    if len(moves) == 3:
        raise SceneError(
            "jaw.height, jaw.length and jaw.lead_angle cannot be given together: "
            "two of them fix the third",
            name="jaw.lead_angle",
        )
    a_x, b_x, b_y = values["a_x"], values["b_x"], values["b_y"]
    height = moves.get("height")
    length = moves.get("span")
    with np.errstate(all="ignore"):  # what is not finite is refused below
        if "lead_angle" in moves:
            slope = np.tan(moves["lead_angle"])
            if height is None:
                height = (b_x - a_x if length is None else length) * slope
            else:
                length = height / slope
        if length is not None:
            values["b_x"] = a_x + length
        if height is not None:
            values["a_y"] = b_y + height
    if "lead_angle" in moves:
        length = values["b_x"] - a_x
        _require(
            np.isfinite(length) & (length > 0),
            "jaw.lead_angle",
            moves["lead_angle"],
            "an angle that gives the jaw a finite length greater than 0",
            rows,
        )


def check_jaw(values: Values, rows: IntArray) -> None:
    """The jaw's end points are finite and apart; an arc through them exists."""
    with np.errstate(over="ignore"):
        chord = np.hypot(values["b_x"] - values["a_x"], values["b_y"] - values["a_y"])
    _require(
        np.isfinite(chord) & (chord > 0), "jaw.b", values["b_x"], "a point away from jaw.a", rows
    )
    if "jaw_radius" in values:
        _require(
            2 * values["jaw_radius"] >= chord,
            "jaw.radius",
            values["jaw_radius"],
            "at least half the distance from jaw.a to jaw.b",
            rows,
        )


def check_return(values: Values, options: Mapping[str, object], rows: IntArray) -> None:
    """The return face is behind the jaw: not in front of its edge, and corner a sticks out.

    A target that cannot come to it, an endless block, does not ask.
    """
    endless = options["target.shape"] == "block" and np.isnan(values["target_length"]).all()
    if options["jaw.shape"] == "none" or endless:
        return
    across, down = values["b_x"] - values["a_x"], values["a_y"] - values["b_y"]
    chord = np.arctan2(-down, across)
    half = np.zeros(1)
    if "jaw_radius" in values:
        half = np.arcsin(np.minimum(np.hypot(across, down) / (2.0 * values["jaw_radius"]), 1.0))
        half = half if options["jaw.convex"] else -half
    low = np.maximum(chord + half, 0.0)  # the edge's direction at a
    high = np.minimum(chord + np.minimum(half, 0.0) + np.pi, np.pi)
    low, high, back = np.broadcast_arrays(low, high, values["return_angle"])
    fits = (low < back) & (back < high)
    i = int(np.argmin(fits))
    expected = f"between {low[i]:.6g} and {high[i]:.6g}: the return face lies behind the jaw"
    _require(fits, "jaw.return_angle", back, expected, rows)


def check_profile(values: Values, options: Mapping[str, object], rows: IntArray) -> None:
    """A thickness profile covers the finger, no more and no less."""
    profile = options.get("finger.profile")
    if not isinstance(profile, tuple):
        return
    end, length = profile[-1][0], values["length"]
    _require(
        np.abs(end - length) <= _ROUNDED * length,
        "finger.profile",
        np.array([end]),
        f"a table over s from 0 to finger.length = {length[0]:g}; it ends at s = {end:g}",
        rows,
    )


def check_path(values: Values, rows: IntArray) -> None:
    """The path leads somewhere; a start at the first touch (NaN) always does."""
    _require(
        values["start"] != values["stop"],
        "path.stop",
        values["stop"],
        "different from path.start",
        rows,
    )


def check_friction(options: Mapping[str, object], values: Values, rows: IntArray) -> None:
    """Friction in equilibrium has no energy that a jaw's point forms or BFGS could minimise."""
    if options["jaw.shape"] == "none":
        return
    plain = options["solver.contact"] == "closest" and options["solver.hessian"] == "exact"
    if options["friction.model"] == "equilibrium" and not plain:
        _require(
            values["mu"] == 0.0,
            "friction.mu",
            values["mu"],
            "0 where solver.contact is not 'closest' or solver.hessian is not 'exact'; "
            "friction.model = 'recovered' takes friction there, too",
            rows,
        )


def _require(
    fits: NDArray[np.bool_], name: str, shown: FloatArray, expected: str, rows: IntArray
) -> None:
    """Refuse the first case that does not fit, showing its value of `name`."""
    if not fits.all():
        first = int(np.argmin(fits))
        value = np.broadcast_to(shown, fits.shape)[first]
        raise refusal(name, value, expected, int(rows[first]) if fits.size > 1 else None)
