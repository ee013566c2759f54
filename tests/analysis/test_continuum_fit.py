"""Grain runs read as tests of a material, and the fit of a material to them, here to runs that a
point of the material has made up."""

import json
from dataclasses import replace

import numpy as np
import pytest
import synthetic

from dusttaichi.analysis.plain import convert_value
from dusttaichi.commands.fit import write
from dusttaichi.continuum.analysis import fit_tables as tables
from dusttaichi.continuum.analysis.grain_tests import GrainTest, Segment, grain_test
from dusttaichi.continuum.analysis.material_fit import PARAMETERS, fit, numbers_of, stresses
from dusttaichi.continuum.scene import ContinuumMaterial
from dusttaichi.errors import DustError

TRUE = np.array([40e3, 5.0, 0.8, 7e3, 0.5, 0.13, 1.6, 0.7, 2.4, 4.0])
DENSITY = 2650.0


def segment(segment_kind, start, end, records, rate):
    """Even strain along z between two filling factors, the sample's own being 0.145."""
    strain = np.zeros((records + 1, 3))
    strain[:, 2] = np.linspace(np.log(0.145 / start), np.log(0.145 / end), records + 1)
    middle = 0.5 * (strain[1:, 2] + strain[:-1, 2])
    return Segment(
        segment_kind, segment_kind, strain, np.zeros((records, 3)), 0.145 * np.exp(-middle), rate
    )


def made_up(seed, segments, rate=1e4, noise=0.03):
    """A GrainTest whose stresses are those of a point, times noise of a seed."""
    test = GrainTest(f"run_{seed}", "", seed, 4000, DENSITY, 0.145, tuple(segments))
    m = numbers_of(TRUE[None], DENSITY, 0.145 * DENSITY, 0.58)
    random = np.random.default_rng(seed)
    factor = 1.0 + noise * random.standard_normal()
    filled = tuple(
        replace(segment, stress=stress[:, 0] * factor, rate=segment.rate and rate)
        for segment, stress in zip(test.segments, stresses(test, m), strict=True)
    )
    return replace(test, segments=filled)


@pytest.fixture(scope="module")
def tests():
    press = []
    for low, high in ((0.145, 0.2), (0.2, 0.27), (0.27, 0.4)):
        loose = high * np.exp(-1e-3)
        press += [segment("press", low, high, 16, 1e4), segment("release", high, loose, 12, 200.0)]
        press.append(segment("release", loose, high, 2, 200.0))
    pulls = [
        [segment("press", 0.145, phi, 16, 1e4), segment("pull", phi, 0.8 * phi, 30, 1e4)]
        for phi in (0.2, 0.3)
    ]
    return [made_up(seed, parts) for seed in (1, 2) for parts in (press, *pulls)]


@pytest.fixture(scope="module")
def material_fit(tests):
    return fit(tests)


def test_the_material_comes_back(material_fit):
    """Stresses of two seeds that differ by 3 %: so do the numbers that are stresses."""
    values = dict(zip(PARAMETERS, material_fit.values, strict=True))
    true = dict(zip(PARAMETERS, TRUE, strict=True))
    for name in ("bulk_modulus", "shear_ratio", "compressive.p_m", "shear.factor"):
        assert abs(values[name] / true[name] - 1) < 0.08, name
    for name in ("exponent", "compressive.delta", "compressive.phi_1", "shear.exponent"):
        assert abs(values[name] - true[name]) < 0.05 * max(true[name], 1), name
    assert abs(values["tensile.a"] + 0.25 * values["tensile.b"] - 3.4) < 0.05
    assert (
        material_fit.covariance.shape == (10, 10)
        and 0 < material_fit.sigma("compressive.p_m") < 1e3
    )
    assert material_fit.rate == 1e4 and sorted(material_fit.by_seed) == [1, 2]


@pytest.mark.parametrize(
    ("segment_kind", "message"),
    [("pull", "tension"), ("release", "unloading"), ("press", "confined")],
)
def test_what_is_missing_is_named(tests, segment_kind, message):
    fewer_tests = [
        replace(t, segments=tuple(s for s in t.segments if s.kind != segment_kind)) for t in tests
    ]
    with pytest.raises(DustError, match=message):
        fit(fewer_tests)


def test_files_of_a_fit(material_fit, tmp_path):
    """The block is read again as a material, and says where each number comes from."""
    paths = write(material_fit, tmp_path / "made_up.yaml")
    assert [path.name for path in paths] == [
        "made_up.yaml", "made_up.csv", "made_up_speeds.csv", "made_up.png", "made_up_speeds.png",
    ]  # fmt: skip
    assert all(path.stat().st_size > 200 for path in paths)
    material = ContinuumMaterial.model_validate("made_up.yaml", context={"folder": tmp_path})
    assert material.name == "made_up"
    assert abs(material.compressive.p_m / material_fit.values[3] - 1) < 1e-3
    assert material.source.dimension == 3
    assert "2 seeds of 4000 grains" in material.source.numbers["compressive.p_m"]
    assert len(material.source.covariance) == len(material.source.names) == len(PARAMETERS)
    assert len(tables.numbers_table(material_fit)) == len(PARAMETERS) + 2
    assert [row[1] for row in tables.deviations_table(material_fit)] == ["32", "32", "6", "6", "4"]
    (one,) = tables.speeds_table(material_fit)
    assert one[:3] == ("1e+04", "4000", "2")
    numbers = convert_value(tables.numbers(material_fit))
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    assert numbers["material"]["compressive"]["p_m"] == f"{material.compressive.p_m:g} Pa"
    assert [row["grains"] for row in numbers["speeds"]] == [4000]


def test_without_runs_and_with_one_seed(tests):
    with pytest.raises(DustError, match="needs grain runs"):
        tables.result_files([])
    with pytest.raises(DustError, match=r"neither result\.nc"):
        tables.result_files(["nowhere"])
    with pytest.raises(DustError, match="at least two seeds"):
        fit(tests[:3])


# -- grain runs as tests --------------------------------------------------------------------------


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
    return synthetic.make_run(
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
