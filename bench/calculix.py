"""How far from finite elements is the beam, and how much faster?

CalculiX (`ccx`) on decks that `calculix_parts` writes, for both snap-fit scenes at mu = 0, 0.2 and
0.4 and for a rubber finger on an ellipse, with three meshes each; its forces beside the reference
of data/ and beside fastncm's with shear, in sliding equilibrium and by the recovered rule. Times
are those of one core. Without CalculiX on the PATH nothing is run and the tables stay as they are.
"""

import math
import time

import numpy as np
import pandas as pd
from calculix_parts import pictures
from calculix_parts.cases import MATERIAL, SMALL, Case, all_cases
from calculix_parts.runs import available, run
from support import markdown_table, read_table, write_table

import fastncm

LIMIT = 600.0
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
    forces, runs = [], []
    for case in all_cases():
        rows, figures = solved(case)
        forces.append(rows)
        runs.append(figures)
        print(", ".join(f"{name} {figure}" for name, figure in figures.items()), flush=True)
    settings = {"limit_s": LIMIT, "batch": BATCH, "material_of_the_rubber": MATERIAL}
    write_table("calculix_forces", pd.concat(forces, ignore_index=True), **settings)
    write_table("calculix_runs", pd.DataFrame(runs), **settings)
    pictures.draw(*tables())
    print(section())


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
        "finger_elements": len(model.parts["FINGER"]),
        "elements": sum(len(elements) for elements in model.parts.values()),
        "positions": len(positions),
        "reached": int(np.isfinite(found[:, 0]).sum()),
        "fem_s": sum(each.seconds for each in done),
        "fem_wall_s": sum(each.wall for each in done),
        "increments": sum(each.increments for each in done),
        "iterations": sum(each.iterations for each in done),
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


if __name__ == "__main__":
    main()
