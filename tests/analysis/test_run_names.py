"""Names of runs and of points of sweeps: by the symbols of the keys that were changed."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from dusttaichi.analysis.names import format_run_name, name_runs
from dusttaichi.analysis.symbols import label_key
from dusttaichi.analysis.texts import typeset

SCENE = {
    "name": "anything",
    "method": "grains",
    "material": {"surface_energy": "20 mJ/m^2", "radius": "0.6 um", "asperity_volume": "1 nm"},
    "interaction": {"damping": {"model": "viscous"}, "rolling": {"modifier": 8.0}},
    "sample": {"kind": "rbd", "seed": 3, "sizes": [{"radius_ratio": 2}]},
    "boundary": {"wall_speed": "5 m/s"},
    "gravity": "9.81 m/s^2",
}


@pytest.mark.parametrize(
    ("path", "label"),
    [
        ("material.surface_energy", "γ"),
        ("materials.ice.radius", "r of ice"),
        ("interaction.rolling.modifier", "m_r"),
        ("interaction.damping.model", "damping model"),
        ("boundary.wall_speed", "wall speed"),
        ("stop.filling_factor", "stop filling factor"),
        ("boundary.size.0", "boundary size"),
        ("gravity", "g"),
    ],
)
def test_keys_have_their_symbols_or_their_own_words(path, label):
    assert label_key(path) == label


def test_two_keys_have_two_labels():
    pair = ["sample.target.grains", "sample.projectile.grains"]
    labels = [label_key(path, pair) for path in pair]
    assert labels == ["sample target grains", "sample projectile grains"]


@pytest.mark.parametrize(
    ("title", "name"),
    [
        ("cake-material.surface_energy_20mJ_m_2", "cake, γ = 20 mJ/m²"),
        (
            "old-cake-material.radius_0.6um__boundary.wall_speed_5m_s",
            "old-cake, r = 0.6 µm, wall speed = 5 m/s",
        ),
        ("cake-interaction.damping_viscous", "cake, damping = viscous"),
        ("cake-sample.sizes.0.radius_ratio_2", "cake, radius ratio = 2"),
        ("cake-gravity_9.81m_s_2", "cake, g = 9.81 m/s²"),
        # names that look like keys, and are not
        ("cake-method_b", "cake-method_b"),
        ("cake-1.5", "cake-1.5"),
        ("cake-material.colour_red", "cake-material.colour_red"),
        ("material.surface_energy_20mJ_m_2", "material.surface_energy_20mJ_m_2"),
    ],
)
def test_points_of_a_study_are_named_by_what_was_changed(title, name):
    assert format_run_name(title, SCENE) == name
    assert format_run_name(title, {}) == title


def run(title, folder="run", **sample):
    scene = SCENE | {"sample": SCENE["sample"] | sample}
    path = Path("/runs") / folder / "result.nc"
    return SimpleNamespace(title=title, name=format_run_name(title, scene), scene=scene, path=path)


def test_several_runs_are_named_by_their_differences():
    points = [run(f"cake-sample.seed_{n}", seed=n) for n in (1, 2)]
    assert name_runs(points) == ["seed = 1", "seed = 2"]
    assert name_runs([*points, run("ice")]) == ["cake, seed = 1", "cake, seed = 2", "ice"]
    assert name_runs([run("cake", seed=n) for n in (1, 2)]) == ["seed = 1", "seed = 2"]
    assert name_runs([run("cake", "a"), run("cake", "b")]) == ["cake, a", "cake, b"]
    assert (
        format_run_name("cake-sample.seed_3_1", SCENE, "replica_1") == "cake, seed = 3, replica 1"
    )


def test_units_are_typeset():
    assert typeset("0.6 um, 5 us^-1, 1 kg/m^3, uniform") == "0.6 µm, 5 µs⁻¹, 1 kg/m³, uniform"
