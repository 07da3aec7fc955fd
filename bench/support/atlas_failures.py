"""Why a scene of the atlas has no answer, and whether there is one by other means.

Without friction: the package with other settings, then SLSQP from several starts on a chain of
links (`atlas_slsqp`), which proves that there is a shape, though not that the path leads to it.
With friction: the frictionless answer at the same place, from which the equilibrium is followed by
shooting while the friction grows. In direct contact: the package with more positions, and whether
the target covers the clamp, which no bending can clear.
"""

from collections.abc import Mapping

import extremes
import numpy as np
import pandas as pd
import shooting_many

from support import atlas_bulk, atlas_overlaps, atlas_runs, atlas_slsqp

SNAP = "the branch from first touch ends at a limit point (snap)"
LOCKS = "friction locks, or the branch ends"
SEVERAL = "two contacts with friction"
FAR_CORNER = "far corner of a short block"
OVERLAP = "the target cannot be got out of the way"
COVERED = "the target covers the clamp"
UNSOLVED = "not solved"
RAISES = "the package raises an exception"
CAUSES = {
    "snaps": SNAP,
    "No equilibrium on the branch": LOCKS,
    "overlap": OVERLAP,
    "Error:": RAISES,
}
"""What the advice says, and the cause."""
JAW_WAYS: tuple[dict[str, object], ...] = (
    {"path.steps": 200},
    {"path.steps": 60, "solver.order": 12},
)
SIDE_WAYS: tuple[dict[str, object], ...] = ({"path.steps": 30},)
FRICTION_STEPS = 10


def failed(table: pd.DataFrame) -> pd.Series:
    """Whether a row has no answer."""
    return ~table["status"].isin(atlas_runs.SOLVED)


def causes(table: pd.DataFrame) -> pd.Series:
    """What each row's advice says about its failure; empty where there is none."""
    found = pd.Series(UNSOLVED, index=table.index)
    for word, cause in CAUSES.items():
        found[table["advice"].str.contains(word, regex=False)] = cause
    return found.where(failed(table), "")


def described(table: pd.DataFrame) -> pd.DataFrame:
    """The rows with the columns cause, snapped (the advice tells of a snap) and overlaps (no
    contact is claimed, and the undeformed finger is inside the target) for their advice."""
    overlaps = np.zeros(len(table), dtype=bool)
    for at in np.flatnonzero(table["status"] == "no_contact"):
        kind, index = str(table["kind"].iat[at]), int(table["index"].iat[at])
        overlaps[at] = (
            atlas_overlaps.side_overlaps(kind, index)
            if kind in extremes.SIDE_KINDS
            else atlas_overlaps.jaw_overlaps(kind, index)
        )
    snapped = table["advice"].str.contains("snaps", regex=False)
    described = table.assign(cause=causes(table), snapped=snapped, overlaps=overlaps)
    return described.drop(columns="advice")


def solve_again(kind: str, indices: np.ndarray, changes: Mapping[str, object]) -> pd.DataFrame:
    """The deepest rows of some scenes of a kind with other settings, in bulk."""
    draw = extremes.side_block if kind in extremes.SIDE_KINDS else extremes.jaw_block
    found = []
    for block in np.unique(indices // extremes.BLOCK):
        rows = indices[indices // extremes.BLOCK == block] - block * extremes.BLOCK
        columns = {name: column[rows] for name, column in draw(kind, int(block)).items()}
        for name, value in changes.items():
            columns[name] = np.full(len(rows), value, dtype=object)
        table = atlas_bulk.deepest(kind, columns)
        found.append(table.assign(index=rows[table["index"]] + block * extremes.BLOCK))
    return pd.concat(found, ignore_index=True)


def try_again(chosen: pd.DataFrame, slsqp: int) -> pd.DataFrame:
    """The chosen failed rows with the columns cause (finer) and solved_by (empty: by nothing that
    was tried); `slsqp` of each kind of jaws are given to SLSQP."""
    parts = [chosen.iloc[:0].assign(solved_by="")]
    for kind, table in chosen.groupby("kind", sort=False):
        name, rubs = str(kind), table["friction.mu"] > 0.0
        if name in extremes.SIDE_KINDS:
            parts.append(_in_direct_contact(name, table))
            continue
        parts += [_without_friction(name, table[~rubs], slsqp)] if (~rubs).any() else []
        parts += [_with_friction(name, table[rubs])] if rubs.any() else []
    return pd.concat(parts, ignore_index=True)


def _by_settings(kind: str, table: pd.DataFrame, ways: tuple[dict[str, object], ...]) -> pd.Series:
    """By which of the package's other settings each row is solved."""
    by = pd.Series("", index=table["index"])
    for changes in ways:
        left = by.index[by == ""].to_numpy()
        if len(left):
            again = solve_again(kind, left, changes)
            said = ", ".join(f"{name} = {value}" for name, value in changes.items())
            by[again.loc[~failed(again), "index"]] = said
    return by


def _without_friction(kind: str, table: pd.DataFrame, slsqp: int) -> pd.DataFrame:
    by = _by_settings(kind, table, JAW_WAYS)
    left = by.index[by == ""]
    for index in left[:slsqp]:
        columns = extremes.jaw_block(kind, index // extremes.BLOCK)
        shape = atlas_slsqp.shape_of(columns, index % extremes.BLOCK)
        by[index] = "SLSQP" if atlas_slsqp.solve(shape)[0] else ""
    by[left[slsqp:]] = "not tried by SLSQP"
    table = table.assign(solved_by=by.to_numpy())
    return table.assign(cause=table["cause"].mask(_short(kind, table), FAR_CORNER))


def _short(kind: str, table: pd.DataFrame) -> np.ndarray:
    """Whether the block's underside ends, by row (n,)."""
    if kind.startswith("circle-"):
        return np.zeros(len(table), dtype=bool)
    made = [extremes.one(kind, int(index))["target.length"] for index in table["index"]]
    return np.array([one != "endless" for one in made])


def _with_friction(kind: str, table: pd.DataFrame) -> pd.DataFrame:
    by = _by_settings(kind, table, JAW_WAYS[:1])
    smooth = solve_again(kind, table["index"].to_numpy(), {"friction.mu": 0.0})
    smooth = smooth.set_index("index").loc[table["index"]]
    single = smooth["contacts"].eq(1) & smooth["status"].eq("converged")
    slid = slide(kind, smooth[single].reset_index(), table["friction.mu"].to_numpy()[single])
    exists = pd.Series(False, index=table["index"])
    exists[smooth.index[single]] = slid
    by[exists & (by == "")] = "shooting, one contact"
    cause = table["cause"].to_numpy()
    several = (smooth["contacts"] > 1).to_numpy()
    cause = np.where(several & (cause == LOCKS), SEVERAL, cause)
    return table.assign(solved_by=by.to_numpy(), cause=cause)


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
        claim = atlas_runs.claim_of(table, columns, rows)
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
            shape = atlas_slsqp.shape_of(columns, int(rows[i]))
            good[i] = atlas_slsqp.gaps(shape, truth.pose[i]).min() > -atlas_overlaps.PENETRATION
        found[here] = good
    return found


def _left(vectors: np.ndarray) -> np.ndarray:
    return np.column_stack([-vectors[:, 1], vectors[:, 0]])


def _in_direct_contact(kind: str, table: pd.DataFrame) -> pd.DataFrame:
    by = _by_settings(kind, table, SIDE_WAYS)
    covered = [atlas_overlaps.clamp_is_covered(kind, int(index)) for index in table["index"]]
    cause = table["cause"].mask(covered, COVERED)
    return table.assign(solved_by=by.to_numpy(), cause=cause)
