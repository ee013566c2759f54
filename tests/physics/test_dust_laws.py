"""Laws of dust by name: one of the docs, laws of tests, several in a scene, and what is refused."""

import runpy
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest
from continuum import dust
from numpy import exp, log
from pydantic import ValidationError
from scenes import EXAMPLES, extensions_forgotten

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.physics import elasticity, path, register, strength
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.physics.point import MaterialPoint
from dusttaichi.continuum.scene import ContinuumMaterial, DustLaw
from dusttaichi.errors import DustError
from dusttaichi.physics.contact.effect_numbers import Constant
from dusttaichi.physics.laws import rolling_energy
from dusttaichi.scene import from_yaml, json_schema

KEYS = {"radius": "0.6 um", "surface_energy": "20 mJ/m^2", "critical_rolling": "2 nm"}
ROLLING = {"base": "dust_g09", "compressive": {"law": "rolling_grains", **KEYS}}
SCALE = rolling_energy(20e-3, 0.6e-6, 2e-9) / 0.6e-6**3
PHI = np.linspace(0.1, 0.6, 11)


@pytest.fixture(autouse=True)
def laws():
    """Laws of dust that are registered within are forgotten; that of the docs is there."""
    with extensions_forgotten():
        yield runpy.run_path(str(EXAMPLES / "compressive_strength.py"))


def sigma(phi):
    return SCALE * (1.0 / phi - 1.0 / 0.74) ** -3


def numbers(data):
    return MaterialNumbers.from_material(ContinuumMaterial.model_validate(data))


def close(a, b, rtol=1e-12):
    np.testing.assert_allclose(a, b, rtol=rtol)


def test_quasi_static_compaction_follows_the_law():
    """From all sides p is the strength of the law, wherever the dust flows."""
    m = numbers(ROLLING)
    close(strength.compressive(PHI, m), sigma(PHI))
    point = MaterialPoint.make_unstressed(m)
    for _ in range(300):
        point = point.apply_strain((-1e-3,) * 3)
        close(point.p, sigma(point.phi), 1e-10)
    assert point.phi > 0.36


def test_pressed_dust_of_a_run_follows_the_law():
    """Between rigid walls, as of the built-in law (continuum/test_motion.py): 2 % of sound."""
    count, speed = 16, 0.15
    motion = dust.moving(
        *dust.column(6, count, boundary=dust.WALLS | {"wall_speed": "0.15 m/s"}, material=ROLLING)
    )
    shares = []
    for near in np.linspace(-0.003, 0.003, 7):
        end = count * dust.ROW * (1.0 - 0.15 / (0.19 + near)) / speed
        motion.advance(int(end / motion.dt) - motion.step)
        record = motion.series(motion.measure(), None)
        shares.append(record["pressure_mean"] / sigma(record["filling_factor_mean"]))
    assert np.mean(shares) == pytest.approx(1.0, abs=0.02)


class Stiffening:
    """A modulus that the built-in law has too, and without a solution for its path."""

    NUMBERS = {"K_i": Constant("Pa", "modulus"), "steepness": Constant("1", "exponent")}

    def numbers(material, own):
        return {"K_i": material.bulk_modulus, "steepness": material.exponent}

    def modulus(reference, m):
        return m.K_i * exp(m.steepness * log(reference / m.rho_i))

    def exponent(reference, m):
        return m.steepness + 0.0 * reference


def test_the_path_of_an_elasticity_is_solved():
    """Pressures to the largest of compression, where two solutions meet, and half the modulus."""
    register("elasticity", "stiffening", Stiffening, DustLaw)
    own, built_in = (
        numbers({"base": "dust_g09", "elasticity": {"law": law}}) for law in ("stiffening", "power")
    )
    assert own.q_max == built_in.q_max
    density = 2e3 * PHI
    K = elasticity.bulk_modulus(density, own)
    for share in (-0.5, -0.03, 1e-6, 0.04, own.q_max):
        reference = path.reference_density(density, share * K, own)
        # the sum of both terms rounds
        close(elasticity.elastic_pressure(density, reference, own), share * K, 1e-9)
        if abs(share) < 0.05:
            close(reference, path.reference_density(density, share * K, built_in))


def test_materials_of_a_scene_may_have_several_laws():
    """Each has the numbers of its own laws, on the host and in kernels."""
    register("elasticity", "stiffening", Stiffening, DustLaw)
    pair = [
        ContinuumMaterial.model_validate(data)
        for data in ("dust_g09", ROLLING | {"elasticity": {"law": "stiffening"}})
    ]
    alone, both = list(map(MaterialNumbers.from_material, pair)), MaterialNumbers.together(pair)
    rho = 2e3 * PHI

    def formulas(laws, rho, m):
        phi = rho / m.rho_s
        p, reference = laws.pressure(rho, 0.99 * rho, m)
        return laws.compressive(phi, m), laws.shear(phi, m), p, reference

    plain = SimpleNamespace(pressure=path.pressure, **vars(strength))
    expected = [np.transpose(formulas(plain, rho, m)) for m in alone]
    for number, rows in enumerate(expected):
        taken = both.take(np.full(len(rho), number))
        close(np.transpose(formulas(plain, rho, taken)), rows)

    ti.init(arch=ti.cpu, default_fp=ti.f64, fast_math=False, log_level=ti.ERROR)
    from dusttaichi.continuum.physics.kernels import laws_of, material_type

    compiled, Material = laws_of(both.laws), material_type(both.laws)

    @ti.kernel
    def evaluate(x: ti.types.ndarray(ti.f64, 1), out: ti.types.ndarray(ti.f64, 2), m: Material):
        for k in x:
            phi = x[k] / m.rho_s
            p, reference = compiled.pressure(x[k], 0.99 * x[k], m)
            row = ti.Vector([compiled.compressive(phi, m), compiled.shear(phi, m), p, reference])
            for n in ti.static(range(4)):
                out[k, n] = row[n]

    for number, rows in enumerate(expected):
        out = np.empty((len(rho), 4))
        evaluate(rho, out, Material(*both.take(number).values()))
        close(out, rows)


def test_another_law_has_no_number_of_the_base():
    material = ContinuumMaterial.model_validate(ROLLING)
    assert not hasattr(material.compressive, "p_m") and material.name == "dust_g09, changed"
    again = ContinuumMaterial.model_validate(material.model_dump(mode="json", exclude_none=True))
    assert again == material and hash(again) == hash(material)


TEXT = (EXAMPLES / "compressive_strength.yaml").read_text()
SCENE = TEXT.replace("extensions: [compressive_strength.py]\n", "")


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("law: rolling_grains", "law: rolling", "g09, rolling_grains is needed, or the name"),
        ("radius: 0.6 um", "radius: 0.6 Pa", "a length"),
        ("radius: 0.6 um", "radios: 0.6 um", 'did you mean "radius"'),
        (", critical_rolling: 2 nm", "", "material.compressive.critical_rolling"),
        ("radius: 0.6 um", "radius: 0.01 um", "material.bulk_modulus"),
    ],
)
def test_errors_name_the_key(old, new, text):
    with pytest.raises(DustError) as caught:
        from_yaml(SCENE.replace(old, new))
    assert text in str(caught.value)


def test_the_schema_has_the_keys_of_the_law():
    block = {
        "name": "a", "method": "continuum", "material": ROLLING,
        "sample": {"kind": "block", "size": ["1 mm", "1 mm"]},
        "numerics": {"spacing": "0.1 mm"}, "stop": {"steps": 1},
    }  # fmt: skip
    jsonschema.validate(block, json_schema())
    wrong = block | {"material": ROLLING | {"compressive": {"law": "rolling_grains", "radius": 1}}}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(wrong, json_schema())


def test_laws_that_are_refused(laws):
    law = laws["RollingGrains"]
    with pytest.raises(ValueError, match="one of compressive, tensile, shear, elasticity"):
        register("strength", "a", law, DustLaw)
    with pytest.raises(ValueError, match="has a built-in law of that name"):
        register("compressive", "g09", law, DustLaw)
    with pytest.raises(ValueError, match="lacks modulus, exponent"):
        register("elasticity", "a", law, DustLaw)

    def with_module(phi, m):
        return np.exp(phi)

    def with_other(phi, m):
        return sigma_of(phi)

    for strength_of, text in ((with_module, "uses the module np"), (with_other, "calls sigma_of")):
        other = SimpleNamespace(**{**vars(law), "strength": strength_of})
        with pytest.raises(ValueError, match=text):
            register("compressive", "a", other, DustLaw)
    register("tensile", "same", type("Same", (law,), {}), DustLaw)
    with pytest.raises(ValidationError, match="same of tensile has a number scale, as the law rol"):
        ContinuumMaterial.model_validate(ROLLING | {"tensile": {"law": "same"}})


sigma_of = np.vectorize(sigma)
