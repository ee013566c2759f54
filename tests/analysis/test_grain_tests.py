"""A grain run read as a test of a material: which stages press, rest, let go and pull."""

import numpy as np
import pytest
import synthetic

from dusttaichi.analysis.grain_tests import grain_test
from dusttaichi.errors import DustError

STAGES = {"press": (1.0, 0.5), "rest": (0.5, 0.5), "release": (0.5, 0.501), "pull": (0.501, 0.6)}
RECORDS = 10


def run(sideways=0.0, **without):
    """A cell of an edge of 1 along z that goes through STAGES, with stresses that tell the step."""
    edge = np.concatenate(
        [[1.0], *(np.linspace(*ends, RECORDS + 1)[1:] for ends in STAGES.values())]
    )
    n = len(edge)
    box = np.stack([1.0 + sideways * (1 - edge), np.ones(n), edge], axis=1)
    stress = np.zeros((n, 3, 3))
    stress[:, [0, 1, 2], [0, 1, 2]] = -np.arange(n)[:, None] * np.array([1.0, 2.0, 9.0])
    variables = {"box_length": box, "filling_factor": 0.15 / box.prod(axis=1), "stress": stress}
    return synthetic.made(
        scene="material: silicate_s12\nsample: {seed: 7}\n",
        attrs={"grains": 100, "stages": " ".join(STAGES)},
        stage=np.r_[0, np.repeat(np.arange(len(STAGES)), RECORDS)],
        **{name: values for name, values in variables.items() if name not in without},
    )


def test_stages_are_told_apart():
    test = grain_test(run())
    assert [segment.kind for segment in test.segments] == list(STAGES)
    assert (test.seed, test.grains, test.solid_density, test.phi) == (7, 100, 2650.0, 0.15)
    press = test.segments[0]
    assert press.strain.shape == (RECORDS + 1, 3) and len(press.stress) == RECORDS
    assert np.allclose(press.strain[[0, -1], 2], [0.0, np.log(0.5)])
    # the filling factor of an interval is that of its middle
    assert np.isclose(press.phi[0], 0.15 / np.sqrt(1.0 * 0.95))
    assert np.allclose(press.pressure, 4.0 * np.arange(1, 11))
    assert np.allclose(press.difference, 7.5 * np.arange(1, 11))
    assert np.isclose(press.rate, np.log(2) / 10e-6, rtol=5e-3)
    assert np.allclose(test.segments[3].strain[0, 2], np.log(0.501))


def test_what_is_no_confined_test_is_refused():
    with pytest.raises(DustError, match=r"output\.stress: true"):
        grain_test(run(stress=None))
    with pytest.raises(DustError, match="along z alone"):
        grain_test(run(sideways=0.5))
