"""Whether there is an answer by other means where a scene of the atlas has none.

The package with smaller steps and other settings; without friction the branch from first touch,
followed by SciPy's SLSQP in small steps (`atlas_follow`), which shows whether the path leads to an
answer; with friction the frictionless answer at the same place, from which the equilibrium is
followed by shooting while the friction grows: that there is one, not that the path leads to it.
"""

import extremes
import numpy as np
import pandas as pd
import shooting_many

from support import (
    atlas_causes,
    atlas_follow,
    atlas_overlaps,
    atlas_runs,
    atlas_slsqp,
    atlas_slsqp_sides,
    atlas_truth,
)

JAW_WAYS: tuple[dict[str, object], ...] = (
    {"path.steps": 200},
    {"path.steps": 60, "solver.order": 12},
)
SIDE_WAYS: tuple[dict[str, object], ...] = ({"path.steps": 30},)
FRICTION_STEPS = 10
CLEAR_CAUSES = (atlas_causes.COVERED, atlas_causes.PASSED)
"""Geometry says that there is no shape, or that the undeformed finger is one."""
SHOOTING = "shooting, one contact"


def try_again(kind: str, table: pd.DataFrame, follows: int) -> pd.DataFrame:
    """Failed rows of a kind for one cause, all with friction or all without, with the columns
    solved_by (empty: by nothing that was tried) and followed: the first `follows` without friction
    whose branch was followed (others: empty)."""
    jaws, rubs = kind in extremes.JAW_KINDS, bool(table["friction.mu"].gt(0.0).any())
    by = _by_settings(kind, table, (JAW_WAYS[:1] if rubs else JAW_WAYS) if jaws else SIDE_WAYS)
    left = by.index[by == ""].to_numpy()
    if jaws and rubs and len(left):
        by[left[_slides(kind, left, by.index, table["friction.mu"].to_numpy())]] = SHOOTING
    count = 0 if rubs or table["cause"].isin(CLEAR_CAUSES).any() else follows
    followed = [
        branch(kind, int(index)).what if at < count else "" for at, index in enumerate(by.index)
    ]
    return table.assign(solved_by=by.to_numpy(), followed=followed)


def branch(kind: str, index: int) -> atlas_follow.Followed:
    """The branch of a scene without friction from the first touch."""
    with np.errstate(all="ignore"):
        if kind in extremes.SIDE_KINDS:
            return atlas_slsqp_sides.SideChain(kind, index).follow()
        columns = extremes.jaw_block(kind, index // extremes.BLOCK)
        return atlas_slsqp.JawChain(columns, index % extremes.BLOCK).follow()


def _by_settings(kind: str, table: pd.DataFrame, ways: tuple[dict[str, object], ...]) -> pd.Series:
    """By which of the package's other settings each row is solved."""
    by = pd.Series("", index=table["index"].to_numpy())
    for changes in ways:
        left = by.index[by == ""].to_numpy()
        if len(left):
            again = atlas_runs.last_rows(atlas_runs.chosen(kind, left, changes))
            said = ", ".join(f"{name} = {value}" for name, value in changes.items())
            by[again.loc[~atlas_causes.failed(again), "index"].to_numpy()] = said
    return by


def _slides(kind: str, left: np.ndarray, indices: pd.Index, mu: np.ndarray) -> np.ndarray:
    """Which of the scenes `left` (n,) have an equilibrium that slides on one contact."""
    smooth = atlas_runs.last_rows(atlas_runs.chosen(kind, left, {"friction.mu": 0.0}))
    smooth = smooth.set_index("index").loc[left].reset_index()
    single = (smooth["contacts"].eq(1) & smooth["status"].eq("converged")).to_numpy()
    exists = np.zeros(len(left), dtype=bool)
    rubs = pd.Series(mu, index=indices).loc[left].to_numpy()
    exists[single] = slide(kind, smooth[single].reset_index(drop=True), rubs[single])
    return exists


def slide(kind: str, smooth: pd.DataFrame, mu: np.ndarray) -> np.ndarray:
    """Whether (n,) there is an equilibrium that slides on one contact with friction `mu` (n,),
    followed from frictionless answers `smooth` (n rows) while the friction grows."""
    found = np.zeros(len(smooth), dtype=bool)
    blocks = smooth["index"].to_numpy() // extremes.BLOCK
    for block in np.unique(blocks):
        here = np.flatnonzero(blocks == block)
        table = smooth.iloc[here].reset_index(drop=True)
        columns = extremes.jaw_block(kind, int(block))
        rows = table["index"].to_numpy() - block * extremes.BLOCK
        claim = atlas_truth.claim_of(table, columns, rows)
        fingers = shooting_many.fingers(columns, rows, table["position"].to_numpy())
        pressing = np.hypot(*claim.force.T)
        good = pressing > 0.0
        normal = -claim.force / np.where(good, pressing, 1.0)[:, None]
        for share in np.linspace(0.0, 1.0, FRICTION_STEPS + 1)[1:]:
            tangent = _left(normal)
            # the target moves towards -x and takes the finger along
            lean = share * mu[here] * np.sign(-tangent[:, 0])
            force = pressing[:, None] * (-normal + lean[:, None] * tangent)
            pushed = shooting_many.Claim(force, claim.contact, claim.pose)
            with np.errstate(all="ignore"):
                truth = shooting_many.exact(fingers, pushed, abs(lean))
                good &= truth.found
                pressing = truth.normal
                straight = truth.force + lean[:, None] * _left(truth.force)
                normal = -straight / (pressing * (1.0 + lean**2))[:, None]
            claim = shooting_many.Claim(truth.force, truth.contact, truth.pose)
        for i in np.flatnonzero(good):
            chain = atlas_slsqp.JawChain(columns, int(rows[i]))
            gaps = chain.pose_gaps(truth.pose[i], chain.stop)
            good[i] = gaps.min() > -atlas_overlaps.PENETRATION
        found[here] = good
    return found


def _left(vectors: np.ndarray) -> np.ndarray:
    return np.column_stack([-vectors[:, 1], vectors[:, 0]])
