"""The atlas's tables in Markdown."""

import numpy as np
import pandas as pd

from support import atlas_kept, markdown_table
from support.atlas_rates import existing, limits, upper
from support.atlas_truth import OTHER_BRANCH
from support.atlas_verdicts import WRONG, unanswered, wrong_in_silence

COUNTED = (
    "Failed: the deepest position of the path has no answer. Judged: every converged row of the "
    "first scenes of each kind. *Wrong in silence*: converged, and the true error above ten times "
    "the estimate; in brackets up to how many of 10,000 rows that may be with 95 % confidence "
    "(Clopper and Pearson). *Another branch*: where shooting does not close, the same scene with "
    "other modes (or intervals) has another shape there. *No truth*: no judge finds an equilibrium "
    "next to the answer, though the estimate is below 0.1. *Overlaps*: no contact is claimed, but "
    "the undeformed finger is inside the target."
)


def counts(table: pd.DataFrame, judged: pd.DataFrame) -> str:
    """A line for each kind of scene, and one for all."""
    head = ["", "scenes", "converged", "no contact", "failed, μ = 0", "failed, μ > 0",
            "rows judged", "wrong in silence", "another branch", "no truth", "overlaps", "residual",
            "iterations"]  # fmt: skip
    groups = [*table.groupby("kind", sort=False), ("all", table)]
    rows = []
    for name, part in groups:
        failed, rubs = part["cause"] != "", part["friction.mu"] > 0.0
        solved = part[part["status"] == "converged"]
        known = judged[judged["kind"].isin(part["kind"].unique())]
        wrong, steps = len(wrong_in_silence(known)), solved["iterations"]
        numbers = [
            len(part), len(solved), (part["status"] == "no_contact").sum(), (failed & ~rubs).sum(),
            (failed & rubs).sum(), known["found"].sum(),
        ]  # fmt: skip
        rows.append([str(name), *(f"{number:,}" for number in numbers),
                     f"{wrong} (up to {upper(wrong, len(known)):.1f})",
                     f"{known['judge'].eq(OTHER_BRANCH).sum()}", f"{len(unanswered(known))}",
                     f"{part['overlaps'].sum():,}", f"{solved['kkt_residual'].max():.0e}",
                     f"{steps.median():.0f}, at most {steps.max():,}"])  # fmt: skip
    return markdown_table(head, rows)


def judges(judged: pd.DataFrame) -> str:
    """How many rows which judge has decided, and the estimates' quality."""
    known = judged[judged["found"]]
    number = known["judge"].value_counts()
    fair = known[(known["error"] > 10.0 * known["rounding"]) & (known["error"] > 1e-13)]
    ratio = fair["error_estimate"] / fair["error"]
    low, middle, high = np.quantile(ratio, [0.05, 0.5, 0.95])
    said = ", ".join(f"{name} {count:,}" for name, count in number.items())
    sharp = (known["rounding"] < WRONG * known["error_estimate"]).mean()
    return (
        f"Judged by: {said}; {sharp:.0%} of the rows by a truth that is known better than ten "
        f"estimates. Where the error is well above rounding ({len(fair):,} rows) the "
        f"estimate is {middle:.2g} times the error at the median, from {low:.2g} to {high:.2g} for "
        "nine rows of ten."
    )


def features(table: pd.DataFrame) -> str:
    """A line for each range and each hard case."""
    head = ["", "scenes", "converged", "no contact", "failed, μ = 0", "failed, μ > 0",
            "rows judged", "wrong or no truth", "overlaps"]  # fmt: skip
    rows = [
        [row.feature, *(f"{number:,}" for number in (
            row.scenes, row.converged, row.no_contact, row.failed_smooth, row.failed_rubbing,
            row.judged, row.wrong, row.overlaps))]
        for row in table.itertuples()
    ]  # fmt: skip
    return markdown_table(head, rows)


def failures(table: pd.DataFrame, tried: pd.DataFrame) -> str:
    """The failed rows by cause, and whether there is a solution."""
    head = ["no answer because", "friction", "scenes", "judged", "path leads to one", "of 10,000",
            "one elsewhere", "of 10,000", "none found", "undecided",
            "for example (kind index)"]  # fmt: skip
    rows = [
        [row.cause, row.friction, f"{row.failed:,}", f"{row.judged}", f"{row.missing}",
         limits(*row.of_missing), f"{row.elsewhere}", limits(*row.of_elsewhere), f"{row.nothing}",
         f"{row.undecided}", row.named]
        for row in existing(table, tried).itertuples()
    ]  # fmt: skip
    return markdown_table(head, rows) + "\n\n" + FAILED


FAILED = (
    "Judged: a random sample of the failed rows of each kind and cause, by the package with "
    "smaller steps or other modes and, without friction, by SciPy's SLSQP, which follows a chain "
    "of links from the first touch in steps so small that it stays on its branch "
    "(`bench/support/atlas_follow.py`). *The path leads to one*: SLSQP reaches the end of the path "
    "without a snap, or smaller steps do. *Elsewhere*: SLSQP finds that the branch ends in a limit "
    "point and goes on behind the snap; with friction, shooting finds an equilibrium there, from "
    "the frictionless one while the friction grows, which may be on another branch. *None found*: "
    "SLSQP's branch ends and no shape is found from there. *Of 10,000*: how many of all scenes "
    "that stands for, and in brackets the limits of 95 % confidence."
)


def listed(table: pd.DataFrame) -> str:
    """What has become of the kept cases, in a sentence."""
    number = table["now"].value_counts()
    said = ", ".join(f"{count:,} {now}" for now, count in number.items())
    bad = table[table["now"] == atlas_kept.WRONG]
    names = ", ".join(bad["kind"] + " " + bad["index"].astype(str))
    return (
        "Scenes without friction that had no answer though there is one, in any run "
        f"(`tests/unsolved.csv`): {len(table):,} scenes; {said}{': ' * bool(names)}{names}."
    )


def truth(digits: pd.DataFrame) -> str:
    """How good the judge itself is, in a sentence."""
    if digits.empty:
        return "mpmath is not installed here: no truth to 34 digits."
    off = digits["off"] / digits["rounding"]
    true = digits["error"] / digits["error_estimate"]
    return (
        f"{len(digits)} converged rows with one sliding contact, in arithmetic of 34 digits "
        "(`tests/shooting_digits.py`): the shooting that judges is off by "
        f"{digits['off'].max():.0e} at most and {off.max():.2g} times what it says of its own "
        f"rounding; fastncm's true errors are {true.median():.2g} of their estimates at the "
        f"median and {true.max():.2g} at most."
    )


def grids(grid: pd.DataFrame) -> str:
    """A line for each grid."""
    head = ["grid", "rows", "failed", "not closed", "largest error over estimate", "largest error"]
    rows = []
    for name, part in grid.groupby("grid", sort=False):
        solved = part[part["status"] == "converged"]
        ratio = (solved["error"] - solved["rounding"]).clip(lower=0.0) / solved["error_estimate"]
        rows.append([str(name), str(len(part)), str(len(part) - len(solved)),
                     str(solved["error"].isna().sum()),
                     "-" if ratio.isna().all() else f"{ratio.max():.2g}",
                     f"{solved['error'].max():.1e}"])  # fmt: skip
    return markdown_table(head, rows)


def conditions(table: pd.DataFrame) -> str:
    """The condition numbers in a sentence."""
    low, middle, high = np.quantile(table["condition"], [0.0, 0.5, 1.0])
    return (
        f"Condition number of the KKT matrix (modes and contact, {len(table)} random scenes): "
        f"{low:.1f} to {high:.1e}, median {middle:.1f}, whatever E, L, w/L and taper: the modes "
        "are orthonormal in the energy."
    )
