"""Stiff and extreme cases: is the answer ever wrong in silence, and where is there none?

Random fingers with jaws and in direct contact, over ranges far beyond use (`tests/extremes.py`
draws them; kind and index reproduce each), and grids over single ranges. All are solved in bulk; a
run that was stopped goes on (`support/atlas_store.py`); the number of processes may be given. Every
converged row of the first scenes of each kind is compared with the truth
(`support/atlas_truth.py`), the truth with one of 34 digits (`support/atlas_digits.py`). A row is
*wrong in silence* if it says "converged" and its true error exceeds ten times its estimate (and
what rounding does to any answer), or "no contact" where the undeformed finger overlaps the target.
Rows without an answer are solved again in other ways, and their branch is followed from first
touch, to see whether there is one (`support/atlas_failures.py`); those without friction for which
there is are kept as test cases (`support/atlas_kept.py`).
"""

import sys
import time

import pandas as pd
from support import (
    atlas_bulk,
    atlas_digits,
    atlas_failures,
    atlas_features,
    atlas_grids,
    atlas_kept,
    atlas_pictures,
    atlas_store,
    atlas_text,
    atlas_truth,
    read_table,
    write_table,
)
from support.atlas_store import Piece, extremes

JAW_SCENES = 16_667
"""Scenes of each of the six kinds of jaws, 100,000 in all."""
SIDE_SCENES = 25_000
"""Scenes of each of the four kinds of direct contact, 100,000 in all."""
SECONDS = 900.0
"""After which no further scenes of jaws are begun, nor of direct contact; another run goes on."""
SHOT_SCENES = 300
"""Scenes of each kind of jaws of which every row is compared with shooting."""
FINER_SCENES = 200
"""Scenes of each kind of direct contact of which every row is compared with finer intervals."""
SCENES_A_PIECE = 100
"""That are judged in one go."""
TRIED = 12
"""Failed rows of each kind and cause, with friction and without, that are tried in other ways."""
FOLLOWED = {"jaws": 8, "sides": 4}
"""And of those without friction, those whose branch is followed."""
DIGITS = 5
"""Scenes of each kind of jaws whose truth is computed to 34 digits."""
MOST_INTERVALS = 360
"""Of scenes in direct contact that are tried in other ways."""
JOBS = 2


def main(jobs: int = JOBS) -> None:
    begin = time.perf_counter()
    tried = []
    for what, kinds, scenes, judge, known in (
        ("jaws", extremes.JAW_KINDS, JAW_SCENES, atlas_truth.jaws, SHOT_SCENES),
        ("sides", extremes.SIDE_KINDS, SIDE_SCENES, atlas_truth.sides, FINER_SCENES),
    ):
        name = f"atlas_{what}"
        table = atlas_bulk.run(kinds, scenes, jobs, SECONDS)
        write_table(name, table, seed=extremes.SEED, **table.attrs)
        pieces = [
            Piece(f"truth-{kind}-{first}", judge, (kind, first, SCENES_A_PIECE))
            for first in range(0, min(known, scenes), SCENES_A_PIECE)
            for kind in kinds
        ]
        judged = atlas_store.run("truth", pieces, jobs)
        write_table(f"{name}_judged", judged, scenes=known, **judged.attrs)
        tried.append(atlas_store.run("other ways", ways(table, FOLLOWED[what]), jobs))
        write_table(f"{name}_failed", tried[-1], seed=extremes.SEED, **tried[-1].attrs)
        write_table(f"{name}_features", atlas_features.tally(table, judged))
    kinds = (*extremes.JAW_KINDS, *extremes.SIDE_KINDS)
    kept = atlas_kept.pieces(kinds, pd.concat(tried))
    listed = atlas_store.run("kept cases", kept, jobs)
    write_table("atlas_listed", listed, **listed.attrs)
    atlas_kept.keep(listed)
    pieces = [
        Piece(f"digits-{kind}", atlas_digits.compare, (kind, DIGITS)) for kind in extremes.JAW_KINDS
    ]
    write_table("atlas_digits", atlas_store.run("34 digits", pieces, jobs))
    write_table("atlas_grid", atlas_grids.grid())
    write_table("atlas_condition", atlas_grids.conditions(), seed=extremes.SEED)
    print(f"in all {time.perf_counter() - begin:.0f} s")
    draw()
    print(section())


def ways(table: pd.DataFrame, follows: int) -> list[Piece]:
    """The failed rows that are tried in other ways, drawn at random; of each kind and cause so many
    are followed from first touch."""
    failed = table[table["cause"] != ""]
    if "solver.intervals" in failed:
        failed = failed[failed["solver.intervals"].astype(int) <= MOST_INTERVALS]
    pieces = []
    for (kind, cause, rubs), part in failed.groupby(["kind", "cause", failed["friction.mu"] > 0.0]):
        some = part.sample(min(TRIED, len(part)), random_state=extremes.SEED).sort_index()
        name = f"tried-{kind}-{cause}-{'rubs' if rubs else 'smooth'}".replace(" ", "_")
        pieces.append(Piece(name, atlas_failures.try_again, (kind, some, follows)))
    return pieces


def draw() -> None:
    """The pictures, from the tables."""
    jaws, sides = (read_table(f"atlas_{one}")[0] for one in ("jaws", "sides"))
    atlas_pictures.draw_jaws(jaws, read_table("atlas_jaws_judged")[0])
    atlas_pictures.draw_sides(sides, read_table("atlas_sides_judged")[0])
    atlas_pictures.draw_grid(read_table("atlas_grid")[0])


def headlines() -> list[str]:
    return atlas_text.headlines(*(read_table(name)[0] for name in TABLES[:6]))


def section() -> str:
    return atlas_text.section(*(read_table(name) for name in TABLES))


TABLES = (
    "atlas_jaws", "atlas_sides", "atlas_jaws_judged", "atlas_sides_judged", "atlas_jaws_failed",
    "atlas_sides_failed", "atlas_jaws_features", "atlas_sides_features", "atlas_digits",
    "atlas_grid", "atlas_condition", "atlas_listed",
)  # fmt: skip


if __name__ == "__main__":
    main(*(int(jobs) for jobs in sys.argv[1:]))
