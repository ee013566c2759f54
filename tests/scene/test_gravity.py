"""Gravity in the YAML of both methods: downwards, along a list, towards a point."""

import pytest

from dusttaichi.errors import DustError
from dusttaichi.scene import from_yaml

DUST = """
name: falling
method: continuum
material: dust_g09
sample: {kind: block, size: [1 mm, 1 mm]}
numerics: {spacing: 0.1 mm}
stop: {steps: 1}
"""
GRAINS = """
name: falling
material: silicate_s12
sample: {kind: rbd, grains: 10}
boundary: {kind: open}
stop: {steps: 1}
"""


def acceleration(scene, gravity):
    return from_yaml(f"{scene}\ngravity: {gravity}\n").gravity.acceleration


@pytest.mark.parametrize("scene", [GRAINS, DUST], ids=["grains", "continuum"])
def test_one_number_is_downwards_and_a_list_goes_anywhere(scene):
    assert acceleration(scene, "9.81 m/s^2") == (0.0, 0.0, -9.81)
    assert acceleration(scene, "0 m/s^2") == (0.0, 0.0, 0.0)
    for written in ("{}", "{{acceleration: {}}}"):
        slant = written.format("[1 m/s^2, 0 m/s^2, -2 m/s^2]")
        assert acceleration(scene, slant) == (1.0, 0.0, -2.0)


def test_plane_strain_has_x_and_z():
    assert acceleration(DUST, "[1 m/s^2, -2 m/s^2]") == (1.0, 0.0, -2.0)
    again = from_yaml(from_yaml(f"{DUST}gravity: [1 m/s^2, -2 m/s^2]").to_yaml())
    assert again.gravity.acceleration == (1.0, 0.0, -2.0)


@pytest.mark.parametrize(
    "scene, gravity, said",
    [
        (GRAINS, "-9.81 m/s^2", ["of at least 0 (downwards)", "acceleration: [0 m/s^2"]),
        (GRAINS, "9.81", ["gravity = 9.81", '"9.81 m/s^2"']),
        (GRAINS, "[1 m/s^2, 2 m/s^2]", ["gravity", "a list of 3 accelerations"]),
        (GRAINS, "{}", ["exactly one of acceleration and central"]),
        (GRAINS, "1e300 m/s^2", ["cannot be computed with", "1e+15 m/s^2 can"]),
        (GRAINS, "[0 m/s^2, 0 m/s^2, -1e16 m/s^2]", ["computed with", "1e+15 m/s^2 can"]),
        (GRAINS, "1e-30 m/s^2", ["cannot be computed with", "1e+15 m/s^2 can"]),
        (DUST, "up", ['gravity = "up"', '"9.81 m/s^2"']),
        (DUST, "[0 m/s^2, 1 m/s^2, 0 m/s^2]", ["gravity.acceleration[1]", "no y in plane strain"]),
        (DUST, "{central: {mass: 1 kg}}", ["gravity.central", "method: grains only"]),
        (
            f"{DUST}boundary: {{kind: faces, periodic: [x]}}",
            "[1 m/s^2, -2 m/s^2]",
            ["gravity.acceleration[0]", "the cell is periodic along x"],
        ),
    ],
)
def test_what_it_is_not(scene, gravity, said):
    with pytest.raises(DustError) as refused:
        from_yaml(f"{scene}\ngravity: {gravity}\n")
    for words in said:
        assert words in str(refused.value), str(refused.value)
