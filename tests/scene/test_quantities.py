"""Quantities as text, to SI and back; what holds of all quantities, scenes and samples."""

import math
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st
from program import python
from pydantic import BaseModel, TypeAdapter, ValidationError

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.method import make_sample
from dusttaichi.physics.geometry import pairs_within
from dusttaichi.scene import from_yaml, quantities

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "text, dimension, value",
    [
        ("0.6 um", "length", 0.6e-6),
        ("0.6 µm", "length", 0.6e-6),  # micro sign
        ("0.6 μm", "length", 0.6e-6),  # Greek mu
        ("0.6um", "length", 0.6e-6),
        (" 2 nm ", "length", 2e-9),
        ("8 Å", "length", 8e-10),
        ("2 um/us", "speed", 2.0),  # for which pint's factor is a whole number
        ("2 m s-1", "speed", 2.0),
        ("20 mJ/m^2", "surface energy", 0.02),
        ("20 mJ/m²", "surface energy", 0.02),
        ("20 mJ m^-2", "surface energy", 0.02),
        ("20 mN/m", "surface energy", 0.02),
        ("1 cm/s", "speed", 0.01),
        ("-5 cm s-1", "speed", -0.05),
        ("20 1/ms", "rate", 2e4),
        ("201/s", "rate", 201.0),
        ("2e4 / s", "rate", 2e4),
        ("1e-6 g/s", "mass rate", 1e-9),
        ("54 GPa", "pressure", 54e9),
        ("2.65 g/cm^3", "density", 2650.0),
        ("2.65 g/cm3", "density", 2650.0),
        ("2650 kg/m**3", "density", 2650.0),
        ("12.5 ps", "time", 12.5e-12),
        ("0.3 ns", "time", 0.3e-9),
        ("1 kPa", "pressure", 1000.0),
        ("3 rad/us", "angular velocity", 3e6),
        ("30 rpm", "angular velocity", 3.141592653589793),
        ("+.5 m", "length", 0.5),
        ("2650 kg·m⁻³", "density", 2650.0),
        ("2650 kg per m^3", "density", 2650.0),
        ("1 kg 1/m^(3)", "density", 1.0),
        ("280000 mK", "temperature", 280.0),
        ("7 degC", "temperature", 280.15),
        ("7 °C", "temperature", 280.15),
        ("44.6 degF", "temperature", 280.15),
        ("-459.67 fahrenheit", "temperature", 0.0),
        ("504.27 degR", "temperature", 280.15),
        ("800 J/(kg degC)", "heat capacity", 800.0),  # a difference here
        ("800 J/kg/°C", "heat capacity", 800.0),
    ],
)
def test_text_to_si_is_exact(text, dimension, value):
    assert quantities.parse(text, dimension) == value


@pytest.mark.parametrize(
    "value, dimension, reason",
    [
        (0.01, "speed", "it has no unit"),
        (0, "speed", "it has no unit"),
        ("0.01", "speed", "it has no unit"),
        ("1 cm", "speed", "a speed is needed"),
        ("1 1/s", "angular velocity", "an angular velocity is needed"),
        ("5 Hz", "angular velocity", "an angular velocity is needed"),
        ("1 cmm/s", "speed", '"cmm/s" is not a unit'),
        ("1 m/s 2", "speed", '"m/s 2" is not a unit ("2" does not belong in it)'),
        ("0.6 um %", "length", '"um %" is not a unit ("%" does not belong in it)'),
        ("0.6 um, 1", "length", '("," does not belong in it)'),
        ("0.6 um #2", "length", '("#2" does not belong in it)'),
        ("0.6 um # radius", "length", '("#" does not belong in it)'),
        ("0.6 um; 2", "length", '(";" does not belong in it)'),
        ("0.6 um .", "length", '("." does not belong in it)'),
        ("0.6 um ± 0.1 um", "length", '("±" does not belong in it)'),
        ("0.6 um 0.7 um", "length", '("0.7" does not belong in it)'),
        ("1 ft 2 in", "length", '("2" does not belong in it)'),
        ("5 x 10^3 Pa", "pressure", '("10^3" does not belong in it)'),
        ("0.6 um percent", "length", '"um percent" is not a unit ("percent" is a number)'),
        ("0.6 um ppm", "length", '("ppm" is a number)'),
        ("0.6 um/", "length", '"um/" is not a unit'),
        ("0.6 um (radius)", "length", '"um (radius)" is not a unit'),
        ("0.6 um nm", "length", "a length is needed"),
        ("7 delta_degC", "temperature", '"delta_degC" is a unit of differences'),
        ("7 delta_degF", "temperature", '"delta_degF" is a unit of differences'),
        ("7 mdegC", "temperature", '"mdegC" is not a unit'),
        ("7 C", "temperature", "a temperature is needed"),
        ("7 degC", "length", "a length is needed"),
        ("nan m/s", "speed", "it is not a finite number"),
        ("inf m/s", "speed", "it is not a finite number"),
        ("1e400 m/s", "speed", "it is not a finite number"),
        ("1e9999999 m/s", "speed", "it is not a finite number"),
        ("1e99999999999999999999 m/s", "speed", "it is not a finite number"),
        ("1,5 m/s", "speed", "a speed is needed"),
        ("1/2 m/s", "speed", "a speed is needed"),
        ("fast", "speed", "a speed is needed"),
        ("", "speed", "a speed is needed"),
        (True, "speed", "a speed is needed"),
        (None, "speed", "a speed is needed"),
        (["1 m/s"], "speed", "a speed is needed"),
        (float("nan"), "time", "it has no unit"),
    ],
)
def test_bad_text_names_place_value_reason_and_example(value, dimension, reason):
    with pytest.raises(DustError) as error:
        quantities.parse(value, dimension, "boundary.wall_speed")
    message = str(error.value)
    assert message.startswith(f"boundary.wall_speed = {value!r}: ")
    assert reason in message
    assert f'for example "{quantities.DIMENSIONS[dimension].example}"' in message


@pytest.mark.parametrize(
    "quantity, text",
    [
        (quantities.Quantity("speed", count=3), '["0 cm/s", "0 cm/s", "1 cm/s"]'),
        (quantities.Quantity("speed", count=2), '["0 cm/s", "1 cm/s"]'),
        (quantities.Quantity("length", gt=0, count=2, example="5 mm"), '["5 mm", "5 mm"]'),
        (quantities.Quantity("angular velocity"), '"1e5 rad/s"'),
    ],
)
def test_examples_of_vectors_have_a_direction(quantity, text):
    with pytest.raises(ValueError) as error:
        TypeAdapter(Annotated[Any, quantity]).validate_python("x")
    assert f"is needed, for example {text}" in str(error.value)


@pytest.mark.parametrize(
    "value, dimension, text",
    [
        (0.6e-6, "length", "0.6 um"), (2e-9, "length", "2 nm"), (0.01, "speed", "1 cm/s"),
        (5.0, "speed", "5 m/s"), (0.0, "speed", "0 m/s"), (-0.05, "speed", "-5 cm/s"),
        (1e-9, "mass rate", "1e-6 g/s"), (54e9, "pressure", "54 GPa"),
        (1.2e5, "pressure", "120 kPa"), (2650.0, "density", "2.65 g/cm^3"),
        (0.02, "surface energy", "20 mJ/m^2"), (12.5e-12, "time", "12.5 ps"),
        (60.0, "time", "60 s"),
    ],
)  # fmt: skip
def test_format_is_what_a_person_writes(value, dimension, text):
    assert quantities.format(value, dimension) == text


@pytest.mark.parametrize(
    "value, dimension, text",
    [
        (1.2233456e-8, "length", "12.23 nm"),
        (-1.4471e-9, "length", "-1.447 nm"),  # not -1447 pm
        (0.6e-6, "length", "0.6 µm"),
        (6e-6, "time", "6 µs"),
        (1e5, "angular velocity", "0.1 rad/µs"),
    ],
)
def test_format_rounds_for_people(value, dimension, text):
    assert quantities.format(value, dimension, digits=4) == text


@pytest.mark.parametrize("dimension", quantities.DIMENSIONS)
def test_example_and_all_units_of_a_dimension_are_those_of_pint(dimension):
    row = quantities.DIMENSIONS[dimension]
    quantities.parse(row.example, dimension)
    assert quantities.parse(f"1 {row.unit}", dimension) == 1.0
    reference, root = quantities._find_root_units(row.unit)
    for unit, power in row.powers.items():
        assert quantities.parse(f"1 {unit}", dimension) == float(f"1e{power}")
        factor, own_root = quantities._find_root_units(unit)
        assert own_root == root and factor / reference == Decimal(1).scaleb(power)


def test_internal_scales_are_consistent():
    def near(value):  # products of powers of ten, each off by at most one rounding
        return pytest.approx(value, rel=1e-15)

    assert near(units.LENGTH / units.TIME) == units.SPEED
    assert near(units.MASS * units.LENGTH / units.TIME**2) == units.FORCE
    assert near(units.FORCE * units.LENGTH) == units.ENERGY == units.TORQUE
    assert near(units.FORCE / units.LENGTH**2) == units.PRESSURE
    assert near(units.FORCE / units.LENGTH) == units.STIFFNESS
    assert near(units.MASS / units.LENGTH**3) == units.DENSITY
    assert near(units.MASS / units.TIME) == units.DAMPING
    assert near(units.MASS * units.LENGTH**2) == units.INERTIA
    assert near(1 / units.TIME) == units.SPIN
    assert near(units.SPEED / units.TIME) == units.ACCELERATION
    for unit, value in {"m^2/s": 1e-6, "J/m^2": 1e-3, "kg m^2/s": 1e-21, "J^-0.6": 1e9}.items():
        assert near(value) == units.GRAINS(unit) and units.SI(unit) == 1.0
    assert units.GRAINS.si(7, "1") == 7 and units.GRAINS.si(7.0, "Pa") == 7e3
    assert units.SI.si(7.0, "unknown") == 7.0


@pytest.mark.parametrize("dimension", ["speed", "length"])
def test_field_types_read_text_and_write_text(dimension):
    class Model(BaseModel):
        value: Annotated[float, quantities.Quantity(dimension)]

    text = quantities.DIMENSIONS[dimension].example
    model = Model(value=text)
    assert model.value == quantities.parse(text, dimension)
    assert model.model_dump(mode="json") == {"value": text}
    with pytest.raises(ValidationError, match=dimension):
        Model(value=1.0)
    field = Model.model_json_schema()["properties"]["value"]
    assert field["type"] == "string" and field["examples"] == [text]


def test_usual_units_do_not_load_pint():
    code = (
        "import sys; from dusttaichi.scene import load; "
        "load('configs/omni_static.yaml'); sys.exit('pint' in sys.modules)"
    )
    assert python("-c", code, cwd=ROOT).returncode == 0


# alike on every machine, and no case fails for being slow on a busy one
settings.register_profile(
    "suite", derandomize=True, deadline=None, max_examples=60, phases=[Phase.generate]
)
settings.load_profile("suite")

KINDS = st.sampled_from(sorted(quantities.DIMENSIONS))
# fast math of compiled kernels takes subnormal numbers for 0 in the whole process
ENDS = st.sampled_from((0.0, 2.2250738585072014e-308, 1.7976931348623157e308))
NUMBERS = ENDS | st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False)


# -- quantities ----------------------------------------------------------------------------------


@given(NUMBERS, KINDS)
def test_a_quantity_is_written_and_read_to_the_last_bit(value, kind):
    assert quantities.parse(quantities.format(value, kind), kind) == value


@given(st.decimals(allow_nan=False, allow_infinity=False, places=6), KINDS, st.data())
def test_units_are_powers_of_ten_to_the_last_bit(number, kind, data):
    """0.6 um is the float that is nearest to 0.6e-6, not one beside it."""
    assume(abs(number) < 10**12)
    powers = quantities.DIMENSIONS[kind].powers
    unit = data.draw(st.sampled_from(sorted(powers)))
    read = quantities.parse(f"{number} {unit}", kind)
    assert read == float(number.scaleb(powers[unit]))


@given(st.text(max_size=30), KINDS)
def test_any_text_is_a_number_or_a_sentence(text, kind):
    try:
        assert math.isfinite(quantities.parse(text, kind, "key"))
    except DustError as error:
        assert str(error).startswith("key = ") and "is needed" in str(error)


@given(st.floats(min_value=1e-9, max_value=1e9), KINDS, st.integers(1, 6))
def test_rounded_for_a_table_it_is_as_near_as_its_digits(value, kind, digits):
    shown = quantities.parse(quantities.format(value, kind, digits), kind)
    assert abs(shown - value) <= 0.5000001 * 10.0 ** (1 - digits) * abs(value)


# -- scenes --------------------------------------------------------------------------------------


SEEDS = st.integers(0, 2**32 - 1)


def length(low, high):
    """A length between two numbers of um, in one of its units."""
    return st.builds(
        lambda um, unit: f"{um * {'um': 1.0, 'nm': 1e3, 'm': 1e-6}[unit]!r} {unit}",
        st.floats(low, high),
        st.sampled_from(("um", "nm", "m")),
    )


SAMPLES = st.one_of(
    st.builds("{{kind: chain, grains: {}}}".format, st.integers(1, 30)),
    st.builds(
        "{{kind: pair, gap: {}, speed: {!r} m/s, impact_parameter: {!r}}}".format,
        length(0.001, 3.0),
        st.floats(0.0, 20.0).filter(lambda v: v == 0.0 or v > 1e-19),
        st.floats(0.0, 1.0).filter(lambda v: v == 0.0 or v > 1e-24),
    ),
    st.builds("{{kind: bcca, grains: {}, seed: {}}}".format, st.integers(2, 40), SEEDS),
    st.builds("{{kind: pca, grains: {}, seed: {}}}".format, st.integers(2, 40), SEEDS),
    st.builds("{{kind: rbd, grains: {}, seed: {}}}".format, st.integers(5, 60), SEEDS),
    st.builds(
        "{{kind: lattice, structure: {}, cells: [{}, {}, {}]}}".format,
        st.sampled_from(("sc", "bcc", "fcc")),
        *[st.integers(1, 3)] * 3,
    ),
)
EFFECT = st.one_of(
    st.sampled_from(("on", "off")), st.builds("{{modifier: {!r}}}".format, st.floats(0.01, 100.0))
)
SCENES = st.builds(
    """
name: {}
material: {{base: silicate_s12, radius: {}, surface_energy: {!r} J/m^2}}
interaction: {{rolling: {}, sliding: {}, damping: {}}}
sample: {}
boundary: {{kind: open}}
stop: {{steps: {}}}
numerics: {{precision: {}}}
output: {{series: {{steps: {}}}, snapshots: {}}}
""".format,
    st.from_regex(r"[a-zA-Z0-9][a-zA-Z0-9_.-]{0,20}[a-z]", fullmatch=True),
    length(0.3, 3.0),
    st.floats(0.005, 0.05),
    EFFECT,
    EFFECT,
    st.sampled_from(("none", "viscous", "viscoelastic", "scaled")),
    SAMPLES,
    st.integers(1, 10**9),
    st.sampled_from(("f64", "mixed")),
    st.integers(1, 10**6),
    st.sampled_from(("off", "{steps: 10}", "{time: 1 us}")),
)


@given(SCENES)
def test_a_resolved_scene_is_the_same_scene(text):
    """The scene that its resolved text gives, and so is its text."""
    scene = from_yaml(text)
    repeated_scene = from_yaml(scene.to_yaml())
    assert repeated_scene == scene and repeated_scene.to_yaml() == scene.to_yaml()


# -- samples -------------------------------------------------------------------------------------


@given(SCENES)
@settings(max_examples=30)
def test_samples_are_numbers_and_grains_are_apart(text):
    """No two centres are nearer than the nine tenths of a diameter that `explicit` allows; contacts
    are those of the positions. That a seed has the same bits again: test_samples_describe."""
    scene = from_yaml(text)
    sample = make_sample(scene)
    for values in (sample.positions, sample.velocities, sample.spins):
        assert np.isfinite(values).all() and values.shape == (len(sample), 3)
    radius = scene.material.radius
    assert not len(pairs_within(sample.positions, np.full(len(sample), radius), 0.9)[0])
    assert 0.0 <= sample.info["coordination"] <= 12.0  # no more fit around one
    # of the densest packing of spheres that overlap as above; those at rest do so by 5 % at most
    assert 0.0 < sample.info["filling_factor"] < 0.7405 / 0.95**3
