"""The atlas's part of the report, from its tables alone."""

import pandas as pd

from support.atlas_rates import ALL, existing, limits, upper
from support.atlas_tables import (
    COUNTED,
    conditions,
    counts,
    failures,
    features,
    grids,
    judges,
    listed,
    truth,
)
from support.atlas_truth import MOST_INTERVALS, TIMES
from support.atlas_verdicts import LOOSE, loose, scenes_in, unanswered, wrong_in_silence

Table = tuple[pd.DataFrame, dict[str, object]]


def headlines(
    jaws: pd.DataFrame, sides: pd.DataFrame, jaws_judged: pd.DataFrame, sides_judged: pd.DataFrame,
    jaws_tried: pd.DataFrame, sides_tried: pd.DataFrame,
) -> list[str]:  # fmt: skip
    """For the first page."""
    said = []
    for what, table, judged, tried, how in (
        ("fingers with jaws", jaws, jaws_judged, jaws_tried, "with shooting or other modes"),
        ("fingers in direct contact", sides, sides_judged, sides_tried,
         f"with up to {TIMES[0]} times as many intervals"),
    ):  # fmt: skip
        wrong, lost = len(wrong_in_silence(judged)), len(unanswered(judged))
        left = existing(table, tried)
        smooth, rubs = (
            left[left["cause"].eq(ALL) & left["friction"].eq(which)].iloc[0]
            for which in ("μ = 0", "μ > 0")
        )
        said.append(
            f"Of {len(table):,} random {what}, far beyond use, {judged['index'].count():,} rows of "
            f"{scenes_in(judged):,} were compared {how}: {wrong} are wrong in silence (at most "
            f"{upper(wrong, len(judged)):.1f} of 10,000 with 95 % confidence), for {lost} there is "
            f"no truth. {table['overlaps'].sum():,} of all say that there is no "
            f"contact where there is. Of 10,000, without friction, {limits(*smooth['of_missing'])} "
            "have no answer though the path from first touch leads to one (the goal is 1), and "
            f"{smooth['of_elsewhere'][0]:.2g} one behind a snap; with friction "
            f"{rubs['of_missing'][0]:.2g} though smaller steps have one."
        )
    return said


def section(
    jaws: Table, sides: Table, jaws_judged: Table, sides_judged: Table, jaws_tried: Table,
    sides_tried: Table, jaws_features: Table, sides_features: Table, digits: Table, grid: Table,
    condition: Table, kept: Table,
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
            f"The truth here is the same scene with {' or '.join(map(str, TIMES))} times as many "
            "intervals (each where the one before has no answer), at most "
            f"{MOST_INTERVALS:,}; *no truth*: none has an answer. " + judges(sides_judged[0]),
            features(sides_features[0]),
            failures(sides[0], sides_tried[0]),
            "![Random direct contact](results/atlas_sides.png)",
            "### Kept cases",
            listed(kept[0]),
            "### The truth to 34 digits, grids, condition",
            truth(digits[0]),
            grids(grid[0]),
            "![Grids](results/atlas_grid.png)",
            conditions(condition[0]),
        ]
    )
