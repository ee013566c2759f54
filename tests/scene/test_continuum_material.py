"""The block of a dust of the continuum: names, files, numbers changed, and what is refused."""

from pathlib import Path

import pytest
import yaml
from pydantic import ValidationError

from dusttaichi.physics.continuum.numbers import MaterialNumbers
from dusttaichi.scene import ContinuumMaterial


def read(data, folder=None):
    return ContinuumMaterial.model_validate(data, context={"folder": folder})


def test_named_materials():
    dust = read("dust_g09")
    assert (dust.name, dust.compressive.p_m, read("dust_static").compressive.p_m) == (
        "dust_g09", 1300.0, 13e3,
    )  # fmt: skip
    assert dust.filling_factor == 0.15 and abs(dust.poisson_ratio - 2 / 7) < 1e-15
    m = MaterialNumbers.of(dust)
    assert (m.phi_floor, m.C, m.a, m.K_0) == (0.125, 1.0, 0.5, 300e3)


def test_some_numbers_changed():
    dust = read({"base": "dust_g09", "compressive": {"p_m": "3.9 kPa"}, "shear": "tensile"})
    assert dust.name == "dust_g09, changed"
    assert (dust.compressive.p_m, dust.compressive.phi_2, dust.shear.exponent) == (3900, 0.58, 0)
    assert abs(read({"base": "dust_g09", "poisson_ratio": 0.25}).shear_ratio - 0.6) < 1e-15


def test_a_file_is_found_beside_the_scene(tmp_path):
    dust = read({"base": "dust_g09", "bulk_modulus": "150 kPa", "name": "softer"})
    plain = dust.model_dump(mode="json", exclude_none=True)
    (tmp_path / "soft.yaml").write_text(yaml.safe_dump(plain))
    assert read("soft.yaml", tmp_path) == dust
    assert read({"base": "soft.yaml", "exponent": 3}, tmp_path).bulk_modulus == 150e3


@pytest.mark.parametrize(
    ("data", "said"),
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
    ],
)
def test_refused_with_the_reason(data, said):
    with pytest.raises(ValidationError) as caught:
        read(data)
    assert said in str(caught.value)


def test_the_material_of_the_grains_is_that_of_its_file():
    folder = Path(__file__).parents[2] / "docs/validation"
    file, named = read("dust_grains.yaml", folder), read("dust_grains")
    assert file.model_copy(update={"source": None}) == named
    assert set(file.source.names) < set(file.source.numbers) and len(file.source.runs) > 4
