"""Performance profiles (Dolan & Moré 2002) of all solvers over random snap-fits.

Each scene is solved at one position from the undeformed finger ("cold") and along a path of
positions, each from those before ("warm"). A solver solves a task where it converges in its own
words and the contact force is right, within an accuracy, at every position; truth is by shooting.
Same accuracy first: every solver has a ladder of settings, from loose to tight, and the cheapest
that is accurate enough counts, chosen with the truth in hand. What no setting solves counts as
infinite time. fastncm runs as for everybody, one scene at a time; what it takes where the scenes
are solved together is given beside.
"""

import math

import numpy as np
import pandas as pd
from profiles_parts.ladders import ACCURACIES, CAP, LADDERS, ORDER, runs
from profiles_parts.reading import picture, side_by_side, summary, times, together_text
from support import read_table, write_table
from support.fastncm_runs import solve_together
from support.one_core import on_one_core
from support.random_scenes import random_scenes

SCENES = 500
SEED = 20261122
POSITIONS = 6


def main() -> None:
    on_one_core()
    scenes, again = random_scenes(SCENES, POSITIONS, SEED)
    print(f"{len(scenes)} scenes, {again} drawn again")
    runs(0, scenes[0])  # compiles
    table = pd.concat([runs(i, scene) for i, scene in enumerate(scenes)], ignore_index=True)
    together = solve_together(scenes, LADDERS["fastncm"])
    notes = {"seed": SEED, "drawn_again": again, "order": ORDER, "cap_s": CAP}
    write_table("profiles", table, **notes)
    write_table("profiles_together", together, **notes)
    picture(table, together, POSITIONS)
    print(section())


def headlines() -> list[str]:
    """For the first page."""
    table, _ = read_table("profiles")
    together, _ = read_table("profiles_together")
    accuracy = min(ACCURACIES)
    warm, cold = (times(table, start, accuracy) for start in ("warm", "cold"))
    joint = times(side_by_side(table, together), "warm", accuracy)
    solved = np.isfinite(warm).sum()
    words = {"paper": "the paper's algorithm"}
    others = ", ".join(f"{words.get(n, n)} {solved[n]}" for n in warm.columns if n != "fastncm")

    def slower(wide: pd.DataFrame, name: str) -> float:
        return (wide[name] / wide["fastncm"]).replace(math.inf, math.nan).median()

    rivals = [name for name in warm.columns if solved[name] >= MANY * len(warm)]
    quickest = min((name for name in rivals if name != "fastncm"), key=lambda n: slower(warm, n))
    takes = [f"{slower(wide, quickest):.2g}" for wide in (joint, warm, cold)]
    return [
        f"Of {len(warm)} random snap-fits along {POSITIONS} positions fastncm solves "
        f"{solved['fastncm']} to {accuracy:.0e} ({others}). {quickest}, the quickest rival that "
        f"solves {MANY:.0%}, takes {takes[0]} times as long as fastncm with the scenes side by "
        f"side, {takes[1]} times as long as with one path at a time, and {takes[2]} times as long "
        "for one cold position alone."
    ]


MANY = 0.9
"""Of the scenes, that a rival must solve for the headline."""


def section() -> str:
    """The report's part."""
    table, about = read_table("profiles")
    together, _ = read_table("profiles_together")
    machine = about["machine"]
    return "\n\n".join(
        [
            "## Performance profiles over random snap-fits",
            f"`bench/profiles.py`; {machine['cpu']}, SciPy {machine['scipy']}, revision "
            f"{machine['revision']}, {machine['date']}; seed {about['seed']}.",
            f"{table['scene'].nunique()} random scenes ({about['drawn_again']} draws had no "
            "solution by shooting and were drawn again): straight and arc-shaped jaws before "
            "circles and blocks, with random lead angles, heights and radii, without friction. "
            "The optimisers and `root`, which gets the equilibrium of one contact as equations, "
            f"have {about['order']} modes. Each solver's time is that of its "
            "cheapest setting that gets the force right at every position; where none does, or "
            f"one position takes more than {about['cap_s']:g} s, it has failed. The error of the "
            "paper's algorithm is that of its points, up to "
            f"M = {table.loc[table['solver'] == 'paper', 'step'].max():.0f} here.",
            "![Performance profiles](results/profiles.png)",
            *(
                summary(table, start, accuracy)
                for start in ("cold", "warm")
                for accuracy in ACCURACIES
            ),
            together_text(together),
        ]
    )


if __name__ == "__main__":
    main()
