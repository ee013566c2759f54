"""Bodies of the continuum against closed forms: masses, lattices, layers, the weight of a bed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.spatial import cKDTree

from dusttaichi.continuum import samples as continuum
from dusttaichi.continuum.physics import elasticity
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.samples import AnyParticles, Matter, lattice
from dusttaichi.continuum.scene.boundary import ContinuumBoundary
from dusttaichi.continuum.scene.material import ContinuumMaterial
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import WALLS
from dusttaichi.results.roles import DUST, FIXED, RIGID
from dusttaichi.scene import Scene

SPEC = TypeAdapter(AnyParticles)
BOUNDARY = TypeAdapter(ContinuumBoundary)
SPACING = 1e-4
MATTER = {
    d: Matter(dimension=d, spacing=SPACING, solid=2000.0, filling_factor=0.15, least=0.1, most=0.58)
    for d in (2, 3)
}
SIZE = {2: ["4 mm", "2.5 mm"], 3: ["1 mm", "1.1 mm", "0.9 mm"]}
BALL = {"kind": "sphere", "diameter": "1 mm"}
BEAD = {"kind": "rigid", "diameter": "1.1 mm", "density": "2540 kg/m^3"}


def make_body(dimension, **block):
    return continuum.make_particles(SPEC.validate_python(block), MATTER[dimension])


def scene(sample, **blocks):
    """A scene of dust_g09 with this sample block."""
    data = {"name": "free", "method": "continuum", "material": "dust_g09", "stop": {"steps": 1}}
    data |= {"numerics": {"spacing": "0.1 mm"}, "sample": sample, **blocks}
    return Scene.from_dict({key: value for key, value in data.items() if value is not None})


def add_walls(particles, **faces):
    boundary = BOUNDARY.validate_python({"kind": "faces", **faces})
    return continuum.with_faces(particles, boundary)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", ["auto", "glass"])
def test_the_mass_of_a_block_is_exact_and_its_particles_are_alike(dimension, kind):
    block = make_body(dimension, kind="block", size=SIZE[dimension], lattice=kind)
    size = np.array(block.info["size"])
    assert block.mass.sum() == pytest.approx(300.0 * size.prod(), rel=1e-12)
    assert np.ptp(block.volume) < 1e-9 * block.volume[0]
    inside = block.position[:, list(block.axes)]
    low = np.append(-size[:-1] / 2, -size[-1])
    assert (inside >= low).all() and (inside <= low + size).all()
    assert block.info["filling_factor"] == pytest.approx(0.15)


@pytest.mark.parametrize(("dimension", "neighbours"), [(2, 6), (3, 12)])
def test_lattices_have_their_neighbours_at_the_spacing(dimension, neighbours):
    size = np.full(dimension, 20 * SPACING)
    points = lattice.fill(size, SPACING, "triangular" if dimension == 2 else "hexagonal")
    tree = cKDTree(points + size / 2, boxsize=size)  # it goes on across its faces
    distance, _ = tree.query(points + size / 2, k=neighbours + 1)
    # the lattice is stretched by up to half a pitch over twenty
    np.testing.assert_allclose(distance[:, 1:], SPACING, rtol=0.06)
    count = size.prod() / lattice.volume_of(SPACING, dimension)
    assert len(points) == pytest.approx(count, rel=0.08)


def test_a_glass_has_no_lattice_and_no_pairs():
    size = np.full(2, 30 * SPACING)
    points = lattice.fill(size, SPACING, "glass", seed=3)
    distance, _ = cKDTree(np.mod(points, size), boxsize=size).query(np.mod(points, size), k=2)
    assert distance[:, 1].min() > 0.55 * SPACING and distance[:, 1].std() > 0.01 * SPACING
    assert np.array_equal(points, lattice.fill(size, SPACING, "glass", seed=3))


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_shell_that_implodes_changes_no_volume(dimension):
    """The hole's surface moves at the speed given, and r^(d - 1) v_r is the same everywhere."""
    block = {"kind": "sphere", "diameter": "2 mm", "hole": "1.6 mm", "radial_velocity": "-10 m/s"}
    shell = make_body(dimension, **block)
    away = np.linalg.norm(shell.position, axis=1)
    outwards = (shell.position * shell.velocity).sum(axis=1) / away
    assert outwards * away ** (dimension - 1) == pytest.approx(-10.0 * 8e-4 ** (dimension - 1))
    assert np.linalg.norm(shell.velocity, axis=1) == pytest.approx(-outwards)  # no other motion
    with pytest.raises(ValidationError, match=r"for rings and shells; give a hole"):
        make_body(dimension, **block | {"hole": "0 m"})


@pytest.mark.parametrize("dimension", [2, 3])
def test_spheres_have_the_mass_of_their_shape(dimension):
    exact = np.pi / 4 * 1.1e-3**2 if dimension == 2 else np.pi / 6 * 1.1e-3**3
    dust = make_body(dimension, kind="sphere", diameter="1.1 mm")
    bead = make_body(dimension, **BEAD)
    assert dust.mass.sum() == pytest.approx(300.0 * exact, rel=1e-12)
    assert bead.mass.sum() == pytest.approx(2540.0 * exact, rel=1e-12)
    assert bead.volume.sum() == pytest.approx(exact, rel=1e-12)
    # before they are scaled the lattice's volumes are right within a few per cent
    assert bead.volume[0] == pytest.approx(lattice.volume_of(SPACING, dimension), rel=0.05)
    body = bead.bodies[0]
    assert body.rigid and body.mass == pytest.approx(bead.mass.sum())
    about_y = {2: 0.5, 3: 0.4}[dimension] * body.mass * 0.55e-3**2
    assert body.inertia[1, 1] == pytest.approx(about_y)
    x = bead.position
    of_points = (bead.mass * (x[:, 0] ** 2 + x[:, 2] ** 2)).sum()
    assert of_points == pytest.approx(about_y, rel=0.05)


@pytest.mark.parametrize("hole", [0.0, 6.0])
def test_circles_have_a_round_rim(hole):
    """Every particle of the rim is as far from the axis; areas and distances are those of a
    lattice, but for the rounding of the number of circles (5 and 21) and of their particles."""
    points = lattice.circles(8e-3, 1e-3 * hole, 0.2e-3)
    radius, nearest = np.hypot(*points.T), cKDTree(points).query(points, k=2)[0][:, 1]
    rim = radius > radius.max() - 0.1e-3
    assert rim.sum() > 100 and np.ptp(radius[rim]) < 1e-12
    assert 4e-3 - radius.max() == pytest.approx(0.093e-3, rel=0.1)
    area = np.pi * (4e-3**2 - (0.5e-3 * hole) ** 2)
    assert len(points) == pytest.approx(area / lattice.volume_of(0.2e-3, 2), rel=0.02)
    assert 0.85 * 0.2e-3 < nearest.min() and nearest.max() < 1.1 * 0.2e-3


def test_the_bead_of_the_paper():
    """G09 section 4.1: 2.4e-3 kg/m, 64421 particles in 8 x 5 mm^2 at 26.8 um (section 5)."""
    matter = Matter(2, 26.8e-6, 2000.0, 0.15)
    bed = {"kind": "block", "size": ["8 mm", "5 mm"]}
    impact = {"kind": "impact", "target": bed, "projectile": BEAD, "speed": "0.65 m/s"}
    sample = continuum.make_particles(SPEC.validate_python(impact), matter)
    bead = sample.role == RIGID
    assert sample.mass[bead].sum() == pytest.approx(2.414e-3, rel=1e-3)
    assert (~bead).sum() == pytest.approx(64421, rel=0.01)
    assert bead.sum() == pytest.approx(1519, rel=0.01)
    assert sample.bodies[1].velocity[2] == -0.65
    assert sample.bodies[1].centre[2] == pytest.approx(0.55e-3 + 26.8e-6)
    assert sample.velocity[bead, 2] == pytest.approx(-0.65)


def test_layers_hold_dust_and_rigid_faces_are_planes():
    block = make_body(2, kind="block", size=SIZE[2])
    bed = add_walls(block, bottom={"layer": "0.3 mm"}, x_min={"layer": "0.6 mm"}, x_max="mirror")
    assert set(bed.role) == {DUST, FIXED} and len(bed) == len(block)
    is_fixed = bed.role == FIXED
    assert (bed.position[is_fixed & (bed.face == WALLS.index("bottom")), 2] < -2.2e-3).all()
    area = 4e-3 * 0.3e-3 + (2.5e-3 - 0.3e-3) * 0.6e-3
    assert bed.volume[is_fixed].sum() == pytest.approx(area, rel=0.08)
    assert bed.room[0] == pytest.approx([-1.4e-3, 2e-3], abs=0.5 * SPACING)
    assert np.isnan(bed.room[2, 1])
    assert bed.room[2, 0] == pytest.approx(-2.2e-3, abs=0.5 * SPACING)
    inside = bed.position[~is_fixed]  # a layer ends between two rows
    assert inside[:, 2].min() > bed.room[2, 0] > bed.position[bed.face == 4, 2].max()
    pressed = add_walls(block, bottom="rigid", top="rigid", periodic=["x"], wall_speed="0.1 m/s")
    assert pressed.room[0] == pytest.approx([-2e-3, 2e-3])
    assert pressed.room[2] == pytest.approx([-2.5e-3, 0.0])
    assert [body.name for body in pressed.bodies] == ["block"] and len(pressed) == len(block)
    apart = add_walls(block, bottom="rigid", gap="0.1 mm")
    assert apart.room[2, 0] == pytest.approx(-2.6e-3)


def test_several_bodies_fly_and_turn():
    flying = {"position": ["2 mm", "0 mm"], "velocity": ["-1 m/s", "0 m/s"], "spin": "100 rad/s"}
    both = make_body(2, kind="several", bodies=[BALL, BALL | flying])
    second = both.body == 1
    assert both.mass[second] @ both.velocity[second] == pytest.approx(
        np.array([-1.0, 0, 0]) * both.mass[second].sum(), abs=1e-9
    )
    right = second & (both.position[:, 0] > 2.3e-3)
    assert (both.velocity[right, 2] > 0).all()  # x turns towards z
    apart = both.position[second] - both.bodies[1].centre
    turning = np.linalg.norm(both.velocity[second] - [-1.0, 0, 0], axis=1)
    assert turning == pytest.approx(100 * np.linalg.norm(apart, axis=1))
    with pytest.raises(DustError, match="overlap"):
        make_body(2, kind="several", bodies=[BALL, BALL])


def test_layers_and_scatter_of_the_filling_factor():
    layers = [{"thickness": "0.5 mm", "filling_factor": 0.25}]
    layered = make_body(2, kind="block", size=SIZE[2], filling_factor={"layers": layers})
    phi = layered.density / 2000.0
    upper = layered.position[:, 2] > -0.5e-3
    assert np.all(phi[upper] == 0.25) and np.all(phi[~upper] == 0.15)
    rough = {"sigma": 0.01, "length": "0.2 mm", "seed": 2}
    noisy = make_body(2, kind="block", size=SIZE[2], filling_factor=rough)
    phi = noisy.density / 2000.0
    assert phi.std() == pytest.approx(0.01, rel=1e-9) and phi.mean() == pytest.approx(0.15)
    assert np.ptp(noisy.volume) < 1e-9 * noisy.volume[0]
    near = cKDTree(noisy.position).query(noisy.position, k=2)[1][:, 1]
    assert np.corrcoef(phi, phi[near])[0, 1] > 0.6  # alike over the length, two spacings
    with pytest.raises(DustError, match="allowed with this material"):
        make_body(2, kind="block", size=SIZE[2], filling_factor={"sigma": 0.1})


G09 = MaterialNumbers.from_material(ContinuumMaterial.model_validate("dust_g09"))


def test_a_bed_carries_its_weight():
    bed = continuum.at_rest_under_gravity(make_body(2, kind="block", size=SIZE[2]), 9.81, G09)
    weight = 300.0 * 9.81 * -bed.position[:, 2]
    pressure = elasticity.elastic_pressure(bed.density, bed.reference, G09)
    # the pressure is 1e-5 of the modulus: ten digits of it are left
    assert pressure - bed.deviator[:, 2] == pytest.approx(weight, rel=1e-9)
    assert pressure == pytest.approx(weight / (5 / 3), rel=1e-9)
    assert np.abs(bed.deviator[:, :3].sum(axis=1)).max() < 1e-12
    assert bed.info["gravity_carried"] == 1.0
    weak = replace(G09, p_m=1.0, T_0=1.0)
    collapsing = continuum.at_rest_under_gravity(
        make_body(2, kind="block", size=SIZE[2]), 9.81, weak
    )
    assert collapsing.info["gravity_carried"] < 0.9


def test_particles_from_a_file(tmp_path):
    """A file may have a cell: a triangular lattice repeats after a whole number of spacings."""
    path = tmp_path / "p.csv"
    path.write_text("x,z,mass,density,vx\n0,0,1e-6,300,1\n100,0,2e-6,310,0\n")
    sample = make_body(2, kind="explicit", file=str(path), units="um")
    assert sample.position[1] == pytest.approx([1e-4, 0, 0]) and sample.velocity[0, 0] == 1.0
    assert sample.density.tolist() == [300.0, 310.0]
    path.write_text("x,z,mass\n0,0,1e-6\n0,0,1e-6\n")
    with pytest.raises(DustError, match="same position"):
        make_body(2, kind="explicit", file=str(path))
    positions = [((i + 0.25 + 0.5 * (k % 2)) * 1e-4, k * 0.87e-4) for i in range(8) for k in (0, 1)]
    path.write_text("x,z,mass\n" + "\n".join(f"{x},{z},1e-6" for x, z in positions))
    placed = make_body(2, kind="explicit", file=str(path), size=["0.8 mm", "0.2 mm"])
    assert np.ptp(placed.room[0]) == pytest.approx(8e-4)
    with pytest.raises(DustError, match="sample.size: .* use a larger size"):
        make_body(2, kind="explicit", file=str(path), size=["0.5 mm", "0.2 mm"])


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ({"kind": "block", "size": ["8 m", "5 m"]}, "MOST|memory|particles"),
        ({"kind": "block", "size": ["8 um", "5 um"]}, "smaller than one particle"),
        ({"kind": "sphere", "diameter": "1 um"}, "smaller than one particle"),
    ],
)
def test_samples_that_cannot_be(block, message):
    with pytest.raises(DustError, match=message):
        make_body(2, **block)


@pytest.mark.parametrize(
    "faces",
    [
        {},
        {"bottom": "mirror", "periodic": ["z"]},
        {"wall_speed": "1 m/s", "bottom": "rigid"},
        {"bottom": {"layer": "0 mm"}},
        {"bottom": "mirror", "gap": "-1 mm"},
        {"bottom": "rigid", "overhang": "1 mm"},
    ],
)
def test_faces_that_cannot_be(faces):
    with pytest.raises(ValidationError):
        BOUNDARY.validate_python({"kind": "faces", **faces})


def test_what_does_not_go_with_the_dimension():
    space = SimpleNamespace(dimension=3)
    block = SPEC.validate_python({"kind": "block", "size": SIZE[2], "lattice": "triangular"})
    assert {path for path, _ in block.conflicts(space)} == {"size", "lattice"}
    disc = {"kind": "elastic", "density": "1 g/cm^3", "bulk_modulus": "1 MPa", "shear_ratio": 0.5}
    ball = SPEC.validate_python(disc | {"diameter": "1 mm", "lattice": "circles"})
    assert [path for path, _ in ball.conflicts(space)] == ["lattice"]
    with pytest.raises(ValidationError, match="circles are for discs and rings"):
        SPEC.validate_python(disc | {"size": SIZE[2], "lattice": "circles"})
    boundary = BOUNDARY.validate_python({"kind": "faces", "y_min": "mirror"})
    assert [path for path, _ in boundary.conflicts(2)] == ["y_min"]


def test_a_scene_needs_neither_faces_nor_dust_nor_a_material_of_no_dust():
    particles = continuum.make(scene(BALL))
    assert np.isnan(particles.room).all() and (particles.role == DUST).all()
    with pytest.raises(DustError, match="y_min.*no such face"):
        scene(BALL, boundary={"kind": "faces", "y_min": "mirror"})
    ring = {"kind": "elastic", "diameter": "1 mm", "density": "1 g/cm^3"}
    ring |= {"young_modulus": "1 MPa", "poisson_ratio": 0.4}
    assert scene(ring, material=None).material.name == "dust_g09"
    with pytest.raises(DustError, match="material"):
        scene(BALL, material=None)


def test_a_mirror_that_should_move_is_refused():
    """Its images stay where they are: at the top in the scene itself, or in one of its stages."""
    faces = {"kind": "faces", "top": "mirror", "bottom": "rigid"}
    with pytest.raises(DustError, match="top.*a mirror does not move"):
        scene(BALL, boundary=faces | {"wall_speed": "1 m/s"})
    stage = {"name": "down", "drive": {"wall_speed": "1 m/s"}, "stop": {"steps": 1}}
    with pytest.raises(DustError, match="top.*a mirror does not move"):
        scene(BALL, boundary=faces, stages=[stage], stop=None)
    strip = {"kind": "faces", "bottom": "rigid", "periodic": ["x"]}
    block = {"kind": "block", "size": ["0.2 mm", "1 mm"]}
    with pytest.raises(DustError, match=r"boundary.periodic: .* 200 µm wide along x.* 338 µm"):
        continuum.make(scene(block, boundary=strip))
