"""The block of a dust of the continuum: names, files, numbers changed, and what is refused."""

import numpy as np
import pytest
import yaml
from pydantic import ValidationError

from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.samples.elastic import ElasticSample
from dusttaichi.continuum.scene import ContinuumMaterial


def read(data, folder=None):
    return ContinuumMaterial.model_validate(data, context={"folder": folder})


def test_named_materials_and_some_numbers_changed():
    dust = read("dust_g09")
    assert (dust.name, dust.compressive.p_m, read("dust_static").compressive.p_m) == (
        "dust_g09", 1300.0, 13e3,
    )  # fmt: skip
    assert dust.filling_factor == 0.15 and abs(dust.poisson_ratio - 2 / 7) < 1e-15
    m = MaterialNumbers.from_material(dust)
    assert (m.phi_floor, m.C, m.a, m.K_0) == (0.125, 1.0, 0.5, 300e3)
    dust = read({"base": "dust_g09", "compressive": {"p_m": "3.9 kPa"}, "shear": "tensile"})
    assert dust.name == "dust_g09, changed"
    assert (dust.compressive.p_m, dust.compressive.phi_2, dust.shear.exponent) == (3900, 0.58, 0)
    assert abs(read({"base": "dust_g09", "poisson_ratio": 0.25}).shear_ratio - 0.6) < 1e-15


def test_a_file_is_found_beside_the_scene(tmp_path):
    dust = read({"base": "dust_g09", "bulk_modulus": "150 kPa", "name": "softer"})
    plain = dust.model_dump(mode="json", exclude_none=True)
    (tmp_path / "soft.yaml").write_text(yaml.safe_dump(plain))
    assert read("soft.yaml", tmp_path) == dust and hash(read("soft.yaml", tmp_path)) == hash(dust)
    assert read({"base": "soft.yaml", "exponent": 3}, tmp_path).bulk_modulus == 150e3


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("dust", "dust_static, dust_grains, the path of a file"),
        ("nowhere.yaml", "there is no such file"),
        ({"base": "dust_s12"}, "dust_static, dust_grains or the path"),
        ({"base": "dust_g09", "density": "1.3 g/cm^3"}, "phi_2 = 0.58 is never reached"),
        ({"base": "dust_static", "bulk_modulus": "4.5 kPa"}, "more than elastic strain"),
        ({"base": "dust_g09", "shear": "none"}, "sqrt, compressive, tensile or a block"),
        ({"base": "dust_g09", "poisson_ratio": 0.6}, "below 0.5"),
        ({"base": "dust_g09", "poisson_ratio": 0.2, "shear_ratio": 1}, "together with"),
        ({"base": "dust_g09", "compressive": {"phi_2": 0.13}}, "0.02 or more above phi_1"),
        ({"base": "dust_g09", "draw": 1}, "a dust with a covariance: dust_grains"),
        ({"base": "dust_grains", "draw": 0}, "a whole number of at least 1"),
        ({"base": "dust_grains", "draw": 1.5}, "a whole number of at least 1"),
        ({"draw": 1, "bulk_modulus": "300 kPa"}, "it needs a `base`"),
    ],
)
def test_refused_with_the_reason(data, message):
    with pytest.raises(ValidationError) as caught:
        read(data)
    assert message in str(caught.value)


def test_the_material_of_the_grains_has_the_source_of_every_number():
    dust = read("dust_grains")
    assert dust.name == "dust_grains" and len(dust.source.runs) > 4
    assert set(dust.source.names) < set(dust.source.numbers)
    # the file rounds what was fitted to four digits
    assert abs(dust.bulk_modulus / dust.source.values[0] - 1) < 5e-4


def list_fitted(dust, names):
    """The numbers of a dust that the fit names."""
    out = []
    for name in names:
        value = dust
        for key in name.split("."):
            value = getattr(value, key)
        out.append(value)
    return np.array(out)


def test_draws_have_the_mean_and_the_covariance_of_the_fit():
    source = read("dust_grains").source
    values, covariance = np.array(source.values), np.array(source.covariance)
    drawn = [read({"base": "dust_grains", "draw": k}) for k in range(1, 401)]
    numbers = np.array([list_fitted(dust, source.names) for dust in drawn])
    sigma = np.sqrt(covariance.diagonal())
    # 400 draws: a mean errs by sigma/20 (four times that is asked), a standard deviation by 1/28;
    # lognormal ones are a percent wider, and what is impossible (phi_1, exponents) is left out.
    assert np.all(np.abs(numbers.mean(axis=0) - values) < 0.2 * sigma)
    assert np.allclose(numbers.std(axis=0), sigma, rtol=0.15)
    # a and b of the tensile strength move against each other, whatever else they do
    pair = [source.names.index("tensile.a"), source.names.index("tensile.b")]
    expected_correlation = covariance[pair[0], pair[1]] / np.prod(sigma[pair])
    assert abs(np.corrcoef(numbers[:, pair].T)[0, 1] - expected_correlation) < 0.02


def test_a_draw_is_the_same_each_time_and_other_numbers_can_be_changed():
    first, repeated, second = (read({"base": "dust_grains", "draw": k}) for k in (3, 3, 4))
    assert first == repeated and first.bulk_modulus != second.bulk_modulus
    assert first.name == "dust_grains, draw 3" and first.source is None
    assert read({"base": "dust_grains", "draw": 3, "shear": "sqrt"}).name.endswith("3, changed")
    assert first.density == read("dust_grains").density  # held by the fit


def test_young_modulus_gives_the_bulk_modulus():
    """K = E/(3 (1 - 2 nu)) and mu = E/(2 (1 + nu)), of dust on a base and of an elastic body."""
    moduli = {"young_modulus": "2.1 MPa", "poisson_ratio": 0.3}
    dust = ContinuumMaterial.model_validate({"base": "dust_g09", **moduli})
    body = {"kind": "elastic", "diameter": "1 mm", "density": "1 g/cm^3"}
    for material in (dust, ElasticSample.model_validate(body | moduli)):
        assert material.bulk_modulus == pytest.approx(2.1e6 / 1.2)
        assert material.shear_ratio * material.bulk_modulus == pytest.approx(2.1e6 / 2.6)
    for wrong, text in (
        ({"young_modulus": "2 m", "poisson_ratio": 0.3}, "pressure above 0"),
        ({"young_modulus": "2 MPa %", "poisson_ratio": 0.3}, '"MPa %" is not a unit'),
        ({"young_modulus": "2 MPa"}, "needs a poisson_ratio"),
        (moduli | {"bulk_modulus": "1 MPa"}, "not allowed together"),
    ):
        with pytest.raises(ValidationError, match=text):
            ElasticSample.model_validate(body | wrong)
