"""A wall that outruns the cake: plateau, front, fits, on a snow plough whose answer is known."""

import numpy as np
import pytest
import synthetic
import xarray as xr
import yaml

from dusttaichi import analysis
from dusttaichi.analysis import dynamic as fast
from dusttaichi.analysis.numbers.compression import FAST
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import S12_STATIC, dynamic_law
from dusttaichi.scene.material import NAMED

PHI0, LAYER, HEIGHT, SPEED = 0.15, 0.55, 40e-6, 5.0
FRONT = SPEED / (1.0 - PHI0 / LAYER)  # balance of mass
DENSITY = 2650.0
MOMENTUM = DENSITY * PHI0 * FRONT * SPEED


def plough(speed=SPEED, points=400, bins=40, kind="box"):
    """A Run pressed at `speed`: a layer of LAYER grows below the wall until it meets the bottom."""
    time = np.linspace(0.0, HEIGHT * (1 - PHI0 / 0.56) / speed, points)
    height = HEIGHT - speed * time
    phi = PHI0 * HEIGHT / height
    pressure = np.where(phi < 0.53, MOMENTUM * (speed / SPEED) ** 2, 1e6)
    pressure = pressure * 10 ** (0.02 * np.random.default_rng(1).standard_normal(points))
    edges = np.linspace(0.0, HEIGHT, bins + 1)
    lower, upper = edges[:-1], edges[1:]
    shown = np.arange(0, points, 10)
    rows = []
    for number in shown:
        top, front = height[number], HEIGHT - FRONT * time[number] * speed / SPEED
        below = np.clip(np.minimum(upper, front) - lower, 0.0, None)
        layer = np.clip(np.minimum(upper, top) - np.maximum(lower, front), 0.0, None)
        inside = np.clip(np.minimum(upper, top) - lower, 1e-30, None)
        rows.append((PHI0 * below + LAYER * layer) / inside)
    profiles = xr.Dataset(
        {
            "filling_factor": (("profile", "bin"), np.array(rows)),
            "height": ("profile", height[shown]),
            "box_filling_factor": ("profile", phi[shown]),
            "bin_lower": ("bin", lower),
            "bin_upper": ("bin", upper),
        },
        {"profile_time": ("profile", time[shown]), "bin_height": ("bin", 0.5 * (lower + upper))},
    )
    series = {"filling_factor": phi, "height": height, "pressure": pressure}
    return synthetic.made(time, yaml.safe_dump(scene(kind)), profiles=profiles, **series)


def scene(kind):
    return {"boundary": {"kind": kind}, "material": {"name": "s", **NAMED["silicate_s12"]}}


def test_plateau_front_and_layer():
    found = fast.dynamic(plough())
    assert found.speed == pytest.approx(SPEED)
    # within its own standard error; the scatter put in is 0.02 dex of some 200 records
    assert abs(found.plateau - MOMENTUM) < 4 * found.plateau_sigma < 0.02 * MOMENTUM
    # a bin of 1 um lies across the front, which moves by 20 um on the plateau
    assert found.front == pytest.approx(FRONT, rel=0.02)
    assert found.layer == pytest.approx(LAYER, abs=0.02)
    # this layer is a little less dense than phi2 = 0.58
    closed = DENSITY * PHI0 * SPEED**2 / (1 - PHI0 / 0.58)
    assert found.momentum == pytest.approx(closed, rel=1e-6)


def test_fits_depend_on_range_and_weights():
    """A fit that ends before the closing rise finds the law, the rise draws it up, and more so
    where every decade of pressure weighs alike: it spans most of them."""
    law = dynamic_law(SPEED)
    phi = np.linspace(0.16, 0.56, 400)
    closing = 10 ** np.clip((phi - 0.45) / 0.05, 0.0, None)  # a decade each 0.05
    run = synthetic.made(filling_factor=phi, pressure=law.pressure(phi) * closing)
    curve = analysis.compression_curve(run)
    early = analysis.fit_compression(curve, phi_high=0.4)
    assert early.p_m == pytest.approx(law.p_m, rel=1e-2)
    assert early.delta == pytest.approx(law.delta, rel=2e-2)
    whole = analysis.fit_compression(curve)
    assert whole.delta > 1.2 * early.delta
    decades = analysis.fit_compression(curve, weights="decades")
    assert decades.delta > 1.2 * whole.delta


def test_a_plateau_alone_fixes_no_law():
    """One pressure at every filling factor has no width in lg P."""
    assert fast.dynamic(plough()).fits["plateau", "bins"] is None


def test_the_law_beside_is_that_of_the_speed():
    assert analysis.compression_law(plough()).name == dynamic_law(SPEED).name
    slow = plough(speed=0.05)
    assert analysis.compression_law(slow) is S12_STATIC
    with pytest.raises(DustError, match="no dynamic compression"):
        fast.dynamic(slow)


def test_what_is_not_a_fast_wall_has_no_such_numbers():
    assert not fast.is_dynamic(plough(kind="plates"))
    halting = plough()
    halting.series["height"] = halting.series.height[0] - 0.5 * (
        halting.series.height[0] - halting.series.height
    ) * (1 + (halting.series.time > halting.series.time[200]))
    assert np.isnan(fast.wall_speed(halting)) and not fast.is_dynamic(halting)


def test_rows_of_the_summary():
    numbers, failed = FAST.of(plough())
    shown = [row for number in FAST.numbers for row in number.table_rows(numbers)]
    assert not failed and [what for what, *_ in shown][-2:] == [
        "plateau of the pressure, phi 0.2-0.4",
        "compaction front",
    ]
    assert "behind it" in shown[-1][1]


def test_columns_of_a_comparison(tmp_path):
    """A run from a file, so that all that `compare` asks for is there; it is not fast."""
    slow = analysis.open_run(synthetic.compression_run(tmp_path / "result.nc"))
    assert "front_speed" not in analysis.compare([slow])[0]
