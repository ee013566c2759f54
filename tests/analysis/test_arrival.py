"""Arrival of a signal, and the speed of sound, against waves of a known speed."""

import numpy as np
import pytest
from snapshots import open_snapshots

from dusttaichi import analysis, plots
from dusttaichi.errors import DustError

R = 0.6e-6
NAN = float("nan")


def wave(tmp_path, speed, push=1e-9, walls=None):
    """Grains on a line that a straight ramp passes at `speed`, 2 ns long; grain 0 is pushed."""
    dt, count = 0.5e-9, 40
    x = np.zeros((count, 3))
    x[:, 0] = np.arange(count) * 2 * R
    box = [NAN] * 6
    frames = []
    for n in range(400):
        moved = np.clip((n * dt - x[:, 0] / speed) / 2e-9, 0.0, 1.0) * push
        here = [-R + moved[0], NAN, NAN, NAN, NAN, NAN]
        frames.append({"position": x + moved[:, None] * [0.6, 0.8, 0.0], "box": here})
    return open_snapshots(tmp_path, frames, dt=dt, box=walls and box)


@pytest.mark.parametrize("speed", [pytest.param(300.0, marks=pytest.mark.long), 513.8])
@pytest.mark.parametrize("threshold", [{"fraction": 0.25}, {"threshold": 0.4e-9}])
def test_sound_speed_of_a_wave(tmp_path, speed, threshold):
    with wave(tmp_path, speed) as run:
        arrivals = analysis.measure_arrival(run, 0, **threshold)
        fraction = threshold.get("fraction", 0.4)
        assert arrivals.push == pytest.approx(1e-9) and arrivals.threshold == pytest.approx(
            fraction * 1e-9
        )
        # the ramp is straight from its start to the snapshot after the crossing, so that the
        # interpolation is exact: rounding of displacements, 1e-20 m of 1e-9 m, remains
        expected = arrivals.distance / speed + fraction * 2e-9
        assert not np.isnan(arrivals.time).any()
        np.testing.assert_allclose(arrivals.time, expected, rtol=0, atol=1e-9 * 2e-9)
        fit = analysis.fit_sound_speed(arrivals)
        assert fit.speed == pytest.approx(speed, rel=1e-8)
        assert fit.delay == pytest.approx(fraction * 2e-9, rel=1e-6) and fit.grains == 39
        np.testing.assert_allclose(
            arrivals.speed[1:], arrivals.distance[1:] / expected[1:], rtol=1e-6
        )
        assert np.isnan(arrivals.speed[0])
        run.attrs["sample"] = "{push: [{grains: [0], size: 1.0e-9}]}"
        (axes,) = plots.sound_speed(run).axes
        assert "m/s" in axes.get_ylabel() and len(axes.lines[0].get_xdata()) == 40


def test_a_push_of_grains_of_several_materials_needs_a_length(tmp_path):
    with wave(tmp_path, 400.0) as run:
        run.attrs["sample"] = "{push: [{grains: [0], kind: speed}]}"
        run.attrs["scene_resolved"] = "materials: {ice: {}, dust: {}}"
        with pytest.raises(DustError, match="not one material .*allowed: push"):
            analysis.measure_arrival(run)
        assert analysis.measure_arrival(run, push=1e-9).push == 1e-9


def test_error_of_the_sound_speed():
    """200 fits of noisy arrivals: the stated error is that of the scatter of the fits."""
    rng, distance = np.random.default_rng(6), np.linspace(1e-6, 3e-5, 60)
    pulls = []
    for _ in range(200):
        time = 2e-9 + distance / 30.0 + 2e-8 * rng.normal(size=60)
        fit = analysis.fit_sound_speed(analysis.Arrival(time, distance, 1e-10, 1e-9), beyond=2e-6)
        pulls.append((fit.speed - 30.0) / fit.sigma)
    # 1 and 0 are expected; the scatter of 200 numbers is known to 5 %, their mean to 0.07
    assert 0.8 < np.std(pulls) < 1.2 and abs(np.mean(pulls)) < 0.3


def test_a_wall_that_pushes(tmp_path):
    with wave(tmp_path, 400.0, walls=True) as run:
        arrivals = analysis.measure_arrival(run, "x_min", fraction=0.5)
        assert arrivals.push == pytest.approx(1e-9)
        np.testing.assert_allclose(arrivals.distance, (np.arange(40) * 2 + 1) * R)
        assert analysis.fit_sound_speed(arrivals).speed == pytest.approx(400.0, rel=0.01)
        with pytest.raises(DustError, match='no wall "top"; allowed: x_min'):
            analysis.measure_arrival(run, "top")
        with pytest.raises(DustError, match="no grain 40; allowed: 0 to 39"):
            analysis.measure_arrival(run, 40)
    with open_snapshots(tmp_path / "still", [{"position": np.eye(3) * 1e-5}] * 3) as run:
        with pytest.raises(DustError, match="is not displaced"):
            analysis.measure_arrival(run, 0)
        arrivals = analysis.measure_arrival(run, 0, threshold=1e-10)
        assert np.isnan(arrivals.time).all()
        with pytest.raises(DustError, match="reached 0 grains"):
            analysis.fit_sound_speed(arrivals)
