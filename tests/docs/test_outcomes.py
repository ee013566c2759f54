"""Means over seeds of settings, as the page of the trade has them (docs/outcomes.py)."""

import math
import runpy
from pathlib import Path

import pandas as pd
import pytest

NAMES = runpy.run_path(str(Path(__file__).parents[2] / "docs/outcomes.py"))
CURVE = NAMES["CURVE"]


def outcomes(table):
    return list(NAMES["outcomes"](table).itertuples())


def row(settings, seed, steps, **values):
    common = {"scene": "omni", "grains": 400, "status": "finished: pressure 100 kPa"}
    return common | {"settings": settings, "seed": seed, "steps": steps} | values


def phi(*values):
    return dict(zip(("phi at 1 kPa", "phi at 3 kPa"), values, strict=True))


TABLE = [
    row("as it is", 0, 100, **phi(0.2, 0.3), ratio=1.0),
    row("as it is", 1, 300, **phi(0.2, 0.5), ratio=2.0),
    row("softer", 0, 20, **phi(0.2, 0.4), ratio=1.0),
    row("softer", 1, 60, **phi(0.4, 0.4), ratio=2.5),
    row("faster", 0, 20, **phi(0.3, 0.4), ratio=1.5),
]


def test_errors_are_those_of_means():
    """By hand: means of `as it is` 0.2 and 0.4, of `softer` 0.3 and 0.4."""
    found = {(o.settings, o.observable): o for o in outcomes(pd.DataFrame(TABLE))}
    curve = found["softer", CURVE]
    assert curve.cost == pytest.approx(0.2) and curve.seeds == 2
    assert curve.error == pytest.approx((0.1**2 / 2) ** 0.5 / 0.3)
    # of the seeds of `as it is`: 0 and 0.2/sqrt(2)
    assert curve.scatter == pytest.approx((0.2**2 / 2 / 2) ** 0.5 / 0.3)
    assert curve.hidden
    ratio = found["softer", "ratio"]
    assert (ratio.error, ratio.value) == (pytest.approx(0.25 / 1.5), pytest.approx(1.75))
    # differences of the same seeds: of the curve 0 and 0.2, 0.1 and -0.1; of the ratio 0 and 0.5
    assert curve.shift == pytest.approx(0.05 / 0.3) and ratio.shift == pytest.approx(0.25 / 1.5)
    assert curve.uncertainty == pytest.approx(0.1 / 0.3)
    assert ratio.uncertainty == pytest.approx(0.25 / 1.5) and not ratio.resolved
    assert found["as it is", CURVE].error == 0.0


def test_a_pressure_that_one_seed_of_many_misses_counts():
    """At 3 kPa the pairs 0 and 1 differ by 0.1; at half of the pairs a pressure is left out."""
    nan = math.nan
    table = [row("as it is", n, 100, **phi(0.2, 0.4 if n < 2 else nan)) for n in range(3)]
    table += [row("softer", n, 20, **phi(0.2, 0.3)) for n in range(3)]
    found = outcomes(pd.DataFrame(table))[-1]
    assert found.seeds == 3 and found.uncertainty == pytest.approx(0.0, abs=1e-9)
    assert found.value == pytest.approx(0.25) and found.shift == pytest.approx(-0.05 / 0.3)
    table[4] |= phi(0.2, nan)
    assert outcomes(pd.DataFrame(table))[-1].error == 0.0


def test_seeds_that_did_not_end_are_left_out():
    """Steps and values are compared with those of the same seeds."""
    found = outcomes(pd.DataFrame(TABLE))
    faster = {o.observable: o for o in found if o.settings == "faster"}["ratio"]
    assert faster.cost == pytest.approx(0.2) and faster.seeds == 1
    assert faster.error == pytest.approx(0.5)  # 1.5 against 1.0 of seed 0
    assert math.isnan(faster.uncertainty) and not faster.resolved  # a single difference
    assert faster.scatter == pytest.approx(2**-0.5 / 1.0)
    refused = [r | {"status": "too soft"} for r in TABLE if r["settings"] == "softer"]
    found = outcomes(pd.DataFrame([*TABLE[:2], *refused]))
    assert found[-1].refused == "too soft" and found[-1].seeds == 0


def test_seeds_that_differ_alike_are_a_resolved_shift():
    """The differences 0.11 and 0.09 have a standard error of 0.01, the seeds scatter by 0.7."""
    table = [*TABLE[:2], row("alike", 0, 9, ratio=1.11), row("alike", 1, 9, ratio=2.09)]
    alike = outcomes(pd.DataFrame(table))[-1]
    assert (alike.settings, alike.observable) == ("alike", "ratio")
    assert alike.uncertainty == pytest.approx(0.01 / 1.5)
    assert alike.resolved and alike.hidden


def test_pressures_that_a_seed_does_not_reach_are_left_out():
    low = row("low", 0, 20, **phi(0.2, 0.3)), row("low", 1, 20, **phi(0.3, math.nan))
    found = outcomes(pd.DataFrame([*TABLE[:2], *low]))[-1]
    assert found.observable == CURVE and found.value == pytest.approx(0.25)
    assert found.error == pytest.approx(0.05 / 0.2)
