"""Grains of different radius and material: search, geometry, samples, files."""

import numpy as np
import pytest
import reference as ref
from scenes import FAR, Probe, box, grain, make_scene, masses_of, polydisperse, two_materials

from dusttaichi import analysis, samples
from dusttaichi.errors import DustError
from dusttaichi.grains import record
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.time_step import time_step
from dusttaichi.physics import geometry
from dusttaichi.running import execute
from dusttaichi.scene import Scene

# Search.


def make_gas(seed=31):
    """A dense gas of sizes 1 to 5."""
    rng = np.random.default_rng(seed)
    n = 260
    radii = np.where(rng.random(n) < 0.06, 0.6e-6, 0.12e-6) * rng.uniform(0.9, 1.0, n)
    radii = np.sort(radii)[::-1]
    x = []
    while len(x) < n:
        position = rng.uniform(-1.6e-6, 1.6e-6, 3)
        near = np.array(x).reshape(-1, 3) - position
        if np.all(np.linalg.norm(near, axis=1) > radii[: len(x)] + radii[len(x)]):
            x.append(position)
    return polydisperse(x, radii, rng.integers(0, 2, n), 20.0 * rng.normal(size=(n, 3)), 0.0)


def test_search_against_brute_force():
    """Every pair of a mixture that overlaps is a contact, and none that is past pull-off; and no
    bit depends on the threads."""
    sample = make_gas()
    upper = np.array(np.triu_indices(len(sample), 1))
    touch = sample.radii[upper[0]] + sample.radii[upper[1]]
    kept = []
    for skin, threads in ((0.3, 1), (0.3, 2)):
        numerics = {"skin": skin, "threads": threads}
        scene = two_materials(dt="0.01 ns", boundary=FAR, numerics=numerics)
        probe = Probe(scene, sample)
        formed = 0
        for _ in range(20):
            probe.advance(40)
            gap = touch - np.linalg.norm(probe.x[upper[0]] - probe.x[upper[1]], axis=1)
            active = set(probe.contacts())
            touching = set(zip(*upper[:, gap > 1e-17], strict=True))
            # the weakest hold of all these materials lets go at 1 nm at the latest
            near = set(zip(*upper[:, gap >= -1e-9], strict=True))
            assert touching <= active <= near
            assert probe.sim.ledger.measure_energies()["contacts"] == len(active)
            formed = max(formed, len(active))
        assert formed > 20 and probe.sim.search.count > 3
        kept.append([probe._grains(name) for name in ("x", "v", "w")])
    assert all(np.array_equal(a, b) for a, b in zip(*kept, strict=True))


# Geometry.


def test_shadow_and_cylinder_of_unequal_grains():
    """Two discs by the lens of two circles; many by a grid; a disc inside another adds nothing."""
    r = np.array([1.0, 0.4])
    area = geometry.union_area([[0, 0], [1.1, 0]], r)
    both = np.pi * np.sum(r**2) - geometry.lens_area(1.0, 0.4, 1.1)
    assert area == pytest.approx(float(both), rel=1e-13)
    assert geometry.union_area([[0, 0], [0.5, 0]], r) == pytest.approx(np.pi, rel=1e-13)
    assert geometry.union_area([[0, 0], [0, 0]], np.ones(2)) == pytest.approx(np.pi, rel=1e-13)
    rng = np.random.default_rng(3)
    x, r = rng.uniform(0, 6, (60, 3)), rng.uniform(0.1, 1.0, 60)
    ticks = np.arange(-1.0, 7.0, 0.01) + 0.005
    grid = np.stack(np.meshgrid(ticks, ticks), -1).reshape(-1, 2)
    inside = np.zeros(len(grid), bool)
    for centre, radius in zip(x[:, :2], r, strict=True):
        inside |= np.sum((grid - centre) ** 2, axis=1) < radius**2
    # a boundary of some 40 passes 4000 cells of 1e-4, each wrong by half at random
    assert geometry.union_area(x[:, :2], r) == pytest.approx(inside.sum() * 1e-4, abs=0.02)
    assert geometry.union_area(x[:, :2], np.full(60, 0.7)) == pytest.approx(
        geometry.union_area(x[:, :2], 0.7), rel=1e-12
    )
    one_by_one = [
        geometry.cylinder_volume(a[None], b, (3, 3), 2.0, low=1.0, high=5.0)
        for a, b in zip(x, r, strict=True)
    ]
    assert geometry.cylinder_volume(x, r, (3, 3), 2.0, low=1.0, high=5.0) == pytest.approx(
        sum(one_by_one), rel=1e-12
    )
    slabs = record.slab_volumes(x[:, 2], r, np.array([-1.0, 2.0, 7.0]))
    assert slabs.sum() == pytest.approx(np.sum(4 / 3 * np.pi * r**3), rel=1e-13)


def test_slabs_have_what_lies_between_their_edges():
    """A sphere counts in the few slabs that it reaches, with the cap below each edge."""
    rng = np.random.default_rng(3)
    z, r = rng.uniform(-2.0, 14.0, 200), rng.uniform(0.2, 2.0, 200)
    for edges in np.arange(13.0), np.minimum(np.arange(13.0), 7.3), np.array([0.0, 12.0]):
        t = np.clip(edges - z[:, None], -r[:, None], r[:, None])
        below = np.pi * (r[:, None] ** 2 * t - t**3 / 3 + 2 / 3 * r[:, None] ** 3)
        expected = np.diff(below, axis=1).sum(axis=0)
        assert record.slab_volumes(z, r, edges) == pytest.approx(expected, rel=1e-12, abs=1e-12)
        assert record.slab_volumes(z, 0.7, edges) == pytest.approx(
            record.slab_volumes(z, np.full(200, 0.7), edges), rel=1e-12
        )


def test_time_step_is_that_of_the_small_grains():
    """A small grain among large ones rings faster than among its like, by less than (4/3)^(1/2)
    of its period (R doubles at most: springs grow by 2^(2/3))."""
    scene = two_materials(dt="0.1 ps")
    mixture = polydisperse(np.arange(39).reshape(13, 3) * 1e-4, [0.1e-6] * 9 + [10e-6] * 4)
    period = time_step(ContactTable.for_sample(scene, mixture), 13).period
    like = Scene.from_dict(
        {**scene._input_data, "material": {"base": "silicate_s12", "radius": "0.1 um"}}
    )
    alone = time_step(ContactTable(like), 13).period
    assert 0.75 * alone < period < alone


# Scenes and samples.

MIXED = {"materials": {"ice": "ice_t19"}}


def sample_block(**sample):
    return make_scene(sample=sample, **MIXED)


def test_pair_of_unlike_grains():
    sample = samples.make(
        sample_block(
            kind="pair", radii=["0.6 um", "0.2 um"], materials=["default", "ice"], speed="1 m/s"
        )
    )
    m = masses_of([0.6e-6, 0.2e-6], [0, 1])
    assert np.abs(m @ sample.positions).max() < 1e-15 * m.sum() * 1e-6
    assert np.abs(m @ sample.velocities).max() < 1e-15 * m.sum()
    assert sample.velocities[0, 0] - sample.velocities[1, 0] == pytest.approx(1.0, rel=1e-14)
    delta0 = ref.mix_constants(grain(0.6e-6, 0), grain(0.2e-6, 1)).delta0
    distance = np.linalg.norm(sample.positions[0] - sample.positions[1])
    assert 0.8e-6 - distance == pytest.approx(delta0, rel=1e-6)
    # the radius of a material is that of its grains
    sample = samples.make(sample_block(kind="pair", materials=["ice", "ice"], gap="1 nm"))
    np.testing.assert_array_equal(sample.radii, 0.1e-6)


def test_equal_grains_are_told_so():
    """Radii that are all the material's make no grains of their own."""
    for properties in ({"radii": ["0.6 um", "0.6 um"]}, {"materials": ["default", 0]}):
        sample = samples.make(sample_block(kind="pair", **properties))
        assert sample.radii is None and sample.materials is None


def test_explicit_and_csv(tmp_path):
    positions = [["0 m", "0 m", "0 m"], ["0.79 um", "0 m", "0 m"]]
    made = samples.make(
        sample_block(
            kind="explicit", positions=positions, radii=["0.6 um", "0.2 um"], materials=[0, "ice"]
        )
    )
    path = tmp_path / "grains.csv"
    path.write_text("x,y,z,radius,material\n0,0,0,0.6,default\n0.79,0,0,0.2,ice\n")
    read = samples.make(sample_block(kind="explicit", file=str(path), units="um"))
    for sample in (made, read):
        np.testing.assert_allclose(sample.radii, [0.6e-6, 0.2e-6], rtol=1e-15)
        np.testing.assert_array_equal(sample.materials, [0, 1])
        assert sample.info["coordination"] == 1.0
    volume = 4 / 3 * np.pi * (0.6e-6**3 + 0.2e-6**3)
    room = (0.6 + 0.79 + 0.2) * 1.2 * 1.2 * 1e-18
    assert made.info["filling_factor"] == pytest.approx(volume / room, rel=1e-12)


@pytest.mark.parametrize(
    "sample, words",
    [
        ({"materials": ["ice", "lead"]}, ["sample.materials", "lead", "default, ice"]),
        ({"radii": ["0.6 um"]}, ["sample.radii", "2 are needed"]),
        ({"radii": ["0.6 um", "1 nm"]}, ["sample.radii", "critical_rolling"]),
        ({"radii": ["0.6 um", "0.2 um"], "distance": "0.5 um"}, ["sample.distance", "0.72 µm"]),
    ],
)
def test_refused(sample, words):
    with pytest.raises(DustError) as caught:
        samples.make(sample_block(kind="pair", **sample))
    assert all(word in str(caught.value) for word in words), caught.value


def test_collision_of_unlike_bodies():
    """The centre of mass rests, and the first touch is that of two surfaces."""
    pair = {"kind": "pair", "radii": ["0.6 um", "0.3 um"], "materials": ["default", "ice"]}
    single = {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]], "radii": ["0.15 um"]}
    sample = samples.make(
        sample_block(
            kind="collision", target=pair, projectile=single, speed="2 m/s", gap="1 um", seed=4
        )
    )
    np.testing.assert_allclose(sample.radii, [0.6e-6, 0.3e-6, 0.15e-6])
    m = masses_of(sample.radii, sample.materials)
    assert np.abs(m @ sample.velocities).max() < 1e-14 * m.sum()
    assert np.abs(m @ sample.positions).max() < 1e-14 * m.sum() * 1e-6
    x = sample.positions.copy()
    x[2, 0] -= 1e-6
    gap = np.linalg.norm(x[:2] - x[2], axis=1) - sample.radii[:2] - sample.radii[2]
    assert gap.min() == pytest.approx(0.0, abs=1e-14)


def test_run_and_go_on(tmp_path):
    """A run of unlike grains: what it writes of them, the same bits after an interruption, and its
    last frame as a sample."""
    scene = make_scene(
        sample={
            "kind": "explicit",
            "positions": [["0 m", "0 m", "0 m"], ["0.799 um", "0 m", "0 m"]],
            "radii": ["0.6 um", "0.2 um"],
            "materials": [0, "ice"],
            "velocities": [["0 m/s", "0 m/s", "0 m/s"], ["0 m/s", "0.3 m/s", "0 m/s"]],
        },
        boundary=box(),
        damping="viscoelastic",
        dt="0.02 ns",
        stop={"steps": 80},
        output={"snapshots": {"steps": 20}, "series": {"steps": 10}},
        **MIXED,
    )
    uninterrupted, parts_folder = tmp_path / "whole", tmp_path / "parts"
    execute(scene, uninterrupted)
    execute(scene.with_value("stop.steps", 40), parts_folder)
    execute(scene, parts_folder, resume=True)
    frames = []
    for directory in (uninterrupted, parts_folder):
        run = analysis.open_run(directory)
        frames.append(analysis.read_frame(run))
        np.testing.assert_allclose(
            analysis.read_grain_masses(run), masses_of([0.6e-6, 0.2e-6], [0, 1]), rtol=1e-13
        )
        assert np.abs(run.series.energy_residual_relative.values).max() < 1e-3
        volume = 4 / 3 * np.pi * (0.6e-6**3 + 0.2e-6**3)
        room = (run.series.height.values * 1.2e-6 * 1.4e-6)[0]
        assert run.series.filling_factor.values[0] == pytest.approx(volume / room, rel=0.2)
    for name in ("position", "velocity", "spin", "radius"):
        assert np.array_equal(getattr(frames[0], name), getattr(frames[1], name))
    sample = samples.make(sample_block(kind="explicit", file=str(uninterrupted)))
    np.testing.assert_allclose(sample.radii, [0.6e-6, 0.2e-6], rtol=1e-15)
    np.testing.assert_array_equal(sample.materials, [0, 1])
    assert sample.contacts is not None and len(sample.contacts["i"]) == 1
