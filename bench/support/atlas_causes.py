"""Why a scene of the atlas has no answer: by the advice that comes with its row, and by its
geometry."""

import extremes
import numpy as np
import pandas as pd

from support import atlas_overlaps

SOLVED = ("converged", "no_contact")

SNAP = "the branch from first touch ends at a limit point (snap)"
ENDS = "the branch of stable shapes ends, nothing to snap to"
LOCKS = "friction locks, or the branch ends"
FAR_CORNER = "not solved, short block"
OVERLAP = "the target cannot be got out of the way"
COVERED = "the target covers the clamp"
PASSED = "the target is past the undeformed finger"
UNSOLVED = "not solved"
RAISES = "the package raises an exception"
SNAPS = "the finger snaps from there"
CAUSES = {
    SNAPS: SNAP,
    "The branch of stable shapes from first touch ends": ENDS,
    "No equilibrium on the branch": LOCKS,
    "overlap": OVERLAP,
    "Error:": RAISES,
}
"""What the advice says, and the cause."""


def failed(table: pd.DataFrame) -> pd.Series:
    """Whether a row has no answer."""
    return ~table["status"].isin(SOLVED)


def described(kind: str, table: pd.DataFrame) -> pd.DataFrame:
    """The last rows of scenes of a kind with the columns cause (empty where there is an answer),
    snapped (the advice tells of a snap) and overlaps (no contact is claimed, and the undeformed
    finger is inside the target)."""
    coarse = set()  # points on the target (10b) do not see all of a finger, as they are known to
    if "solver.contact" in table:
        coarse = set(table.loc[table["solver.contact"] == "points-on-target", "index"])
    overlaps = np.zeros(len(table), dtype=bool)
    cause = np.full(len(table), "", dtype=object)
    for at, row in enumerate(table.itertuples()):
        if row.status == "no_contact":
            overlaps[at] = row.index not in coarse and atlas_overlaps.overlaps(kind, row.index)
        elif row.status not in SOLVED:
            cause[at] = _cause(kind, row.index, row.advice)
    snapped = table["advice"].str.contains(SNAPS, regex=False)
    return table.assign(cause=cause, snapped=snapped, overlaps=overlaps)


def _cause(kind: str, index: int, advice: str) -> str:
    said = next((cause for word, cause in CAUSES.items() if word in advice), UNSOLVED)
    if kind in extremes.SIDE_KINDS and atlas_overlaps.clamp_is_covered(kind, index):
        return COVERED
    if said in (UNSOLVED, OVERLAP, ENDS) and not atlas_overlaps.overlaps(kind, index):
        return PASSED
    if kind in extremes.SIDE_KINDS:
        return said
    short = said == UNSOLVED and atlas_overlaps.is_short_block(kind, index)
    return FAR_CORNER if short else said
