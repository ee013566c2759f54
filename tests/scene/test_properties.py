"""What holds of all quantities, scenes and samples, tried on what hypothesis makes up."""

import math

import numpy as np
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

from dusttaichi.errors import DustError
from dusttaichi.method import make_sample
from dusttaichi.physics.geometry import pairs_within
from dusttaichi.scene import from_yaml, quantities

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
    again = from_yaml(scene.to_yaml())
    assert again == scene and again.to_yaml() == scene.to_yaml()


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
