"""The mean thickness of an interval, as bending or shear feels it."""

import numpy as np
from scipy.integrate import quad

Array = np.ndarray


def mean_thickness(stations: Array, intervals: int, power: int) -> Array:
    """``(mean of w^-power)^(-1/power)`` over each of N equal intervals of [0, 1], by quadrature.

    stations: (2, S) places and thicknesses, linear in between.
    """
    edges = np.linspace(0.0, 1.0, intervals + 1)
    places, thickness = stations
    means = np.empty(intervals)
    for i, (a, b) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        kinks = [a, *places[(a < places) & (places < b)], b]
        total = sum(
            quad(lambda s: np.interp(s, places, thickness) ** -power, *ends, epsrel=1e-13)[0]
            for ends in zip(kinks[:-1], kinks[1:], strict=True)
        )
        means[i] = (total / (b - a)) ** (-1.0 / power)
    return means
