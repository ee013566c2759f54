"""Snapshots that a scene leaves to the run."""

import pytest
import spring
import toy
import xarray as xr

from dusttaichi import method
from dusttaichi.domain.clock import NEVER, Clock
from dusttaichi.run import execute, schedule
from dusttaichi.scene import from_yaml
from dusttaichi.scene.boundary import Drive
from dusttaichi.scene.stage import StagePlan
from dusttaichi.scene.stop import Stop


def plan(snapshots="auto", **stop):
    return StagePlan("", Drive(), Stop(**stop), None, None, snapshots)


def test_some_thirty_within_a_size():
    one, clock = plan(steps=3000), Clock(dt=1e-4)
    assert schedule.steps_apart([one], clock, one, 1000) == 100
    # of two stages fifteen each; a stage with an interval of its own has no share
    assert schedule.steps_apart([one, one], clock, one, 1000) == 200
    assert schedule.steps_apart([one, plan(None, steps=5)], clock, one, 1000) == 100
    # ten fit into the size, and of what is larger than half of it none
    assert schedule.steps_apart([one], clock, one, schedule.LARGEST / 10) == 300
    assert schedule.steps_apart([one], clock, one, 0.6 * schedule.LARGEST) == 0


def test_where_the_end_is_not_known_they_follow_the_strain():
    one = plan(pressure="1 kPa")
    assert schedule.steps_apart([one], Clock(dt=1e-4), one, 1000) == 0  # nothing moves
    grows = Clock(dt=1.0, start=(1.0, 1.0, 1.0), rate=(0.0, 0.0, 1e-3), volume=0.1)
    assert grows.last_step(one.stop)[0] == NEVER
    assert schedule.steps_apart([one], grows, one, 1000) == pytest.approx(1000 / 30, abs=1)


def test_a_run_keeps_them(tmp_path, toys):
    """Evenly, from the first to the last; the same bits when it is interrupted and resumed are a
    matter of the state, which has the interval."""
    method.register(spring.METHOD)
    text = toy.plain(steps=600, snapshots=250).replace("snapshots: {steps: 250}", "snapshots: auto")
    execute(from_yaml(text), tmp_path / "run")
    with xr.open_datatree(tmp_path / "run/result.nc") as tree:
        assert tree["snapshots"].step.values.tolist() == list(range(0, 601, 20))
