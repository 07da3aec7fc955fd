"""The atlas's part of the report, from its tables alone."""

import numpy as np
import pandas as pd

from support import markdown_table
from support.atlas_rates import existing, limits, upper
from support.atlas_truth import OTHER_BRANCH

WRONG = 10.0
"""Times the estimate."""
LOOSE = 1e-5
LARGE = 0.1
"""Of an estimate: it admits that nothing is known."""
Table = tuple[pd.DataFrame, dict[str, object]]


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


def headlines(
    jaws: pd.DataFrame, sides: pd.DataFrame, jaws_judged: pd.DataFrame, sides_judged: pd.DataFrame,
    jaws_tried: pd.DataFrame, sides_tried: pd.DataFrame,
) -> list[str]:  # fmt: skip
    """For the first page."""
    said = []
    for what, table, judged, tried, how in (
        ("fingers with jaws", jaws, jaws_judged, jaws_tried, "with shooting or other modes"),
        ("fingers in direct contact", sides, sides_judged, sides_tried,
         "with eight times as many intervals"),
    ):  # fmt: skip
        wrong, lost = len(wrong_in_silence(judged)), len(unanswered(judged))
        left = existing(table, tried)
        smooth, rubs = left[left["friction"] == "μ = 0"], left[left["friction"] != "μ = 0"]
        number = smooth[["rate_ours", "rate_theirs"]].sum().sum()
        said.append(
            f"Of {len(table):,} random {what}, far beyond use, {judged['index'].count():,} rows of "
            f"{scenes_in(judged):,} were compared {how}: {wrong} are wrong in silence (at most "
            f"{upper(wrong, len(judged)):.1f} of 10,000 with 95 % confidence), for {lost} there is "
            f"no truth. {table['overlaps'].sum():,} of all say that there is no "
            f"contact where there is. Of 10,000 about {number:.2g} without friction have no answer "
            f"though other means find one, and {rubs['rate_ours'].sum():.2g} with friction though "
            "smaller steps do (the goal is 1)."
        )
    return said


def section(
    jaws: Table, sides: Table, jaws_judged: Table, sides_judged: Table, jaws_tried: Table,
    sides_tried: Table, jaws_features: Table, sides_features: Table, digits: Table, grid: Table,
    condition: Table,
) -> str:  # fmt: skip
    """All of it."""
    about = jaws[1]
    machine = about["machine"]
    assert isinstance(machine, dict)
    seconds = [table[1]["cpu_seconds"] for table in (jaws, sides, jaws_judged, sides_judged)]
    return "\n\n".join(
        [
            "## Stiff and extreme cases",
            f"{len(jaws[0]):,} random fingers with jaws and {len(sides[0]):,} in direct contact, "
            f"far beyond use. Seed {about['seed']}; `tests/extremes.py` makes a scene from its "
            f"kind and index. Machine: {machine['cpu']}, revision {machine['revision']}; CPU time "
            f"{seconds[0]:.0f} s for the jaws, {seconds[1]:.0f} s for direct contact, "
            f"{seconds[2]:.0f} s and {seconds[3]:.0f} s for the truth.",
            "### Jaws",
            counts(jaws[0], jaws_judged[0]),
            COUNTED,
            judges(jaws_judged[0]),
            f"{loose(jaws[0])} of all converged scenes have a KKT residual above {LOOSE:.0e}. "
            f"{(jaws[0]['snapped'] & jaws[0]['cause'].eq('')).sum():,} paths pass a limit point, "
            "say so with its position and the energy released, and go on behind it.",
            features(jaws_features[0]),
            failures(jaws[0], jaws_tried[0]),
            "![Random jaws](results/atlas_jaws.png)",
            "### Direct contact",
            counts(sides[0], sides_judged[0]),
            "The truth here is the same scene with eight times as many intervals, or five or three "
            "times; *no truth*: all have no answer there. " + judges(sides_judged[0]),
            features(sides_features[0]),
            failures(sides[0], sides_tried[0]),
            "![Random direct contact](results/atlas_sides.png)",
            "### The truth to 34 digits, grids, condition",
            truth(digits[0]),
            grids(grid[0]),
            "![Grids](results/atlas_grid.png)",
            conditions(condition[0]),
        ]
    )


COUNTED = (
    "Failed: the deepest position of the path has no answer. Judged: every converged row of the "
    "first scenes of each kind. *Wrong in silence*: converged, and the true error above ten times "
    "the estimate; in brackets up to how many of 10,000 rows that may be with 95 % confidence "
    "(Clopper and Pearson). *Another branch*: where shooting does not close, the same scene with "
    "other modes (or intervals) has another shape there. *No truth*: no judge finds an equilibrium "
    "next to the answer, though the estimate is below 0.1. *Overlaps*: no contact is claimed, but "
    "the undeformed finger is inside the target."
)


def scenes_in(judged: pd.DataFrame) -> int:
    """Scenes that were judged in some row."""
    return len(judged[["kind", "index"]].drop_duplicates())


def loose(table: pd.DataFrame) -> int:
    """Rows that say "converged" with a KKT residual above LOOSE."""
    return int(((table["status"] == "converged") & (table["kkt_residual"] > LOOSE)).sum())


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
    head = ["no answer because", "friction", "scenes", "tried", "smaller steps do", "of 10,000",
            "left to others", "they do", "of 10,000", "for example (kind index)"]  # fmt: skip
    rows = [
        [row.cause, row.friction, f"{row.failed:,}", f"{row.tried}", f"{row.ours}",
         limits(row.rate_ours, row.low_ours, row.high_ours), f"{row.asked}", f"{row.theirs}",
         limits(row.rate_theirs, row.low_theirs, row.high_theirs) if row.asked else "-", row.named]
        for row in existing(table, tried).itertuples()
    ]  # fmt: skip
    return (
        markdown_table(head, rows) + "\n\nTried: a random sample of the failed rows, with 30 to "
        "200 positions and with 12 modes. Left to others: of those that are left, without "
        "friction a sample to SLSQP from several starts, with friction all to shooting from the "
        "frictionless answer while the friction grows. These show that there is an equilibrium, "
        "not that the path from the first touch leads to it. *Of 10,000*: scenes that have no "
        "answer for this cause though smaller steps find one, and though the others do; in "
        "brackets the limits of 95 % confidence."
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
