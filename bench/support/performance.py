"""Performance profiles (Dolan & Moré, Math. Program. 91, 2002)."""

import numpy as np


def profile(seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ratios tau and shares rho (S, T) of T tasks, from times (S, T) of S solvers; inf: failed.

    The ratio is a solver's time over the best solver's for that task; rho_s(tau) is the share of
    all tasks that solver s does within tau times the best time. Row s of the ratios is sorted, and
    the share beside an entry is that reached there. Tasks that nobody solves stay in the count.
    """
    best = seconds.min(axis=0)
    ratios = np.full_like(seconds, np.inf)
    solved = np.isfinite(seconds)
    ratios[solved] = (seconds / np.where(np.isfinite(best), best, 1.0))[solved]
    ratios.sort(axis=1)
    count = seconds.shape[1]
    shares = np.where(np.isfinite(ratios), np.arange(1, count + 1) / count, np.nan)
    return ratios, shares
