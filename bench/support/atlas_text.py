"""The atlas's part of the report, from its tables alone."""

import numpy as np
import pandas as pd

from support import markdown_table

WRONG = 10.0
"""Times the estimate."""
LOOSE = 1e-5
Table = tuple[pd.DataFrame, dict[str, object]]


def wrong_in_silence(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of a table with true errors that break the rule."""
    claimed = (table["status"] == "converged") & table["found"].eq(True)
    return table[claimed & (table["error"] > WRONG * table["error_estimate"] + table["rounding"])]


def unanswered(table: pd.DataFrame) -> pd.DataFrame:
    """Rows that say "converged" but next to which there is no equilibrium, beyond what an estimate
    above 1/10 admits."""
    lost = (table["status"] == "converged") & table["found"].eq(False)
    return table[lost & (table["error_estimate"] < 0.1)]


def existing(table: pd.DataFrame, tried: pd.DataFrame) -> pd.DataFrame:
    """For each cause, with friction and without: the failed rows; those tried again; those that
    the package itself solves with other settings; those for which SLSQP or shooting knows an
    equilibrium; and how many of 10,000 scenes the last two stand for."""
    rows = []
    tried = tried[tried["solved_by"] != NOT_TRIED]
    for rubs in (False, True):
        all_failed = table[(table["cause"] != "") & (table["friction.mu"].gt(0.0) == rubs)]
        again = tried[tried["friction.mu"].gt(0.0) == rubs]
        # each row tried stands for as many as have failed of its kind
        stands = all_failed["kind"].value_counts() / again["kind"].value_counts()
        weight = again["kind"].map(stands)
        for cause, part in again.groupby("cause"):
            ours = part["solved_by"].str.contains("=", regex=False)
            theirs = (part["solved_by"] != "") & ~ours
            named = part.assign(rank=2 * ours + theirs).sort_values("rank", ascending=False)
            rows.append(
                {
                    "cause": cause,
                    "friction": "μ > 0" if rubs else "μ = 0",
                    "failed": float(weight[part.index].sum()),
                    "tried": len(part),
                    "ours": int(ours.sum()),
                    "theirs": int(theirs.sum()),
                    "rate_ours": 1e4 * float(weight[part.index][ours].sum()) / len(table),
                    "rate_theirs": 1e4 * float(weight[part.index][theirs].sum()) / len(table),
                    "named": ", ".join((named["kind"] + " " + named["index"].astype(str))[:4]),
                }
            )
    return pd.DataFrame(rows)


NOT_TRIED = "not tried by SLSQP"


def headlines(
    jaws: pd.DataFrame, sides: pd.DataFrame, jaws_tried: pd.DataFrame, sides_tried: pd.DataFrame
) -> list[str]:
    """For the first page."""
    said = []
    for what, table, tried, how in (
        ("fingers with jaws", jaws, jaws_tried, "with shooting"),
        ("fingers in direct contact", sides, sides_tried, "with eight times as many intervals"),
    ):
        known = int(table["found"].notna().sum())
        wrong, lost = len(wrong_in_silence(table)), len(unanswered(table))
        overlaps = int(table["overlaps"].sum())
        left = existing(table, tried)
        smooth = left.loc[left["friction"] == "μ = 0", ["rate_ours", "rate_theirs"]].sum().sum()
        rubs = left.loc[left["friction"] == "μ > 0", "rate_ours"].sum()
        said.append(
            f"Of {len(table):,} random {what}, far beyond use, {known:,} were compared {how}: "
            f"{wrong} are wrong in silence, next to {lost} there is no equilibrium. "
            f"{overlaps:,} of all say that there is no contact where there is. "
            f"Of 10,000 about {smooth:.0f} without friction have no answer though other means "
            f"find one, and {rubs:.0f} with friction though smaller steps do (the goal is 1)."
        )
    return said


def section(
    jaws: Table, sides: Table, jaws_tried: Table, sides_tried: Table, grid: Table, condition: Table
) -> str:
    """All of it."""
    about = jaws[1]
    machine = about["machine"]
    assert isinstance(machine, dict)
    return "\n\n".join(
        [
            "## Stiff and extreme cases",
            f"{len(jaws[0]):,} random fingers with jaws and {len(sides[0]):,} in direct contact, "
            "over E from 1e-3 to 1e15 Pa, L from 1e-6 to 1e3 m, w/L from 1e-5 to "
            "0.5, tapers from 1000:1 to 1:1000, orders 2 to 32 and automatic, one jump from "
            "undeformed to the deepest position or twelve positions, grazing contact, corners met "
            "head-on, friction up to and above what locks, huge gaps; direct contact with N from 4 "
            f"to 10,000. Seed {about['seed']}; `tests/extremes.py` makes a scene from its kind and "
            f"index. Machine: {machine['cpu']}, revision {machine['revision']}, "
            f"{about['cpu_seconds']:.0f} s of CPU time for the jaws, "
            f"{sides[1]['cpu_seconds']:.0f} s for direct contact.",
            counts(jaws[0]),
            "Wrong in silence: converged, and the true error above ten times the estimate. "
            "*No equilibrium there*: neither shooting from the claimed answer nor other modes find "
            "one, though the estimate is below 0.1. *Overlaps*: no contact is claimed, but the "
            "undeformed jaw is inside the target. Residual: largest of the KKT residuals of "
            f"converged rows; {loose(jaws[0])} of all are above {LOOSE:.0e}.",
            failures(jaws[0], jaws_tried[0]),
            f"{(jaws[0]['snapped'] & jaws[0]['cause'].eq('')).sum():,} more paths pass a limit "
            "point, say so with its position and the energy released, and go on behind it.",
            "![Random jaws](results/atlas_jaws.png)",
            counts(sides[0]),
            "The truth here is the same scene with eight times as many intervals.",
            failures(sides[0], sides_tried[0]),
            "![Random direct contact](results/atlas_sides.png)",
            grids(grid[0]),
            "![Grids](results/atlas_grid.png)",
            conditions(condition[0]),
        ]
    )


def loose(table: pd.DataFrame) -> int:
    """Rows that say "converged" with a KKT residual above LOOSE."""
    return int(((table["status"] == "converged") & (table["kkt_residual"] > LOOSE)).sum())


def counts(table: pd.DataFrame) -> str:
    """A line for each kind of scene."""
    head = ["", "scenes", "converged", "no contact", "failed, μ = 0", "failed, μ > 0", "compared",
            "wrong in silence", "no equilibrium there", "overlaps", "residual",
            "iterations"]  # fmt: skip
    rows = []
    for name, part in table.groupby("kind", sort=False):
        failed = part["cause"] != ""
        rubs = part["friction.mu"] > 0.0
        solved = part[part["status"] == "converged"]
        numbers = [
            len(part), len(solved), (part["status"] == "no_contact").sum(), (failed & ~rubs).sum(),
            (failed & rubs).sum(), part["found"].notna().sum(), len(wrong_in_silence(part)),
            len(unanswered(part)), part["overlaps"].sum(),
        ]  # fmt: skip
        steps = solved["iterations"]
        rows.append([str(name), *(f"{number:,}" for number in numbers),
                     f"{solved['kkt_residual'].max():.0e}",
                     f"{steps.median():.0f}, at most {steps.max()}"])  # fmt: skip
    return markdown_table(head, rows)


def failures(table: pd.DataFrame, tried: pd.DataFrame) -> str:
    """The failed rows by cause, and whether there is a solution."""
    head = ["no answer because", "friction", "scenes, about", "tried again", "smaller steps do",
            "SLSQP or shooting", "of 10,000", "of 10,000", "for example (kind index)"]  # fmt: skip
    rows = [
        [row.cause, row.friction, f"{row.failed:,.0f}", f"{row.tried}", f"{row.ours}",
         f"{row.theirs}", f"{row.rate_ours:.1f}", f"{row.rate_theirs:.1f}", row.named]
        for row in existing(table, tried).itertuples()
    ]  # fmt: skip
    return (
        markdown_table(head, rows) + "\n\nTried again: a sample of the failed rows; with 30 to 200 "
        "positions, and with 12 modes; those left over without friction by SLSQP from several "
        "starts (a sample of them), with friction by shooting from the frictionless answer while "
        "the friction grows. These two show that there is an equilibrium, not that the path from "
        "the first touch leads to it. *Of 10,000*: the scenes that have no answer for this cause "
        "though smaller steps find one, and though SLSQP or shooting do."
    )


def grids(grid: pd.DataFrame) -> str:
    """A line for each grid."""
    head = ["grid", "rows", "failed", "not closed", "largest error over estimate", "largest error"]
    rows = []
    for name, part in grid.groupby("grid", sort=False):
        solved = part[part["status"] == "converged"]
        ratio = (solved["error"] - solved["rounding"]).clip(lower=0.0) / solved["error_estimate"]
        rows.append([str(name), str(len(part)), str(len(part) - len(solved)),
                     str(solved["error"].isna().sum()), f"{ratio.max():.2g}",
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
