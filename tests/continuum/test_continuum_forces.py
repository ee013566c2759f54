"""Forces from outside on a continuum: closed forms of a block that moves as one, and the ledger."""

import dust
import numpy as np
import pytest

from dusttaichi.continuum.dust_engine import DustEngine
from dusttaichi.errors import DustError
from dusttaichi.method import Start, find_method, make_sample
from dusttaichi.running.ledger import ledger

BLOCK = {"sample": {"kind": "block", "size": ["0.4 mm", "0.4 mm"]}, "boundary": {"kind": "open"}}
DRAG = {"kind": "gas_drag", "stopping_time": "20 us", "velocity": ["0 m/s", "0 m/s", "0.1 m/s"]}
FIELD = {"kind": "electric_field", "field": ["2e3 V/m", "0 V/m", "0 V/m"]}


def test_a_block_drifts_in_gas_and_field():
    """v = u + (q/m) E tau (1 - e^(-t/tau)); work and loss by the channel of the drag; it closes."""
    scene = dust.scene(**BLOCK).with_values(
        {"forces": [DRAG, FIELD], "charge": {"per_mass": "10 C/kg"}}
    )
    engine: DustEngine = find_method(scene).build(scene, make_sample(scene))
    start = Start.from_measurement(engine.measure())
    while engine.step * engine.dt < 40e-6:
        engine.advance(10)
    time, mass = engine.step * engine.dt, engine.sample.mass.sum()
    decay = np.exp(-time / 20e-6)
    v = engine.motion.velocities()
    np.testing.assert_allclose(v[:, 0], 0.4 * (1 - decay), rtol=1e-3)
    np.testing.assert_allclose(v[:, 2], 0.1 * (1 - decay), rtol=1e-3)
    m = engine.measure()
    losses = dict(zip(engine.channels, m.losses, strict=True))
    # the power of the field, q E v, and that of the wind, m u (u - v)/tau, over the time
    way = 0.4 * (time - 20e-6 * (1 - decay))
    work = mass * (10.0 * 2e3 * way + 0.1 * 0.1 * (1 - decay))
    assert m.work == pytest.approx(work, rel=1e-3)
    assert losses["drag"] == pytest.approx(work - m.kinetic, rel=1e-3)
    assert abs(ledger(m, start)[1]) < 1e-9


def test_what_a_continuum_cannot_have():
    for forces, said in (
        ([{"kind": "script"}], r"forces\[0\].kind.*method: grains"),
        ([{"kind": "gas_drag", "density": "1 kg/m^3"}], r"forces\[0\].density.*stopping_time"),
        ([FIELD], r"forces\[0\].kind.*have no charge"),
    ):
        with pytest.raises(DustError, match=said):
            dust.scene(**BLOCK).with_value("forces", forces)
    with pytest.raises(DustError, match="charge.*per_mass is allowed"):
        dust.scene(**BLOCK).with_value("charge", "1e-15 C")
