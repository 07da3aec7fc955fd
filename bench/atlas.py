"""Stiff and extreme cases: is the answer ever wrong in silence, and where is there none?

Random fingers with jaws and in direct contact, over ranges far beyond use (`tests/extremes.py`
draws them; kind and index reproduce each), and grids over single ranges. The truth for jaws is
shooting from the claimed answer (`tests/shooting_many.py`): it finds the exact equilibrium next to
it, and none where there is none; where a thin end makes it too sensitive to close, the same scene
with other modes. For direct contact it is the same scene with
eight times as many intervals. A row is *wrong in silence* if it says "converged" and its true error
exceeds ten times its estimate (and what rounding does to any answer). Rows without an answer are
solved again in other ways to see whether there is one.
"""

import time

import numpy as np
import pandas as pd
from support import atlas_grids, atlas_pictures, atlas_runs, markdown_table, read_table, write_table
from support.atlas_runs import extremes

JAW_SCENES = 500
"""Scenes of each of the six kinds of jaws; 17,000 are 100,000 in all."""
SIDE_SCENES = 300
"""Scenes of each of the four kinds of direct contact."""
FINER_SCENES = 40
"""Scenes of each kind of direct contact that are compared with finer ones."""
RETRIED = 4
"""Failed rows of each kind, with friction and without, that are tried again in other ways."""
CAUSES = {
    "snaps": "the branch from first touch ended at a limit point, which the row tells",
    "No equilibrium on the branch": "friction locks, or the branch from first touch ends",
    "overlap": "the target cannot be got out of the way (taut finger, target inside the jaw)",
    "from the last position": "not solved",
}
"""What the advice of a failed row says, and its cause."""
WRONG = 10.0
"""Times the estimate."""
JAW_RETRIES = ({"path.steps": 200}, {"path.steps": 60, "solver.order": 12})


def main() -> None:
    begin = time.perf_counter()
    jaws = pd.concat([run_jaws(kind) for kind in extremes.JAW_KINDS], ignore_index=True)
    write_table("atlas_jaws", jaws, seed=extremes.SEED, seconds=time.perf_counter() - begin)
    begin = time.perf_counter()
    sides = pd.concat([run_sides(kind) for kind in extremes.SIDE_KINDS], ignore_index=True)
    write_table("atlas_sides", sides, seed=extremes.SEED, seconds=time.perf_counter() - begin)
    write_table("atlas_failed", retry(jaws), seed=extremes.SEED, retries=len(JAW_RETRIES))
    write_table("atlas_grid", atlas_grids.grid())
    write_table("atlas_condition", atlas_grids.conditions(), seed=extremes.SEED)
    draw()


def draw() -> None:
    """The pictures, from the tables."""
    jaws, _ = read_table("atlas_jaws")
    sides, _ = read_table("atlas_sides")
    grid, _ = read_table("atlas_grid")
    atlas_pictures.draw_jaws(jaws)
    atlas_pictures.draw_sides(sides)
    atlas_pictures.draw_grid(grid)


def run_jaws(kind: str) -> pd.DataFrame:
    """The deepest rows of all scenes of a kind, with true errors where they were shot."""
    found = []
    for block, count in _blocks(JAW_SCENES):
        last = atlas_runs.last_rows(atlas_runs.run_block(kind, block, count))
        shot = atlas_runs.judge_by_order(atlas_runs.shoot(kind, block, last))
        columns = ["index", "error", "rounding", "found", "judge"]
        found.append(last.merge(shot[columns], on="index", how="left"))
        print(kind, block, last["status"].value_counts().to_dict(), flush=True)
    return pd.concat(found, ignore_index=True)


def _blocks(scenes: int) -> list[tuple[int, int]]:
    """Blocks and how many of each one's scenes are used."""
    size = extremes.BLOCK
    return [(i, min(size, scenes - i * size)) for i in range(-(-scenes // size))]


def run_sides(kind: str) -> pd.DataFrame:
    """The same for direct contact, true errors by finer intervals."""
    found = []
    for block, count in _blocks(SIDE_SCENES):
        found.append(atlas_runs.last_rows(atlas_runs.run_block(kind, block, count)))
    last = pd.concat(found, ignore_index=True)
    print(kind, last["status"].value_counts().to_dict(), flush=True)
    judged = atlas_runs.refine(last.sort_values("index").head(FINER_SCENES))
    return last.merge(judged, on="index", how="left")


def retry(jaws: pd.DataFrame) -> pd.DataFrame:
    """The failed rows of fingers with jaws, and whether another way of solving them finds an
    answer."""
    failed = jaws[~jaws["status"].isin(atlas_runs.SOLVED)]
    rubs = failed["friction.mu"] > 0.0
    chosen = failed.groupby([failed["kind"], rubs], sort=False).head(RETRIED)
    solved_by = []
    for kind, index in zip(chosen["kind"], chosen["index"], strict=True):
        solved_by.append(atlas_runs.retry(kind, int(index), JAW_RETRIES))
    return chosen.assign(solved_by=solved_by)


def wrong_in_silence(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of a table with true errors that break the rule."""
    claimed = (table["status"] == "converged") & table["found"].eq(True)
    return table[claimed & (table["error"] > WRONG * table["error_estimate"] + table["rounding"])]


def unanswered(table: pd.DataFrame) -> pd.DataFrame:
    """Rows that say "converged" but next to which there is no equilibrium, beyond what an estimate
    above 1/10 admits."""
    lost = (table["status"] == "converged") & table["found"].eq(False)
    return table[lost & (table["error_estimate"] < 0.1)]


def headlines() -> list[str]:
    jaws, _ = read_table("atlas_jaws")
    sides, _ = read_table("atlas_sides")
    failed, _ = read_table("atlas_failed")
    wrong, lost = len(wrong_in_silence(jaws)), len(unanswered(jaws))
    shot = int(jaws["found"].notna().sum())
    smooth = failed[failed["friction.mu"] == 0.0]
    exists = int((smooth["solved_by"] != "").sum())
    refined = int(sides["found"].eq(True).sum())
    return [
        f"Of {len(jaws):,} random fingers with jaws, far beyond use, {shot:,} were compared with "
        f"shooting: {wrong + lost} are wrong in silence. "
        f"{exists} without friction have no answer though there is one.",
        f"Of {len(sides):,} random fingers in direct contact {refined:,} were compared with eight "
        f"times as many intervals: {len(wrong_in_silence(sides))} are wrong in silence.",
    ]


def section() -> str:
    jaws, about = read_table("atlas_jaws")
    sides, about_sides = read_table("atlas_sides")
    failed, _ = read_table("atlas_failed")
    grid, _ = read_table("atlas_grid")
    condition, _ = read_table("atlas_condition")
    machine = about["machine"]
    assert isinstance(machine, dict)
    return "\n\n".join(
        [
            "## Stiff and extreme cases",
            "Random scenes over E from 1e-3 to 1e15 Pa, L from 1e-6 to 1e3 m, w/L from 1e-5 to "
            "0.5, tapers from 1000:1 to 1:1000, orders 2 to 32 and automatic, one jump from "
            "undeformed to the deepest position or twelve positions, grazing contact, corners met "
            "head-on, friction up to and above what locks, huge gaps; direct contact with N from 4 "
            f"to 10,000. Seed {about['seed']}; `tests/extremes.py` makes a scene from its kind and "
            f"index. Machine: {machine['cpu']}, revision {machine['revision']}, "
            f"{about['seconds']:.0f} s for jaws with shooting, {about_sides['seconds']:.0f} s for "
            "direct contact (wall clock).",
            _counts(jaws, "kind"),
            "Wrong in silence: converged, and the true error above ten times the estimate. "
            "*No equilibrium there*: neither shooting from the claimed answer nor other modes find "
            "one, though the estimate is below 0.1. Residual: largest of the KKT residuals of "
            "converged rows.",
            _failures(jaws, failed),
            _snaps(jaws),
            "![Random jaws](results/atlas_jaws.png)",
            _counts(sides, "kind"),
            "The truth here is the same scene with eight times as many intervals.",
            "![Random direct contact](results/atlas_sides.png)",
            _grid(grid),
            "![Grids](results/atlas_grid.png)",
            _conditions(condition),
        ]
    )


def _counts(table: pd.DataFrame, by: str) -> str:
    head = ["", "scenes", "converged", "no contact", "failed, μ = 0", "failed, μ > 0", "compared",
            "wrong in silence", "no equilibrium there", "residual", "iterations"]  # fmt: skip
    rows = []
    for name, part in table.groupby(by, sort=False):
        failed = ~part["status"].isin(atlas_runs.SOLVED)
        rubs = part["friction.mu"] > 0.0
        solved = part[part["status"] == "converged"]
        counts = [
            len(part), len(solved), (part["status"] == "no_contact").sum(), (failed & ~rubs).sum(),
            (failed & rubs).sum(), part["found"].notna().sum(), len(wrong_in_silence(part)),
            len(unanswered(part)),
        ]  # fmt: skip
        steps = solved["iterations"]
        rows.append([str(name), *(f"{count:,}" for count in counts),
                     f"{solved['kkt_residual'].max():.0e}",
                     f"{steps.median():.0f}, at most {steps.max()}"])  # fmt: skip
    return markdown_table(head, rows)


def causes(table: pd.DataFrame) -> pd.Series:
    """The cause of each row's failure."""
    found = pd.Series("other", index=table.index)
    for word, cause in CAUSES.items():
        found[table["advice"].str.contains(word, regex=False)] = cause
    return found


def _failures(jaws: pd.DataFrame, tried: pd.DataFrame) -> str:
    """The failed rows by cause, with and without friction; how many of those tried again have an
    answer."""
    head = ["failed jaws", "friction", "scenes", "tried again", "solved another way",
            "for example (kind index)"]  # fmt: skip
    failed = jaws[~jaws["status"].isin(atlas_runs.SOLVED)]
    solved_by = tried.set_index(["kind", "index"])["solved_by"]
    failed = failed.join(solved_by, on=["kind", "index"])
    rubs = np.where(failed["friction.mu"] > 0.0, "μ > 0", "μ = 0")
    rows = []
    for (cause, friction), part in failed.groupby([causes(failed), rubs]):
        again = part["solved_by"].notna()
        solved = part[again & (part["solved_by"] != "")]
        named = pd.concat([solved, part[~part.index.isin(solved.index)]]).head(4)
        listed = (named["kind"] + " " + named["index"].astype(str)).tolist()
        rows.append([cause, friction, f"{len(part):,}", f"{again.sum():,}", f"{len(solved):,}",
                     ", ".join(listed)])  # fmt: skip
    return markdown_table(head, rows)


def _snaps(jaws: pd.DataFrame) -> str:
    snapped = jaws["advice"].str.contains("snaps", regex=False)
    solved = jaws["status"].isin(atlas_runs.SOLVED)
    return (
        f"{(snapped & solved).sum():,} more paths pass a limit point, say so with its position and "
        "the energy released, and go on behind it."
    )


def _grid(grid: pd.DataFrame) -> str:
    head = ["grid", "rows", "failed", "not closed", "largest error over estimate", "largest error"]
    rows = []
    for name, part in grid.groupby("grid", sort=False):
        solved = part[part["status"] == "converged"]
        ratio = (solved["error"] - solved["rounding"]).clip(lower=0.0) / solved["error_estimate"]
        rows.append([str(name), str(len(part)), str(len(part) - len(solved)),
                     str(solved["error"].isna().sum()), f"{ratio.max():.2g}",
                     f"{solved['error'].max():.1e}"])  # fmt: skip
    return markdown_table(head, rows)


def _conditions(table: pd.DataFrame) -> str:
    low, middle, high = table["condition"].quantile([0.0, 0.5, 1.0])
    return (
        f"Condition number of the KKT matrix (modes and contact, {len(table)} random scenes): "
        f"{low:.1f} to {high:.1e}, median {middle:.1f}, whatever E, L, w/L and taper: the modes "
        "are orthonormal in the energy."
    )


if __name__ == "__main__":
    main()
