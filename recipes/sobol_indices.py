"""Which tolerances decide the peak insertion force? Sobol' indices with SALib.

    python recipes/sobol_indices.py results/indices

SALib draws the samples, fastncm solves them like any other table of cases (and goes on where it was
interrupted), SALib works out the indices: `S1`, the share of the variance that an input has alone,
and `ST`, the share that it has with all its interactions. Any sampler does: OpenMDAO, Optuna, a
spreadsheet. Only the columns must bear dotted names.
"""

import sys

import pandas as pd
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

import fastncm

PROBLEM = {
    "num_vars": 4,
    "names": ["finger.thickness", "finger.young", "jaw.height", "friction.mu"],
    "bounds": [[0.0031, 0.0033], [2.4e9, 2.8e9], [0.0085, 0.0093], [0.15, 0.25]],
}
SAMPLES = 1024
SEED = 1


def indices(problem: dict, out: str, samples: int = SAMPLES) -> pd.DataFrame:
    """First-order and total indices of the peak force, one row per input."""
    values = sampling.sample(problem, samples, calc_second_order=False, seed=SEED)
    cases = pd.DataFrame(values, columns=problem["names"])
    fastncm.sweep(fastncm.Study(fastncm.load_scene("snapfit-circle"), cases), out)
    force = fastncm.load(out)["peak_force_N"].to_numpy()
    result = analysis.analyze(problem, force, calc_second_order=False, seed=SEED)
    columns = {name: result[name] for name in ("S1", "S1_conf", "ST", "ST_conf")}
    return pd.DataFrame(columns, index=problem["names"])


if __name__ == "__main__":
    print(indices(PROBLEM, sys.argv[1]).round(4).to_string())
