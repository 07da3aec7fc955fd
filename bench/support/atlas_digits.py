"""The atlas's judge, shooting in double precision, against the same in 34 digits."""

import importlib.util

import extremes
import numpy as np
import pandas as pd
import shooting_many

from support import atlas_runs, atlas_truth

SCENES = 100
"""From which those with one sliding contact are taken."""


def compare(kind: str, count: int) -> pd.DataFrame:
    """Of the first `count` scenes of a kind that end on one sliding contact that shooting closes:
    off, by how much its normal force is wrong (relative), the rounding that it admits, and the
    error and the estimate of the package's answer."""
    if importlib.util.find_spec("mpmath") is None:
        return pd.DataFrame()
    from shooting_digits import normal_force

    last = atlas_runs.last_rows(atlas_runs.chosen(kind, np.arange(SCENES)))
    shot = atlas_truth.shoot(kind, 0, last)
    rows = []
    for at in shot.index[shot["found"]][:count]:
        one = shot.loc[[at]]
        case = one["index"].to_numpy()
        columns = extremes.jaw_block(kind, 0)
        unit = float(shooting_many.force_unit(columns, case)[0])
        fingers = shooting_many.fingers(columns, case, one["position"].to_numpy())
        claim, mu = atlas_truth.claim_of(one, columns, case), float(one["friction.mu"].iat[0])
        truth = shooting_many.exact(fingers, claim, np.array([mu]))
        digits = normal_force(fingers, claim, mu)
        if digits is None:
            continue
        rows.append(
            {
                "kind": kind,
                "index": int(case[0]),
                "off": abs(float(truth.normal[0] / digits - 1)),
                "rounding": float(truth.rounding[0] / truth.normal[0]),
                "error": abs(float(one["normal_force_N"].iat[0] / unit / digits - 1)),
                "error_estimate": float(one["error_estimate"].iat[0]),
            }
        )
    return pd.DataFrame(rows)
