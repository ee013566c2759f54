"""The CPU reaches the stored states of four small scenes, after several searches."""

import numpy as np
import pytest
import stored_states

from dusttaichi import method
from dusttaichi.run.ledger import turnover


@pytest.mark.long
@pytest.mark.parametrize("name", stored_states.CHANGES)
def test_states_are_those_stored(name):
    motion, start = stored_states.moved(stored_states.scene(name, "cpu"))
    expected = stored_states.stored()[name]
    found = stored_states.state(motion)
    assert np.isfinite(expected).all() and (np.abs(expected).max(axis=(1, 2)) > 0.0).all()
    assert stored_states.difference(found, expected) <= stored_states.tolerance(name)
    assert motion.sim.search.count > 1
    residual, through = turnover(motion.measure(), method.Start.of(start))
    assert abs(residual / through) <= 0.01  # numerics.ledger_tolerance
