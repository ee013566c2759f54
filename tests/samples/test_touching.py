"""Grains that touch but for the rounding of their file; files and scenes of other people."""

from pathlib import Path

import numpy as np
import pytest
from grain_texts import dump, read
from scenes import make_scene

from dusttaichi import samples
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.grains.build import build
from dusttaichi.grains.method import METHOD
from dusttaichi.method import Start
from dusttaichi.physics.geometry import pairs_within
from dusttaichi.running import ledger
from dusttaichi.samples import Materials
from dusttaichi.samples.touching import deep_overlaps, rounding
from dusttaichi.scene import load

R = 0.6
DELTA0 = 166.27e-6  # um, of two grains of silicate_s12
UNEQUAL = (0.5, 0.6, 0.9)


def aggregate(radii, seed=1):
    """A tree of grains (N, 3) [um] at exactly r1 + r2 of the grain that each sticks to."""
    rng, x = np.random.default_rng(seed), [np.zeros(3)]
    while len(x) < len(radii):
        n, k = len(x), rng.integers(len(x))
        away = rng.normal(size=3)
        position = x[k] + away / np.linalg.norm(away) * (radii[k] + radii[n])
        gaps = np.linalg.norm(np.array(x) - position, axis=1) - radii[:n] - radii[n]
        if np.all(np.delete(gaps, k) > 0.05):
            x.append(position)
    return np.array(x)


def crystal():
    """Grains of a face-centred cubic block (N, 3) [um] at exactly 2 r, full of loops."""
    corners = np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3)
    faces = [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]
    return 2.0 * R * np.sqrt(2.0) * np.concatenate([corners + face for face in faces])


def read_sample(tmp_path, x, *options, digits=4, **keys):
    """The Sample of a scene with a file of these columns [um], and the scene."""
    table = np.column_stack([x, *options])
    names = ("x", "y", "z", "radius", "vx", "vy", "vz")[: table.shape[1]]
    np.savetxt(tmp_path / "a.csv", table, f"%.{digits}f", ",", header=",".join(names), comments="")
    boundary = keys.pop("boundary", {"kind": "open"})
    block = {"kind": "explicit", "file": str(tmp_path / "a.csv"), "units": "um", **keys}
    scene = make_scene(sample=block, boundary=boundary)
    return samples.make(scene), scene


def overlaps(sample, scene):
    """Overlaps over delta0 of all pairs within 1 % of a contact."""
    radii = np.broadcast_to(Materials(scene).radii_of(sample), len(sample)).astype(float)
    i, j, distance = pairs_within(sample.positions, radii, 1.01)
    resting_distance = Materials(scene).equilibrium_distance
    at_rest = [resting_distance((radii[a], radii[b]), (0, 0)) for a, b in zip(i, j, strict=True)]
    both = radii[i] + radii[j]
    return (both - distance) / (both - at_rest)


@pytest.mark.parametrize("digits", [3, 4, 6, 12])
@pytest.mark.parametrize("sizes", [(R,), UNEQUAL], ids=["equal", "unequal"])
def test_an_aggregate_is_in_equilibrium_whatever_its_digits(tmp_path, digits, sizes):
    radii = np.random.default_rng(2).choice(sizes, 60)
    x = aggregate(radii)
    sample, scene = read_sample(tmp_path, x, radii, digits=digits)
    touching = sample.info["touching"]
    assert (touching["contacts"], touching["fragments"], touching["within"]) == (59, 1, 59)
    # the relaxation ends within a thousandth of delta0
    np.testing.assert_allclose(overlaps(sample, scene), 1.0, atol=2e-3)
    moved = np.linalg.norm(sample.positions * 1e6 - np.round(x, digits), axis=1)
    assert moved.max() == pytest.approx(touching["moved"] * 1e6)
    # by the rounding and by the overlaps along a branch
    assert moved.max() < 2e-3 * (digits == 3) + 1e-3
    mass = radii**3 / np.sum(radii**3)
    np.testing.assert_allclose(mass @ sample.positions * 1e6, mass @ np.round(x, digits), atol=1e-9)
    assert touching["text"] == "59 contacts in 1 fragment"
    (text,) = sample.info["remarks"]
    assert "of 59 pairs of touching grains" in text and "sample.touch_within: 0 leaves" in text


@pytest.mark.parametrize("digits", [3, 5])
def test_loops_keep_all_their_contacts(tmp_path, digits):
    sample, scene = read_sample(tmp_path, crystal(), digits=digits)
    touching = sample.info["touching"]
    assert touching["contacts"] == touching["within"] and not touching["still_apart"]
    own = overlaps(sample, scene)
    assert len(own) == touching["contacts"] and own.min() > 0.0
    # three digits are off by up to ten delta0: what remains of them in loops
    assert own.max() < (3.0 if digits == 3 else 1.1)


def test_contacts_across_faces(tmp_path):
    """A zigzag across the faces of a cell, with its neighbours in the next images."""
    text = dump("id type x y z radius", "1 1 9.7 5 5 0.6", "2 1 0.9 5 5 0.6")
    sample = read(tmp_path, text, {"kind": "periodic"}, keep=["box"], touch_within="auto")
    assert sample.info["touching"]["contacts"] == 1
    apart = sample.positions[1, 0] + 10e-6 - sample.positions[0, 0]
    assert apart == pytest.approx(1.2e-6 - DELTA0 * 1e-6, rel=1e-6)
    assert "no two" not in " ".join(sample.info["remarks"])


def test_positions_of_the_yaml_touch_at_the_sum_of_the_radii():
    def of(*positions, **options):
        rows = [[f"{x} um", "0 um", "0 um"] for x in positions]
        scene = make_scene(sample={"kind": "explicit", "positions": rows, **options})
        return samples.make(scene)

    chain = of(0, 1.2, 2.4, 3.6, 4.8)  # 3.6 - 2.4 is 1.2 and 4e-16
    assert chain.info["touching"]["contacts"] == 4
    np.testing.assert_allclose(np.diff(chain.positions[:, 0]) * 1e6, 1.2 - DELTA0, rtol=1e-6)
    x = aggregate(np.full(20, R))
    rows = [[f"{a:.3f} um" for a in row] for row in x]  # three decimals
    scene = make_scene(sample={"kind": "explicit", "positions": rows})
    assert samples.make(scene).info["touching"]["contacts"] == 19
    for distance in (1.2001, 1.1999, 1.19):  # gaps and overlaps that are meant
        assert of(0, distance).positions[1, 0] == pytest.approx(distance * 1e-6, rel=1e-15)
    against = [["0 m/s"] * 3, ["-1 cm/s", "0 m/s", "0 m/s"]]
    assert of(0, 1.2, velocities=against).positions[1, 0] == 1.2e-6  # a first touch
    assert of(0, 1.2, touch_within=0).positions[1, 0] == 1.2e-6


def test_what_is_meant_is_left(tmp_path):
    sample, _ = read_sample(tmp_path, [[0, 0, 0], [1.206, 0, 0]])  # half a per cent apart
    assert sample.info["touching"]["contacts"] == 0
    # at rest a thousandth is touching; of grains that move against each other only a rounding is
    x, radii = np.array([[0, 0, 0], [1.2005, 0, 0]]), [R, R]
    assert read_sample(tmp_path, x, radii, digits=7)[0].info["touching"]["contacts"] == 1
    moving = [[0, 0, 0], [-1, 0, 0]]
    assert read_sample(tmp_path, x, radii, moving, digits=7)[0].info["touching"]["contacts"] == 0
    wide = read_sample(tmp_path, x, radii, moving, digits=7, touch_within=1e-3)[0]
    assert wide.info["touching"]["contacts"] == 1
    x = [[0.6, 5, 5], [1.8, 5, 5], [9.401, 5, 5]]
    cell = {"kind": "periodic", "size": ["10 um"] * 3}
    assert read_sample(tmp_path, x, boundary=cell, digits=3)[0].info["touching"]["contacts"] == 2


def test_moving_grains_of_all_digits(tmp_path):
    """Every second contact of a file of 17 digits would be lost, as of one with few."""
    moving = np.random.default_rng(5).normal(size=(30, 3)) * 1e-3
    table = aggregate(np.full(30, R)), np.full(30, R), moving
    assert read_sample(tmp_path, *table, digits=17)[0].info["touching"]["contacts"] == 29
    # whose rounding is nearly a hundredth of their diameter
    radii = np.full(60, 0.1)
    x = 0.1 / R * aggregate(np.full(60, R))
    touching = read_sample(tmp_path, x, radii, digits=3)[0].info["touching"]
    assert (touching["contacts"], touching["fragments"]) == (59, 1)


def test_a_sample_in_equilibrium_keeps_its_chance_gaps(tmp_path):
    cake = samples.make(make_scene(sample={"kind": "rbd", "grains": 200, "seed": 2}))
    far = [[1e3, 0, 0], [1e3 + 1.2005, 0, 0]]
    x = np.concatenate([cake.positions * 1e6, far])
    sample, _ = read_sample(tmp_path, x, digits=8)
    np.testing.assert_allclose(sample.positions * 1e6, x, atol=1e-8)
    assert "done" not in sample.info["touching"]


def test_deep_overlaps_are_named_before_a_run(tmp_path):
    sample, scene = read_sample(tmp_path, [[0, 0, 0], [1.188, 0, 0], [2.376, 0, 0]])
    (text,) = sample.info["remarks"]
    assert "2 of 2 contacts overlap by more than 5 times" in text and "72.2 times" in text
    assert "sample.touch_within: 0.011 puts them" in text
    assert text == f"sample: {deep_overlaps(sample, Materials(scene))}"
    sample, scene = read_sample(
        tmp_path, [[0, 0, 0], [1.188, 0, 0], [2.376, 0, 0]], touch_within=0.011
    )
    np.testing.assert_allclose(overlaps(sample, scene), 1.0, atol=2e-3)
    assert not deep_overlaps(sample, Materials(scene))


def test_a_guard_names_deep_overlaps_of_the_start():
    scene = load(FOLDER / "agg_overlap_1percent" / "scene.yaml")
    run = METHOD.build(scene, METHOD.make_sample(scene))
    start = run.measure()
    run.advance(10)
    text = "of the energy .*1.00%. At the start 200 of 201 contacts overlap .* 72.6 times.*: they "
    text += "push the grains apart. .*touch_within: 0.011 .* try a smaller numerics.time_step"
    with pytest.raises(GuardStop, match=text):
        ledger.check(run, run.measure(), Start.from_measurement(start))


@pytest.mark.parametrize("spacing", [1e-9, 1e-10, 5e-8, 1e-6])
def test_the_rounding_of_numbers(spacing):
    x = np.round(np.random.default_rng(3).uniform(-5e-5, 5e-5, (50, 3)) / spacing) * spacing
    digits = 10.0 ** np.floor(np.log10(spacing * 1.001))  # 5e-8 has the digits of 1e-8
    assert rounding(x, 1e-6) == pytest.approx(min(digits, 1e-6))
    assert rounding(x, 1.0) == pytest.approx(digits)  # metres, of which a micrometre is little
    assert rounding(x + np.pi * 1e-6, 1e-6) < 1e-14


FOLDER = Path(__file__).parent / "cases"

# number of grains, position of the last one [um]; further: radius of the last one [um], numbers of
# materials, a part of the remarks, the edges of the cell [um], the contacts of a single fragment
# with its radius of gyration [um]
READ = {
    "agg_overlap_1percent": (200, None, {"remark": "200 of 201 contacts overlap by more than 5"}),
    "agg_touch_6digits": (200, None, {"contacts": 199, "remark": "98 of 199 pairs"}),
    "agg_touch_min": (6, (5.6083, -1.1717, -0.8125), {"contacts": 5, "remark": "3 of 5 pairs"}),
    "check_keepbox_chain": (
        5,
        (2.8, 5, 5),
        {"edges": (10, 10, 10), "contacts": 4, "gyration": 1.7592},
    ),
    "csv_semicolon": (2, (1.2, 0, 0), {"radius": 0.6}),
    "csv_unit_parens": (2, (1.2, 0, 0), {}),
    "data_ellipsoid_nohint": (2, (2.2, 5, 5), {"radius": 0.6, "remark": "ellipsoid alone fits"}),
    "data_header_comment": (2, (2.2, 5, 5), {"radius": 0.6}),
    "data_indented": (2, (2.2, 5, 5), {"radius": 0.6}),
    "data_typelabels": (2, (2.2, 5, 5), {"radius": 0.6}),
    "dump_element": (2, (2.2, 5, 5), {"radius": 0.6}),
    "dump_fragment": (5, (12.8, 5, 5), {"contacts": 4, "gyration": 1.7592}),
    "dump_general_triclinic": (2, (2.2, 9, 5), {"remark": "its cell is tilted by xy = 3 µm"}),
    "dump_gz": (2, (2.2, 5, 5), {}),
    "dump_image_flags": (
        5,
        (12.8, 5, 5),
        {"contacts": 4, "gyration": 1.7592, "remark": "ix iy iz put 3 of its 5 grains outside"},
    ),
    "dump_lj_units": (2, (2.2, 5, 5), {"contacts": 1, "radius": 0.6}),
    "dump_old_nobc": (2, (2.2, 5, 5), {"remark": "are read as id type xs ys zs"}),
    "dump_triclinic_scaled": (2, (4.9, 9, 5), {"remark": "its cell is tilted by xy = 3 µm"}),
    "dump_xsu": (2, (10.9, 5, 5), {"radius": 0.6}),
    "list_aggregate_gen": (200, None, {}),
    "list_count_first": (3, (2.4, 0, 0), {"radius": 0.6, "remark": "are read as x y z r"}),
    "list_header_ws": (2, (1.2, 0, 0), {"radius": 0.6}),
    "list_mstm": (3, (2.4, 0, 0), {"radius": 0.6, "remark": "are read as r x y z"}),
    "mercury_data": (4, (3.5, 0, 0), {"contacts": 3, "radius": 0.5}),
    "xyz_blank_frames": (2, (0, 0, 6.2), {}),
    "xyz_bom": (2, (0, 0, 1.2), {}),
    "xyz_fortranD": (2, (1.2, 0, 0), {}),
    "xyz_id_first": (3, (2.4, 0, 0), {}),
    "xyz_no_species_zigzag": (3, (2.2, 2.4, 0), {"radius": 0.6}),
    "xyz_pbc_keepbox": (2, (0.9, 5, 5), {"edges": (10, 10, 10)}),
    "xyz_radius_lost": (4, (4.5, 0, 0), {"radius": 0.9}),
    "yade_two_materials": (2, (1.2, 0, 0), {"radius": 0.6, "materials": [0, 1]}),
}
REFUSED = {
    "data_bpm_nohint": "bpm/sphere, .* fit .*sample.style: bpm/sphere",
    # points at 1 µm, closer than two grains of the material: not diameters of 1 µm
    "data_full_nohint_q": "grains 2 and 3 .* 0.833 diameters.* How .*: .* full alone fits",
    "dump_triclinic_keepbox": "tilted by xy = 3 µm; a cell here .* tilted along x with z",
    "dump_type2": "its type 2 has no material in the scene, .*: 1 default",
    "xyz_count_too_small": "line 1 announces 2 grains, and line 5 .* is one line more",
}


def sample(name):
    return samples.make(load(FOLDER / name / "scene.yaml"))


@pytest.mark.parametrize("name", READ)
def test_it_is_read(name):
    grains, last, keys = READ[name]
    found = sample(name)
    assert len(found) == grains
    if last is not None:  # to the nanometre: grains that touch are put into equilibrium contact
        np.testing.assert_allclose(found.positions[-1], np.array(last) * 1e-6, atol=1e-9)
    if "radius" in keys:
        radius = 0.6e-6 if found.radii is None else found.radii[-1]
        assert radius == pytest.approx(keys["radius"] * 1e-6, rel=1e-9)
    if "materials" in keys:
        assert found.materials.tolist() == keys["materials"]
    if "edges" in keys:
        room = np.reshape(found.info["room"], (3, 2))
        np.testing.assert_allclose(np.ptp(room, axis=1), np.array(keys["edges"]) * 1e-6, rtol=1e-9)
    if "contacts" in keys:
        assert found.info["network"] == {"contacts": keys["contacts"], "fragments": 1}
    if "gyration" in keys:
        assert found.info["radius_of_gyration"] == pytest.approx(keys["gyration"] * 1e-6, rel=1e-3)
    assert keys.get("remark", "") in " ".join(found.info.get("remarks", ()))


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused(name):
    with pytest.raises(DustError, match=REFUSED[name]):
        sample(name)


def test_an_aggregate_of_a_generator_holds_together():
    """Without a drive it stays as it is: all contacts, and hardly a motion."""
    scene = load(FOLDER / "agg_touch_6digits" / "scene.yaml")
    sim = build(scene, samples.make(scene))
    sim.advance(300)
    found = sim.ledger.measure_energies()
    assert found["contacts"] == 199
    # distances are met within a thousandth of delta0, whose square is the energy that is left
    moved = found["kinetic_translation"] + found["kinetic_rotation"]
    assert moved < 1e-6 * abs(found["potential"].sum())


def test_every_case_has_a_line():
    assert {path.name for path in FOLDER.iterdir()} == {*READ, *REFUSED}
