"""Restitution of bodies that meet, and of grains on a wall, against given velocities."""

import numpy as np
import pytest
from snapshots import open_snapshots

from dusttaichi import analysis, plots
from dusttaichi.analysis.fragments import weigh_fragments
from dusttaichi.analysis.outcome import classify_outcome
from dusttaichi.errors import DustError

R = 0.6e-6
NAN = float("nan")


def collision(tmp_path, final_velocities, pairs_after, offset=0.0, **options):
    """Two dimers that meet along x at 3 + 1 m/s, and part with `final_velocities`."""
    half = np.array([[0.0, -R, 0.0], [0.0, R, 0.0]])
    v = np.repeat([[3.0, 0.5, 0.0], [-1.0, 0.5, 0.0]], 2, axis=0)
    frames = []
    for n in range(-10, 11):
        gap = 2 * R + 4.0 * 1e-7 * abs(n)
        x = np.concatenate([half + [-gap / 2, 0, 0], half + [gap / 2, offset, 0]])
        frames.append(
            {
                "position": x,
                "velocity": v if n <= 0 else np.repeat(final_velocities, 2, axis=0),
                "pairs": pairs_after if n > 0 else [[0, 1], [2, 3]],
            }
        )
    return open_snapshots(tmp_path, frames, **options)


@pytest.mark.parametrize(
    "final_velocities, offset, approach_speed, back",
    [
        ([[0.0, 0.5, 0.0], [2.0, 0.5, 0.0]], 0.0, 4.0, 2.0),
        # beside each other by 2r, so the normal is at 45 degrees; a sliding motion does not count
        ([[1.0, -1.5, 0.3], [1.0, 2.5, 0.0]], 2 * R, 8**0.5, 8**0.5),
    ],
)
def test_restitution_of_two_aggregates(tmp_path, final_velocities, offset, approach_speed, back):
    with collision(tmp_path, final_velocities, [[0, 1], [2, 3]], offset) as run:
        result = analysis.measure_restitution(run)
        assert not result.sticks
        # floats as they were put in
        speeds = result.approach_speed, result.separation_speed
        assert speeds == (pytest.approx(approach_speed), pytest.approx(back))
        assert result.coefficient == pytest.approx(back / approach_speed)
        if not offset:
            np.testing.assert_allclose(np.abs(result.normal), [1.0, 0.0, 0.0], atol=1e-12)
        with pytest.raises(DustError, match="do not approach"):
            analysis.measure_restitution(run, first=15)


def test_bodies_that_have_not_touched_have_no_restitution(tmp_path):
    start = [[3.0, 0.5, 0.0], [-1.0, 0.5, 0.0]]
    with collision(tmp_path, start, [[0, 1], [2, 3]], 4 * R) as run:
        with pytest.raises(DustError, match="have not touched"):
            analysis.measure_restitution(run)


def test_sticking(tmp_path):
    final_velocities = [[1.0, 0.5, 0.0]] * 2
    with collision(tmp_path, final_velocities, [[0, 1], [1, 2], [2, 3]]) as run:
        assert (
            analysis.measure_restitution(run).sticks
            and analysis.measure_restitution(run).coefficient == 0.0
        )
        assert analysis.measure_restitution(run, bodies=([0, 1], [2, 3])).sticks


def test_fragments_hold_the_masses_of_their_grains():
    """Dust of the second body on the heavy grain of the first: its heavy grain has bounced."""
    masses = np.array([100.0, 1.0, 1.0, 1.0, 10.0, 1.0])
    bodies, label = ([0, 5], [1, 2, 3, 4]), np.array([0, 0, 0, 0, 1, 0])
    fragments = weigh_fragments(label, masses)
    assert classify_outcome(fragments, masses, bodies) == "mass transfer"
    equal_masses = np.ones(6)
    fragments = weigh_fragments(label, equal_masses)
    assert classify_outcome(fragments, equal_masses, bodies) == "growth"


def test_unequal_bodies_stick_by_the_masses_of_their_grains(tmp_path):
    final_velocities = [[-1.0, 0.5, 0.0], [1.0, 0.5, 0.0]]
    radius = R * np.array([1.0, 0.2, 0.2, 0.6])
    with collision(tmp_path, final_velocities, [[0, 2]], radius=radius) as run:
        result = analysis.measure_restitution(run, bodies=([0, 1], [2, 3]))
        assert not result.sticks and result.coefficient == pytest.approx(0.5)


@pytest.mark.parametrize("wall, axis, sign", [("bottom", 2, 1.0), ("x_max", 0, -1.0)])
def test_restitution_on_a_moving_wall(tmp_path, wall, axis, sign):
    """The wall moves at 0.2 m/s towards the grain, which comes at 1 and leaves at 0.8 m/s."""
    dt, frames = 1e-9, []
    side = {"bottom": 4, "x_max": 1}[wall]
    for n in range(20):
        box = np.full(6, NAN)
        box[side] = sign * 0.2 * n * dt
        v = np.full((1, 3), 0.1)
        v[0, axis] = sign * (-1.0 if n < 10 else 0.8)
        frames.append({"position": np.ones((1, 3)) * 1e-6, "velocity": v, "box": box})
    frames.append(frames[-1] | {"touching": [(0, side)]})
    with open_snapshots(tmp_path, frames, box=np.full(6, NAN), dt=dt) as run:
        result = analysis.measure_wall_restitution(run, wall, last=18)
        speeds = result.approach_speed, result.separation_speed
        assert speeds == (pytest.approx(1.2), pytest.approx(0.6))
        assert result.coefficient == pytest.approx(0.5) and not result.sticks
        assert analysis.measure_wall_restitution(run, wall).sticks
        with pytest.raises(DustError, match=f"have not touched the wall {wall}"):
            analysis.measure_wall_restitution(run, wall, last=5)
        with pytest.raises(DustError, match='no wall "top"'):
            analysis.measure_wall_restitution(run, "top")


def test_restitution_figure_has_the_closed_form():
    speeds = np.array([0.05, 0.2, 1.0])
    figure = plots.restitution(speeds, [0.0, 0.83, 0.99], sticking_speed=0.11)
    closed, points = figure.axes[0].lines
    v, e = closed.get_data()
    np.testing.assert_allclose(e[v >= 0.11], np.sqrt(1 - (0.11 / v[v >= 0.11]) ** 2), atol=1e-12)
    np.testing.assert_allclose(points.get_xdata(), speeds)
