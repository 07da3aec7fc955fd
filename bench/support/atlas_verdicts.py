"""What breaks the atlas's rule: never wrong in silence."""

import pandas as pd

from support.atlas_truth import OTHER_BRANCH

WRONG = 10.0
"""Times the estimate."""
LOOSE = 1e-5
LARGE = 0.1
"""Of an estimate: it admits that nothing is known."""


def wrong_in_silence(judged: pd.DataFrame) -> pd.DataFrame:
    """The rows with true errors that break the rule."""
    claimed = (judged["status"] == "converged") & judged["found"].eq(True)
    limit = WRONG * judged["error_estimate"] + judged["rounding"]
    return judged[claimed & (judged["error"] > limit)]


def unanswered(judged: pd.DataFrame) -> pd.DataFrame:
    """Rows that say "converged" but next to which there is no equilibrium, beyond what an estimate
    above LARGE admits."""
    lost = (judged["status"] == "converged") & judged["found"].eq(False)
    lost &= judged["judge"] != OTHER_BRANCH
    return judged[lost & (judged["error_estimate"] < LARGE)]


def scenes_in(judged: pd.DataFrame) -> int:
    """Scenes that were judged in some row."""
    return len(judged[["kind", "index"]].drop_duplicates())


def loose(table: pd.DataFrame) -> int:
    """Rows that say "converged" with a KKT residual above LOOSE."""
    return int(((table["status"] == "converged") & (table["kkt_residual"] > LOOSE)).sum())
