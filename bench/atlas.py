"""Stiff and extreme cases: is the answer ever wrong in silence, and where is there none?

Random fingers with jaws and in direct contact, over ranges far beyond use (`tests/extremes.py`
draws them; kind and index reproduce each), and grids over single ranges. All are solved in bulk
(`support/atlas_bulk.py`: a run that was stopped goes on; the number of processes may be given). The
truth for jaws is shooting from the claimed answer (`tests/shooting_many.py`): it finds the exact
equilibrium next to it, and none where there is none; where a thin end makes it too sensitive to
close, the same scene with other modes. For direct contact it is the same scene with eight times as
many intervals. Both for a sample. A row is *wrong in silence* if it says "converged" and its true
error exceeds ten times its estimate (and what rounding does to any answer), or "no contact" where
the undeformed finger overlaps the target. Rows without an answer are solved again in other ways to
see whether there is one (`support/atlas_failures.py`).
"""

import sys
import time

import pandas as pd
from joblib import Parallel, delayed
from support import (
    atlas_bulk,
    atlas_failures,
    atlas_grids,
    atlas_pictures,
    atlas_runs,
    atlas_text,
    read_table,
    write_table,
)
from support.atlas_runs import extremes

JAW_SCENES = 1_000
"""Scenes of each of the six kinds of jaws; 16,667 are 100,000 in all."""
SIDE_SCENES = 25_000
"""Scenes of each of the four kinds of direct contact, 100,000 in all."""
SHOT_SCENES = 500
"""Scenes of each kind of jaws that are compared with shooting."""
FINER_SCENES = 40
"""Scenes of each kind of direct contact that are compared with finer ones."""
TRIED = 4
"""Failed rows of each kind, with friction and without, that are tried in other ways; ..."""
BY_SLSQP = 2
"""... and of those without friction that are still not solved, those that SLSQP gets."""
MOST_INTERVALS = 360
"""Of scenes in direct contact that are tried in other ways."""
JOBS = 2


def main(jobs: int = JOBS) -> None:
    jaws = atlas_bulk.run(extremes.JAW_KINDS, JAW_SCENES, jobs)
    sides = atlas_bulk.run(extremes.SIDE_KINDS, SIDE_SCENES, jobs)
    begin = time.perf_counter()
    for name, table, kinds, judge in (
        ("atlas_jaws", jaws, extremes.JAW_KINDS, shot),
        ("atlas_sides", sides, extremes.SIDE_KINDS, refined),
    ):
        tasks = [delayed(judge)(kind, int((table["kind"] == kind).sum())) for kind in kinds]
        known = pd.concat(Parallel(n_jobs=jobs)(tasks), ignore_index=True)
        whole = atlas_failures.described(table).merge(known, on=["kind", "index"], how="left")
        write_table(name, whole, seed=extremes.SEED, cpu_seconds=table.attrs["cpu_seconds"])
        by_kind = [part for _, part in sample(whole).groupby("kind", sort=False)]
        tasks = [delayed(atlas_failures.try_again)(part, BY_SLSQP) for part in by_kind]
        tried = pd.concat(Parallel(n_jobs=jobs)(tasks), ignore_index=True)
        write_table(f"{name}_failed", tried, seed=extremes.SEED)
    write_table("atlas_grid", atlas_grids.grid())
    write_table("atlas_condition", atlas_grids.conditions(), seed=extremes.SEED)
    print(f"truth, other ways and grids: {time.perf_counter() - begin:.0f} s")
    draw()
    print(section())


def draw() -> None:
    """The pictures, from the tables."""
    atlas_pictures.draw_jaws(read_table("atlas_jaws")[0])
    atlas_pictures.draw_sides(read_table("atlas_sides")[0])
    atlas_pictures.draw_grid(read_table("atlas_grid")[0])


def shot(kind: str, scenes: int) -> pd.DataFrame:
    """True errors of the first scenes of a kind of jaws: kind, index, error, rounding, found,
    judge."""
    last = atlas_runs.last_rows(atlas_runs.run_block(kind, 0, min(SHOT_SCENES, scenes)))
    judged = atlas_runs.judge_by_order(atlas_runs.shoot(kind, 0, last))
    return judged[["kind", "index", "error", "rounding", "found", "judge"]]


def refined(kind: str, scenes: int) -> pd.DataFrame:
    """The same for direct contact, by finer intervals."""
    count = min(extremes.BLOCK, scenes)
    last = atlas_runs.last_rows(atlas_runs.run_block(kind, 0, count)).sort_values("index")
    solved = last[last["status"] == "converged"]
    return atlas_runs.refine(solved.head(FINER_SCENES)).assign(kind=kind)


def sample(table: pd.DataFrame) -> pd.DataFrame:
    """The failed rows that are tried in other ways."""
    failed = table[table["cause"] != ""]
    if "solver.intervals" in failed:
        failed = failed[failed["solver.intervals"].astype(int) <= MOST_INTERVALS]
    rubs = failed["friction.mu"] > 0.0
    return failed.groupby(["kind", rubs], sort=False).head(TRIED)


def headlines() -> list[str]:
    return atlas_text.headlines(*(read_table(name)[0] for name in TABLES[:4]))


def section() -> str:
    return atlas_text.section(*(read_table(name) for name in TABLES))


TABLES = ("atlas_jaws", "atlas_sides", "atlas_jaws_failed", "atlas_sides_failed",
          "atlas_grid", "atlas_condition")  # fmt: skip


if __name__ == "__main__":
    main(*(int(jobs) for jobs in sys.argv[1:]))
