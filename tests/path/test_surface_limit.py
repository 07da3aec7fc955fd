"""The critical friction of a finger in direct contact, in what its rows say.

A thin finger leans towards a wall that comes along its normal: the tip touches first, and friction
points down the wall. The force turns the finger out of the way as long as it passes the clamp on
the right side, which it does with ``mu < tan(beta)``, beta the angle between the finger and the
wall's normal; with more the finger is a strut that locks.
"""

import math
import re

import numpy as np
import pandas as pd
import pytest
from surfaces import PLANE, RUBBER

import fastncm

pytestmark = pytest.mark.compiled
SUPPORT = RUBBER.finger.offset + RUBBER.finger.length
STRUT = PLANE | {"model.surface": "axis", "model.shear": False, "finger.thickness": 0.01}
CRITICAL = re.compile(r"friction\.mu up to (\d+\.\d{7})")
ENDS = re.compile(r"The branch ends at (\S+) m")


def strut(lean: float, mu: float) -> fastncm.Scene:
    """The finger at the angle `lean`, and a wall from 10 mm before it to 15 mm behind."""
    touch = SUPPORT * math.cos(lean)
    way = {"path.start": touch + 0.01, "path.stop": touch - 0.015, "path.steps": 20}
    return RUBBER.replace(STRUT | way | {"path.angle": lean, "friction.mu": mu})


@pytest.mark.parametrize("more", [1.05, 3.0])
@pytest.mark.parametrize("lean", [0.9, 1.0, 1.1, 1.2, 1.3])
def test_a_strut_locks(lean: float, more: float) -> None:
    """The first row behind first touch names the critical friction and the place."""
    frame = fastncm.solve(strut(lean, more * math.tan(lean))).frame()
    first = int(np.flatnonzero(frame["status"] != "no_contact")[0])
    assert frame["status"][first] == "no_equilibrium"
    said = frame["advice"][first]
    assert frame["position"][first - 1] > SUPPORT * math.cos(lean) > frame["position"][first]
    critical = float(CRITICAL.findall(said)[0])
    assert critical == pytest.approx(math.tan(lean), rel=1e-6)
    ends = float(ENDS.findall(said)[0])
    assert ends == pytest.approx(SUPPORT * math.cos(lean), abs=2e-6 * RUBBER.finger.length)
    assert not frame["advice"][:first].str.contains("friction.mu").any()
    table = fastncm.solve_cases(
        strut(lean, more * math.tan(lean)), pd.DataFrame({"finger.young": [1e6, 2e6]})
    )
    assert (table["status"] == "no_equilibrium").all()
    for advice in table["advice"]:
        assert float(CRITICAL.findall(advice)[0]) == pytest.approx(critical, rel=1e-6)


def test_below_the_critical_friction_the_finger_slides_on() -> None:
    """Solved anew, with a little less and a little more."""
    less, more = (fastncm.solve(strut(1.3, math.tan(1.3) * (1.0 + off))) for off in (-2e-6, 2e-6))
    assert set(less.frame()["advice"]) == {"", fastncm.solve(strut(1.3, 0.1)).frame()["advice"][0]}
    assert (less.frame()["sticking"] == 0).all()
    assert more.frame()["advice"].str.contains("friction locks").sum() == 1
