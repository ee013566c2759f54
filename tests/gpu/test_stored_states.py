"""The CPU reaches the stored states of four small scenes, after several searches."""

import numpy as np
import pytest
import stored_states
from scenes import make_scene

from dusttaichi import method
from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.declare import GrainVariable, place
from dusttaichi.running.ledger import turnover


@pytest.mark.long
@pytest.mark.parametrize("name", stored_states.CHANGES)
def test_states_are_those_stored(name):
    motion, start = stored_states.move_scene(stored_states.scene(name, "cpu"))
    expected = stored_states.read_stored()[name]
    state = stored_states.state(motion)
    assert np.isfinite(expected).all() and (np.abs(expected).max(axis=(1, 2)) > 0.0).all()
    assert stored_states.difference(state, expected) <= stored_states.tolerance(name)
    assert motion.search.count > 1
    residual, through = turnover(motion.measure(), method.Start.from_measurement(start))
    assert abs(residual / through) <= 0.01  # numerics.ledger_tolerance


def test_a_number_of_neighbouring_contacts_is_side_by_side():
    """Threads of a device read it together; on a CPU the numbers of a block are side by side."""
    moving = [GrainVariable(name, "", "", ("f64", 3), (8,)) for name in ("x", "v", "w")]
    contact = GrainVariable("contact", "", "", ("f64", 0), (8, 5, 1))
    for by_columns, expected in ((True, 8), (False, 40)):
        start_taichi(make_scene(), 1)
        field = place([*moving, contact], by_columns)["contact"]

        @ti.kernel
        def apart(field: ti.template()) -> ti.u64:
            return ti.get_addr(field, [1, 0, 0]) - ti.get_addr(field, [0, 0, 0])

        assert apart(field) == expected
