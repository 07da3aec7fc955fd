"""What does friction in equilibrium cost?

Different jaws x 60 positions of both scenes through `solve_cases`, without friction and with, in
one process and in turn; of each the best of the rounds counts, in CPU time, which does not grow
where others share the machine. The goal is at most 1.5 times the time of a frictionless solve.
"""

import time

import numpy as np
from support import print_table, write_json

import fastncm
from fastncm.cases import solve_chunk

SCENES = {"snapfit-circle": (0.0069, 0.0109), "snapfit-corner": (0.0055, 0.0085)}
"""Each with the range of its jaws' heights (m)."""
MU = 0.0, 0.2, 0.4
JAWS = 4_000
ROUNDS = 6
RTOL = 1e-8


def main() -> None:
    best: dict[tuple[str, float], float] = {}
    for _ in range(ROUNDS + 1):  # the first one compiles
        for name in SCENES:
            for mu in MU:
                seconds = timed(name, mu)
                best[name, mu] = min(best.get((name, mu), np.inf), seconds)
    rows = [
        [name, f"{mu:g}", f"{seconds * 1e6:.3g}", f"{seconds / best[name, 0.0]:.3g}"]
        for (name, mu), seconds in best.items()
    ]
    print_table(["scene", "μ", "µs of CPU time a solve", "ratio"], rows)
    write_json(
        "friction",
        {
            "jaws": JAWS,
            "rtol": RTOL,
            "us_per_solve": {f"{name}, mu {mu:g}": s * 1e6 for (name, mu), s in best.items()},
            "ratio": {f"{name}, mu {mu:g}": s / best[name, 0.0] for (name, mu), s in best.items()},
        },
    )


def timed(name: str, mu: float) -> float:
    """CPU seconds per shape solved."""
    scene = fastncm.load_scene(name).replace({"friction.mu": mu, "solver.rtol": RTOL})
    heights = {"jaw.height": np.linspace(*SCENES[name], JAWS)}
    begin = time.process_time()
    solves = solve_chunk(scene, heights).solves
    return (time.process_time() - begin) / solves


if __name__ == "__main__":
    main()
