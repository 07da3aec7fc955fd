"""What each command does. The first line of a docstring is the command's help."""

import argparse
import sys
from importlib import import_module
from pathlib import Path
from threading import Thread

from fastncm.cli import output
from fastncm.cli.codes import BROKEN_OFF, DONE, SOME_FAILED
from fastncm.cli.inputs import OUT_SUFFIXES, PLOT_SUFFIXES, check_file, settings


def scenes(_: argparse.Namespace) -> int:
    """List the shipped scenes."""
    from fastncm.scene import load_scene, shipped_scenes

    for name, description in shipped_scenes().items():
        print(f"{name:16} {description}")
        assumed = load_scene(name).assumed
        if assumed:
            print(f"{'':16} assumed: {assumed}")
    return DONE


def solve(options: argparse.Namespace) -> int:
    """Solve one scene along its path, print the curve, write it where asked."""
    from fastncm.scene import load_scene

    scene = load_scene(options.scene).replace(settings(options.set))
    check_file(options.out, "--out", OUT_SUFFIXES)
    check_file(options.plot, "--plot", PLOT_SUFFIXES)

    from fastncm.curve import solve as solve_curve
    from fastncm.sweeping.read import GOOD_STATUS

    curve = solve_curve(scene)
    frame = curve.frame()
    print(f"{scene.name}: {len(frame)} positions")
    if scene.assumed:
        print(f"assumed: {scene.assumed}")
    output.print_curve(curve)
    if options.out:
        output.write_frame(frame, options.out)
        print(f"curve: {options.out}")
    if options.plot:
        from fastncm.plot import plot_curve

        print(f"picture: {plot_curve(curve, options.plot)}")
    failed = int((~frame["status"].isin(GOOD_STATUS)).sum())
    if failed:
        print(f"failed: {failed} of {len(frame)} positions")
    if curve.advice:
        print(curve.advice)
    return SOME_FAILED if failed else DONE


def sweep(options: argparse.Namespace) -> int:
    """Run a study, or what is missing of it; print where the table is and the best designs."""
    from fastncm.sweeping import BrokenOff
    from fastncm.sweeping import sweep as run_sweep

    # what draws is loaded while the compiled code is, and while workers solve
    Thread(target=import_module, args=("fastncm.plot",), daemon=True).start()
    try:
        run = run_sweep(
            options.study,
            options.out,
            options.jobs,
            backend=options.backend,
            scheduler=options.scheduler,
        )
    except BrokenOff as error:
        print(f"fastncm: {error}", file=sys.stderr)
        return BROKEN_OFF
    if not run.fresh:
        print("this study is complete already: nothing was solved again")
    elif run.resumed:
        print(f"{run.resumed} cases were in the table already: the others were solved")
    print(
        f"{run.rows} cases in {run.seconds:.2f} s, {run.failed} failed; "
        f"{run.shape_paths} shape paths, {run.solves} contact solves"
    )
    print(f"table: {run.out}/cases")
    if isinstance(run.out, Path):
        plot(argparse.Namespace(folder=run.out))
    goal = f"{run.report.best} {run.report.column}"
    limits = "".join(f", {name} <= {limit:g}" for name, limit in run.report.limits.items())
    print(f"best designs ({goal}{limits}):")
    best = run.best().drop(columns=["status", "advice", "case_key"], errors="ignore")
    print(output.table(best) if len(best) else "  none")
    return output.report_failed_cases(run.out)


def status(options: argparse.Namespace) -> int:
    """Say how far a sweep has come, who is at it, and what failed."""
    from fastncm.sweeping.read import count_statuses
    from fastncm.sweeping.status import describe
    from fastncm.sweeping.storage import Storage

    storage = Storage(options.folder)
    for line in describe(storage):
        print(line)
    for (word, _), number in sorted(count_statuses(storage).items()):
        print(f"  {word}: {number}")
    return output.report_failed_cases(options.folder)


def compact(options: argparse.Namespace) -> int:
    """Join the small parts of a sweep that broke off (a sweep that ends does so itself)."""
    from fastncm.sweeping.compact import compact_folder

    before, after = compact_folder(options.folder)
    print(f"{before} files before, {after} now")
    return DONE


def plot(options: argparse.Namespace) -> int:
    """Draw the pictures of a sweep into its folder."""
    from fastncm.plot import plot_run

    for picture in plot_run(options.folder):
        print(f"picture: {picture}")
    return DONE


def warmup(_: argparse.Namespace) -> int:
    """Compile everything the shipped scenes need, so that later commands start at once: the code
    for jaws and that for direct contact in a process each."""
    from time import perf_counter

    from joblib import Parallel, delayed

    from fastncm.scene import load_scene, shipped_scenes

    started = perf_counter()
    kinds: dict[bool, list[str]] = {}
    for name in shipped_scenes():
        kinds.setdefault(load_scene(name).jaw is None, []).append(name)
    Parallel(n_jobs=len(kinds))(delayed(_compile)(names) for names in kinds.values())
    print(f"ready: compiled code loaded or made in {perf_counter() - started:.1f} s")
    return DONE


def _compile(names: list[str]) -> None:
    """Solve the shipped scenes of these names in all the ways that are compiled apart."""
    from fastncm.cases import solve_chunk
    from fastncm.curve import solve as solve_curve
    from fastncm.scene import load_scene

    for name in names:
        for shear in (False, True):
            scene = load_scene(name).replace({"model.shear": shear})
            solve_curve(scene)
            solve_chunk(scene, {}, curves=True)
        if scene.jaw is not None:  # what the SQP alone can solve
            solve_curve(scene.replace({"solver.hessian": "bfgs", "path.steps": 3}))
