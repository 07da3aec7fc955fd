"""The equilibria to 34 digits: a cantilever's exact solution, and shooting in double precision."""

import numpy as np
import pytest
import shooting_many

pytest.importorskip("mpmath")
import shooting_digits  # noqa: E402

FORCE = 3.0
"""EI/L^2, across the tip: the finger bends by more than a radian."""


def one(ratio: float = 1.0, shear: float = np.inf) -> shooting_many.Fingers:
    """A straight jaw at 25 degrees below a circle."""
    size, lead = 0.33, np.radians(25.0)
    a = np.array([[0.0, 0.184]])
    return shooting_many.Fingers(
        a=a,
        b=a + size * np.array([[np.cos(lead), -np.sin(lead)]]),
        half=np.zeros(1),
        back=np.full(1, 0.5 * np.pi),
        ratio=np.full(1, ratio),
        shear=np.full(1, shear),
        radius=np.full(1, 0.156),
        length=np.zeros(1),
        at=np.array([[1.18, 0.184]]),
    )


def test_a_cantilever_s_exact_solution() -> None:
    """With a force F across the tip, psi'^2 = -2 F sin(psi), seen from the tip section; so the
    length is the integral of dpsi/psi' from the clamp's psi to 0, here with psi = -t^2."""
    mpmath = pytest.importorskip("mpmath")
    mp = mpmath.MPContext()
    mp.dps = 42
    finger = shooting_digits.Finger(mp, one(), 0, 0, 0.0)
    psi = finger.integrated([mp.mpf(0), mp.mpf(0)], [mp.mpf(0), mp.mpf(FORCE)])[2]
    end = mp.sqrt(-psi)
    length = mp.quad(lambda t: 2 * t / mp.sqrt(2 * FORCE * mp.sin(t * t)), [0, end / 2, end])
    assert psi < -1
    assert abs(length - 1) < mp.mpf(10) ** -29


@pytest.mark.parametrize(
    ("changes", "mu"), [({}, 0.0), ({"ratio": 0.3}, 0.3), ({"shear": 40.0}, 0.3)], ids=str
)
def test_shooting_in_double_precision(changes: dict[str, float], mu: float) -> None:
    fingers = one(**changes)
    start = shooting_many.Claim(
        -0.2 * np.array([[np.sin(0.44), np.cos(0.44)]]),
        np.array([[1.12, 0.14]]),
        np.array([[1.0, -0.02, -0.03]]),
    )
    truth = shooting_many.exact(fingers, start, np.zeros(1))
    assert truth.found.all()
    if mu:
        outward = -truth.force / truth.normal[:, None]
        tangent = np.column_stack([-outward[:, 1], outward[:, 0]])
        pushed = truth.force - mu * truth.normal[:, None] * tangent
        truth = shooting_many.exact(
            fingers, shooting_many.Claim(pushed, truth.contact, truth.pose), np.array([mu])
        )
        assert truth.found.all()
    claim = shooting_many.Claim(truth.force, truth.contact, truth.pose)
    digits = shooting_digits.normal_force(fingers, claim, mu)
    assert digits is not None
    assert abs(float(truth.normal[0] / digits - 1)) < 1e-11
