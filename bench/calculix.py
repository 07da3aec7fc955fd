"""How far from finite elements is the beam, and how much faster?

CalculiX (`ccx`) on decks that `calculix_parts` writes, for both snap-fit scenes at mu = 0, 0.2 and
0.4 and for rubber fingers on an ellipse; its forces beside the reference of data/ and beside
fastncm's with shear, in sliding equilibrium and by the recovered rule. Times are those of one
core. Arguments: cases to run again alone, such as snapfit-corner:fine:0.4. Without CalculiX on
the PATH nothing is run and the tables stay as they are.
"""

import math
import sys
import time

import numpy as np
import pandas as pd
from calculix_parts import pictures, report
from calculix_parts.cases import MATERIAL, Case, all_cases, other_penalties
from calculix_parts.errors import finest, largest
from calculix_parts.runs import available, run, version
from support import markdown_table, read_table, write_table

import fastncm

LIMIT = 300.0
"""Seconds by the clock after which a run is given up."""
ROUNDS = 20
BATCH = 1000
"""Designs of different width of a sweep, solved at once."""
ELSEWHERE = (
    ("CalculiX, face to face, tuned, 61 elements", 2.0, 0.3),
    ("CalculiX, face to face, finer", 18.0, 0.2),
    ("CalculiX, face to face, finest", 75.0, 0.05),
    ("purpose-built code in Python, rigid jaw", 0.1, 0.2),
)
"""Measured by others for a curve of 11 positions of snapfit-circle: what, seconds, error in %
(the README of the reference forces)."""


def main() -> None:
    if not available():
        print("CalculiX is not installed (ccx; Debian: apt-get install calculix-ccx): not run")
        return
    chosen = sys.argv[1:]
    if not chosen:
        study("calculix_penalty", other_penalties(), [])
    study("calculix", [case for case in all_cases() if not chosen or case.name in chosen], chosen)
    pictures.draw(*tables("calculix"))
    print(section())


def study(name: str, cases: list[Case], chosen: list[str]) -> None:
    """Run the cases; the tables grow with each, so that a broken-off study is not lost. Where only
    some cases are chosen, the others' rows stay."""
    forces, runs = [], []
    if chosen:
        forces, runs = ([table[~named(table).isin(chosen)]] for table in tables(name))
    settings = {"limit_s": LIMIT, "batch": BATCH, "material_of_the_rubber": MATERIAL}
    for case in cases:
        rows, figures = solved(case)
        forces.append(rows)
        runs.append(pd.DataFrame([figures]))
        print(", ".join(f"{name} {figure}" for name, figure in figures.items()), flush=True)
        write_table(f"{name}_forces", pd.concat(forces, ignore_index=True), **settings)
        write_table(f"{name}_runs", pd.concat(runs, ignore_index=True), **settings)


def named(table: pd.DataFrame) -> pd.Series:
    """Each row's case as the arguments give it."""
    return table["scene"] + ":" + table["mesh"] + ":" + table["mu"].map("{:g}".format)


def tables(name: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Forces and runs of a study, in the order of its cases."""
    order = {case.name: number for number, case in enumerate(all_cases())}
    forces, runs = (
        table.iloc[np.argsort(named(table).map(order), kind="stable")].reset_index(drop=True)
        for table in (read_table(f"{name}_{kind}")[0] for kind in ("forces", "runs"))
    )
    return forces, runs


def solved(case: Case) -> tuple[pd.DataFrame, dict[str, object]]:
    """Forces of finite elements and beams at the case's positions, and what they have cost."""
    known = case.reference()
    paths = list(case.paths())
    done = [run(model, case.mu, increments, LIMIT) for model, increments in paths]
    found = np.concatenate([each.forces for each in done])
    positions = known["position"].to_numpy()
    table = pd.DataFrame(
        {
            "scene": case.scene,
            "mesh": case.mesh,
            "mu": case.mu,
            "penalty": case.penalty,
            "position": positions,
            "fem_x_N": found[:, 0],
            "fem_y_N": found[:, 1],
            "reference_x_N": known["force_x_N"],
            "reference_y_N": known["force_y_N"],
        }
    )
    models = {"equilibrium": {}, "recovered": {"friction.model": "recovered"}}
    for name, changes in models.items():
        scene = case.beam(**{"model.shear": True, **changes})
        beam = fastncm.solve(scene, positions=positions).frame()
        table[f"{name}_x_N"], table[f"{name}_y_N"] = beam["force_x_N"], beam["force_y_N"]
    model = paths[0][0]
    one, many = beam_seconds(case, positions)
    return table, {
        "scene": case.scene,
        "mesh": case.mesh,
        "mu": case.mu,
        "penalty_MPa_mm": case.fineness.stiffness,
        "finger_elements": len(model.parts["FINGER"]),
        "elements": sum(len(elements) for elements in model.parts.values()),
        "positions": len(positions),
        "reached": int(np.isfinite(found[:, 0]).sum()),
        "fem_s": sum(each.seconds for each in done),
        "fem_wall_s": sum(each.wall for each in done),
        "increments": sum(each.increments for each in done),
        "iterations": sum(each.iterations for each in done),
        "attempts": sum(each.attempts for each in done),
        "version": version(),
        "message": "; ".join(filter(None, (each.message for each in done))),
        "beam_s": one,
        "beam_in_sweep_s": many,
    }


def beam_seconds(case: Case, positions: np.ndarray) -> tuple[float, float]:
    """CPU seconds of fastncm for the curve: solved alone at the same positions, and of one curve
    with as many positions in a sweep of problems of their own. Compiled before."""
    scene = case.beam(**{"model.shear": True, "path.steps": len(positions)})
    thickness = np.atleast_1d(scene.finger.thickness)
    factors = np.linspace(0.9, 1.1, BATCH)
    cases = pd.DataFrame({"finger.thickness": [list(thickness * f) for f in factors]})
    if len(thickness) == 1:
        cases = pd.DataFrame({"finger.thickness": thickness[0] * factors})
    one = many = math.inf
    for count in range(ROUNDS):
        begin = time.process_time()
        fastncm.solve(scene, positions=positions)
        one = min(one, time.process_time() - begin)
        if count < 3:
            begin = time.process_time()
            fastncm.solve_cases(scene, cases)
            many = min(many, (time.process_time() - begin) / BATCH)
    return one, many


def section() -> str:
    forces, runs = tables("calculix")
    machine = read_table("calculix_runs")[1]["machine"]
    here = ", ".join(f"{name} {machine[name]}" for name in ("cpu", "cores", "revision", "date"))
    return "\n\n".join(
        [
            "## Finite elements: CalculiX",
            f"Measured on: {here}. CalculiX {runs['version'].iloc[0]}, one thread, CPU time.",
            PLAN,
            "CalculiX against the reference forces (`bench/data/`), largest difference of the "
            "force vector over all positions, in % of the force:",
            report.against_reference(forces, runs),
            report.failures(runs),
            report.sensitivity(*tables("calculix_penalty")),
            "fastncm with shear against the finest mesh, largest differences over all positions: "
            "of the force vector, and of its magnitude:",
            report.against_beam(forces),
            "![Forces of CalculiX and of the beam](results/calculix_forces.png)",
            "The paper's Tables 2 and 5 in our terms, for one curve: CalculiX, fastncm for the "
            f"same positions in one call, and for a curve of a sweep of {BATCH:,} designs, each a "
            "problem of its own. Compiling, meshing and writing decks are left out.",
            report.times(runs),
            f"All runs of the table together: {runs['fem_s'].sum():.0f} s. The machine was shared, "
            "by which single times may be up to twice too long.",
            "![Error over time](results/calculix_time.png)",
            "Our decks are made to be right, not to be fast. Others have measured, elsewhere, for "
            "11 positions of snapfit-circle:",
            markdown_table(
                ["finite elements", "s", "error"],
                [[name, f"{seconds:g}", f"{error:g} %"] for name, seconds, error in ELSEWHERE],
            ),
        ]
    )


PLAN = f"""Eight-node plane-stress elements with NLGEOM, 0.1 mm wide and scaled to the finger's
width, since CalculiX's expanded elements are too stiff with the real one; a jaw 1,000 times as
stiff as the finger; all nodes of the target prescribed; contact from node to surface with a linear
penalty, which for a jaw and a target that are both rigid is more accurate than from face to face;
one step for the path, because CalculiX extrapolates within a step only, and a second attempt with
half the increments where it gives up or jumps to another branch. Friction is Coulomb's with
a steep slope of sticking. At snapfit-corner's x_c = 0.057924 m the force jumps, and the position
beyond has a path of its own. "rubber-ellipse, small" is the scene of the reference; of the shipped
one, a finer mesh (24 by 3) stops at 98°. The rubber is {MATERIAL}'s hyperelastic law; with linear
elasticity and NLGEOM (St Venant-Kirchhoff) it collapses in compression at the clamp beyond
φ = 93°. Its reference has logarithmic strains."""


def headlines() -> list[str]:
    forces, runs = tables("calculix")
    last = finest(forces)
    rubbing = largest(last[last["mu"] == forces["mu"].max()], ["scene"])
    runs = runs[runs["reached"] == runs["positions"]]
    ratio = runs["fem_s"] / runs["beam_s"]
    said = ", ".join(
        f"{row['scene']} {row['equilibrium_size_%']:.2f} % (recovered rule "
        f"{row['recovered_size_%']:.1f} %)"
        for row in rubbing.to_dict("records")
    )
    return [
        f"At μ = {forces['mu'].max():g} the magnitude of the contact force in sliding equilibrium "
        f"differs from CalculiX's (finest mesh) by at most: {said}.",
        f"A curve takes CalculiX {runs['fem_s'].min():.0f} to {runs['fem_s'].max():.0f} s and "
        f"fastncm {1e3 * runs['beam_s'].min():.1f} to {1e3 * runs['beam_s'].max():.1f} ms: "
        f"{ratio.min():,.0f} to {ratio.max():,.0f} times as fast.",
    ]


if __name__ == "__main__":
    main()
