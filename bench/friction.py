"""What does friction in equilibrium cost?

Different jaws x 60 positions of both scenes through `solve_cases`, without friction and with, in
one process and in turn; of each the best of the rounds counts, in CPU time, which does not grow
where others share the machine. The goal is at most 1.5 times the time of a frictionless solve.
"""

import time

import numpy as np
from support import markdown_table, read_json, write_json

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
    write_json(
        "friction",
        {
            "jaws": JAWS,
            "rtol": RTOL,
            "us_per_solve": {f"{name}, mu {mu:g}": s * 1e6 for (name, mu), s in best.items()},
            "ratio": {f"{name}, mu {mu:g}": s / best[name, 0.0] for (name, mu), s in best.items()},
        },
    )
    print(section())


def headlines() -> list[str]:
    ratios = read_json("friction")[0]["ratio"].values()
    return [
        f"Friction in equilibrium takes up to {max(ratios):.2f} times the time of a frictionless "
        "solve."
    ]


def section() -> str:
    figures, where = read_json("friction")
    rows = [
        [case, f"{us:.3g}", f"{figures['ratio'][case]:.3g}"]
        for case, us in figures["us_per_solve"].items()
    ]
    return "\n\n".join(
        [
            "## What friction costs",
            f"`bench/friction.py`, {where}: {figures['jaws']:,} jaws x 60 positions in one call, "
            f"rtol {figures['rtol']:g}, friction in equilibrium.",
            markdown_table(["scene", "µs of CPU time a solve", "over that without friction"], rows),
        ]
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
