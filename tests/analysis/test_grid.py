"""Means over seeds of the settings of `dust trade --grid`, and what is suggested of them."""

import pandas as pd
import pytest

from dusttaichi.analysis.grid import CURVE, outcomes, read
from dusttaichi.errors import DustError


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
    assert found["as it is", CURVE].error == 0.0


def test_seeds_that_did_not_end_are_left_out():
    """Steps and values are compared with those of the same seeds."""
    found = outcomes(pd.DataFrame(TABLE))
    faster = {o.observable: o for o in found if o.settings == "faster"}["ratio"]
    assert faster.cost == pytest.approx(0.2) and faster.seeds == 1
    assert faster.error == pytest.approx(0.5)  # 1.5 against 1.0 of seed 0
    assert faster.scatter == pytest.approx(2**-0.5 / 1.0)
    refused = [r | {"status": "too soft"} for r in TABLE if r["settings"] == "softer"]
    found = outcomes(pd.DataFrame([*TABLE[:2], *refused]))
    assert found[-1].refused == "too soft" and found[-1].seeds == 0


def test_another_table_is_refused(tmp_path):
    (tmp_path / "a.csv").write_text("a,b\n1,2\n")
    with pytest.raises(DustError, match="no table of dust trade --grid"):
        read(tmp_path / "a.csv")
