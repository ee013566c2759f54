"""JKR: contact radius from the overlap, force and energy, against root finding and calculus."""

import numpy as np
import pytest
from scipy.optimize import brentq

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact import jkr as normal
from dusttaichi.physics.contact.constants import PULL_OFF, S_PULL_OFF

# scaled overlaps from a hair above pull-off to a tenth of the radius and beyond
OVERLAPS = np.concatenate(
    [-PULL_OFF + np.logspace(-9, -1, 30), np.linspace(-0.7, 2.0, 50), np.logspace(0.4, 5, 30)]
)


def solved(d):
    return brentq(
        lambda s: 3 * s**4 - 2 * s - d, S_PULL_OFF, 5.0 + abs(d) ** 0.25, xtol=1e-15, rtol=8.9e-16
    )


def radius_after(steps):
    """The kernel's own s(d) after so many Newton steps, as a function of a NumPy array."""
    ti.init(arch=ti.cpu, default_fp=ti.f64, fast_math=True, log_level=ti.ERROR)
    contact_radius = normal.contact_radius(steps)

    @ti.kernel
    def evaluate(d: ti.types.ndarray(ti.f64, 1), s: ti.types.ndarray(ti.f64, 1)):
        for k in d:
            s[k] = contact_radius(d[k])

    def of(d):
        d = np.atleast_1d(np.asarray(d, float))
        s = np.empty_like(d)
        evaluate(d, s)
        return s

    return of


@pytest.fixture(scope="module")
def radius():
    return radius_after(2)


def test_contact_radius(radius):
    """A Newton step squares the error of the start, 8e-5 -> 1e-8 -> 1e-13 (as normal.py states).

    Close to pull-off ds/dd ~ 1/sqrt(d + PULL_OFF) magnifies rounding of d, for brentq as for
    Newton, and within 1e-7 of it the slope is held back: what is left is the start's t^2.
    """
    exact = np.array([solved(d) for d in OVERLAPS])
    depth = OVERLAPS + PULL_OFF
    allowed = 1e-13 + 4e-16 / np.sqrt(depth) + np.where(depth < 1e-6, depth, 0.0)
    assert np.all(np.abs(radius(OVERLAPS) / exact - 1) < allowed)


@pytest.mark.parametrize("steps, least, most", [(0, 1e-7, 1e-3), (1, 1e-13, 1e-7), (2, 0, 1e-12)])
def test_fewer_newton_steps_are_less_exact(steps, least, most):
    """The fit alone is 8e-5 off in s, and forces 6 s^5 - 3 s^2 = 3 times that of 4 F_c at rest; one
    Newton step squares it to below 1e-7. From touch to four times the overlap at rest."""
    overlaps = np.linspace(0.0, 4.0, 200)
    exact = np.array([solved(d) for d in overlaps])
    found = normal.force(radius_after(steps)(overlaps))
    worst = np.abs(found - normal.force(exact)).max()
    assert least <= worst < most


def test_far_apart_is_a_number(radius):
    """Empty lanes are 1e9 um and more apart; zero times their energy must be zero."""
    energy = normal.energy(radius(-np.logspace(0, 14, 15)))
    assert np.all(np.isfinite(energy)) and np.all(0.0 * energy == 0.0)


def test_start_value_holds_its_promise():
    """8e-5 on s is what normal.py states."""
    exact = np.array([solved(d) for d in OVERLAPS])
    assert np.max(np.abs(np.sqrt(normal.start(np.sqrt(OVERLAPS + PULL_OFF))) / exact - 1)) < 8.5e-5


def test_force_is_the_derivative_of_the_energy():
    """dU/ddelta by a complex step through s(delta): no cancellation, so rounding only."""
    for d in OVERLAPS[OVERLAPS > -PULL_OFF + 1e-3]:
        s = solved(d)
        ds = 1e-30 / (12 * s**3 - 2)  # implicit derivative of 3 s^4 - 2 s = d
        slope = normal.energy(s + 1j * ds).imag / 1e-30
        # U/(4 F_c delta0) over d gives F/(4 F_c), up to rounding of the terms that cancel
        assert slope == pytest.approx(normal.force(s), rel=1e-12, abs=1e-13)


def test_values_on_the_branch():
    assert 4 * normal.force(S_PULL_OFF) == pytest.approx(-5 / 9, rel=1e-14)
    assert 4 * normal.force((2 / 3) ** (1 / 3)) == pytest.approx(-8 / 9, rel=1e-14)
    assert normal.force(1.0) == 0.0
    smallest = min(4 * normal.force(np.linspace(S_PULL_OFF, 1, 10001)))
    assert smallest == pytest.approx(-1.0, rel=1e-8)  # -F_c; the grid misses s^3 = 1/2 by 3e-5
    assert normal.energy(0.0) == 0.0
