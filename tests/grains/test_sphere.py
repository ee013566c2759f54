"""The rigid sphere among the grains, and gravity: closed forms, conservation, one very large grain.

Scenes of one make stand together: what is compiled depends on their structure alone, so those
without gravity have one of 0 m/s^2, and all in double precision follow what each contact loses.
"""

from functools import cache

import bits
import numpy as np
import pytest
import reference as ref
from scenes import FAR, RADIUS, make_scene, polydisperse, sample_of, two_materials

from dusttaichi import analysis, plots, samples, units
from dusttaichi.analysis import tabulate
from dusttaichi.errors import DustError
from dusttaichi.grains.build import build, make
from dusttaichi.method import Start
from dusttaichi.physics.contact import constants
from dusttaichi.running import execute
from dusttaichi.running.ledger import ledger
from dusttaichi.scene.boundary import Drive

FOLLOWED = {"variables": ["loss", "grain_loss", "sliding_force"]}
BALL = 6e-6  # radius of the sphere [m], ten grains
WEIGHTLESS = {"acceleration": ["0 m/s^2"] * 3}
SILICATE = ref.SILICATE


def vector(values, unit):
    return [f"{a:.17g} {unit}" for a in values]


def scene_with(position, velocity=None, speed=None, spin=(0, 0, 0), **blocks):
    sphere = {"radius": "6 um", "position": vector(position, "m")} | blocks.pop("sphere", {})
    if speed is not None:
        sphere["speed"] = vector(speed, "m/s")
    else:
        sphere |= {"velocity": vector(velocity or (0, 0, 0), "m/s"), "spin": vector(spin, "rad/s")}
    return make_scene(sphere=sphere, **{"gravity": WEIGHTLESS, "output": FOLLOWED, **blocks})


def cluster():
    """A hexagon of seven grains in contact at z = 0, and two more on top of it."""
    a = 2 * RADIUS - ref.numbers().delta0
    ring = [(a * np.cos(k * np.pi / 3), a * np.sin(k * np.pi / 3), 0.0) for k in range(6)]
    up = [(a / 2, a / (2 * 3**0.5), a * (2 / 3) ** 0.5), (-a / 2, a / (2 * 3**0.5), a * 1.02)]
    return np.array([(0.0, 0.0, 0.0), *ring, *up])


HIT = {"position": (0.7e-6, 0.3e-6, 8.0e-6), "velocity": (0.05, 0.0, -2.0), "spin": (1e5, 5e4, 2e5)}


def state(sim):
    """Positions, velocities and spins of grains, then of the sphere, now, internal units."""
    x, v, w = sim.motion.measure()
    ball = sim.sphere.measure_motion()
    return tuple(
        np.vstack([grain_values, sphere_value])
        for grain_values, sphere_value in zip((x, v, w), ball, strict=True)
    )


def momenta(sim):
    x, v, w = state(sim)
    m = np.append(np.full(sim.bodies.count, sim.bodies.unit_mass), sim.sphere.mass)[:, None]
    inertia = np.append(np.full(sim.bodies.count, sim.bodies.unit_inertia), sim.sphere.inertia)[
        :, None
    ]
    linear, turning = m * v, np.cross(x, m * v) + inertia * w
    return linear.sum(0), turning.sum(0), np.abs(linear).sum(), np.abs(turning).sum()


def measure_opening(sim, start):
    """By how much the ledger is open, as a share of what has gone through the system."""
    return ledger(sim.ledger.measure(), start)[1]


# Equal grains, open, a sphere, constant gravity.


@cache
def hit(precision="f64"):
    followed = FOLLOWED if precision == "f64" else {}
    scene = scene_with(**HIT, output=followed, numerics={"precision": precision})
    sim = make(scene, sample_of(cluster()))
    start = Start.from_measurement(sim.ledger.measure())
    first = momenta(sim)
    sim.advance(4000)
    return state(sim), first, momenta(sim), measure_opening(sim, start), sim.ledger.measure().parts


def test_free_fall_is_a_parabola():
    """Leapfrog is exact under a constant force; the error is rounding over 1000 steps."""
    g, v = np.array([1e5, 0.0, -2e5]), np.array([0.3, 0.2, 1.0])
    scene = scene_with((0, 0, 2e-5), v.tolist(), gravity={"acceleration": vector(g, "m/s^2")})
    sim = build(scene, sample_of([[0, 0, 0]], [v]))
    start = Start.from_measurement(sim.ledger.measure())
    sim.advance(1000)
    t = sim.time * units.TIME
    x, u, _ = state(sim)
    way = v * t + 0.5 * g * t**2
    np.testing.assert_allclose(x * units.LENGTH, [way, way + [0, 0, 2e-5]], rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(u * units.SPEED, [v + g * t] * 2, rtol=1e-12)
    mass = sim.sphere.mass + sim.bodies.mass
    work = mass * units.MASS * g @ way
    assert sim.ledger.measure().work * units.ENERGY == pytest.approx(work, rel=1e-9)
    assert abs(measure_opening(sim, start)) < 1e-9


@pytest.mark.parametrize("adhesion", [1.0, 0.25])
def test_force_of_one_grain_is_that_of_the_reduced_radius(adhesion):
    """JKR with R = r1 r2/(r1 + r2), at an overlap of twice that at rest."""
    scene = scene_with((0, 0, 0), sphere={"adhesion": adhesion})
    R = RADIUS * BALL / (RADIUS + BALL)
    gamma, E_star = adhesion * SILICATE["gamma"], constants.reduced_modulus(scene.material)
    a0 = constants.equilibrium_contact_radius(gamma, R, E_star)
    delta0, F_c = constants.equilibrium_overlap(a0, R), constants.pull_off_force(gamma, R)
    direction = np.array([0.6, 0.0, 0.8])
    x = (RADIUS + BALL - 2 * delta0) * direction
    sim = build(scene, sample_of([x]))
    s = max(np.roots([3, 0, 0, -2, -2.0]).real)  # 3 s^4 - 2 s = 2
    expected = 4 * F_c * (s**6 - s**3) * direction
    # positions are known to 1e-16 of a micrometre and the overlap to 1e-6 of itself
    np.testing.assert_allclose(
        sim.motion.sum_loads()[0][0] * units.FORCE, expected, rtol=1e-5, atol=1e-14
    )
    np.testing.assert_allclose(sim.sphere.load()[0], -sim.motion.sum_loads()[0][0], rtol=1e-14)


def test_momentum_and_ledger_of_a_hit():
    _, momentum_before, momentum_after, residual, energies = hit()
    assert energies["loss_sphere"].sum() > 0 and energies["sphere_kinetic"] > 0
    for k in (0, 1):
        assert np.abs(momentum_after[k] - momentum_before[k]).max() < 1e-12 * momentum_after[k + 2]
    assert abs(residual) < 2e-3


def test_a_restored_sphere_goes_on_with_the_same_bits():
    scene = scene_with(**HIT)
    moving = make(scene, sample_of(cluster()))
    moving.advance(1500)
    kept = moving.state()
    moving.advance(500)
    expected, m = state(moving), moving.measure()
    moving.restore(kept)
    moving.advance(500)
    for first, second in zip(expected, state(moving), strict=True):
        assert np.array_equal(first, second)
    assert moving.measure().parts["sphere_work"] == m.parts["sphere_work"]


def test_a_driven_sphere_keeps_its_way_and_its_work_closes_the_ledger():
    scene = scene_with((0, 0, 7.85e-6), speed=(0, 0, -0.5))
    sim = build(scene, sample_of(cluster()))
    start = Start.from_measurement(sim.ledger.measure())
    sim.advance(2500)
    way = 0.5 * sim.time
    sim.drive(Drive.model_validate({"sphere_speed": ["0 m/s", "0.2 m/s", "1 m/s"]}))
    time_before = sim.time
    sim.advance(2500)
    x, v, w = sim.sphere.measure_motion()
    up = np.array([0.0, 0.2, 1.0]) * (sim.time - time_before)
    np.testing.assert_allclose(x, [0, 0, 7.85 - way] + up, rtol=1e-12)
    assert v.tolist() == [0.0, 0.2, 1.0] and w.tolist() == [0.0, 0.0, 0.0]
    m = sim.ledger.measure()
    assert m.parts["sphere_work"] > 0 and m.work == m.parts["sphere_work"]
    assert abs(measure_opening(sim, start)) < 5e-3


# Two bodies that fly at each other: what the series says of each.


def test_bodies_share_the_angular_momentum():
    """One grain against a pair, off the centre: the grains of each body stay its own."""
    body = {"kind": "explicit", "positions": [["0 m"] * 3, ["0 m", "1.1998 um", "0 m"]]}
    single = {"kind": "explicit", "positions": [["0 m"] * 3]}
    sample = {"kind": "collision", "target": body, "projectile": single, "speed": "0.2 m/s"}
    sample |= {"impact_parameter": 0.3, "gap": "1 nm", "orientation": "as given"}
    # the sphere rests far away
    scene = scene_with((0, 0, 1e-3), sample=sample, numerics={"step_fraction": 0.1})
    moving = make(scene, samples.make(scene))
    assert moving.sizes()["body"] == ("target", "projectile")
    first = moving.series(moving.measure(), None)
    moving.advance(1500)
    last = moving.series(moving.measure(), None)
    mass = moving.bodies.mass * np.array([[2.0], [1.0]])
    turned = []
    for record in (first, last):
        linear = mass * record["body_velocity"]
        scale = np.abs(linear).sum()
        np.testing.assert_allclose(linear.sum(0), record["momentum"], atol=1e-12 * scale)
        orbital = np.cross(record["body_position"], linear)
        both = orbital + record["body_angular_momentum"]
        np.testing.assert_allclose(
            both.sum(0), record["angular_momentum"], atol=1e-12 * np.abs(orbital).sum()
        )
        turned.append(np.abs(record["body_angular_momentum"]).max(axis=1))
    assert (turned[0] == 0.0).all() and (turned[1] > 0.0).all()


# A run on disk: resumed with the same bits, measured, drawn.


def fall(folder, steps, **options):
    x = [vector(row, "m") for row in cluster()]
    scene = scene_with(
        (0.0, 0.0, 7.85e-6),
        (0.0, 0.0, -5.0),
        sample={"kind": "explicit", "positions": x},
        stop={"steps": steps},
        output={"series": {"steps": 20}, "snapshots": {"steps": 200}, "forces": True} | FOLLOWED,
    )
    execute(scene, folder, **options)
    return folder


@pytest.fixture(scope="module")
def on_disk(tmp_path_factory):
    return fall(tmp_path_factory.mktemp("fall") / "whole", 600)


def test_a_run_on_disk(on_disk, tmp_path):
    uninterrupted, resumed = on_disk, fall(fall(tmp_path / "parts", 400), 600, resume=True)
    bits.assert_same_bits(uninterrupted / "result.nc", resumed / "result.nc")
    with analysis.open_run(uninterrupted) as run:
        way = analysis.measure_penetration(run)
        assert way.radius == pytest.approx(BALL) and way.stop is None
        top = np.max(cluster()[:, 2]) + RADIUS
        assert way.surface == pytest.approx(top, rel=1e-12)
        # the curve begins at the surface, between two records
        assert way.time[0] == 0.0 and way.depth[0] == 0.0 and way.force[0] == 0.0
        assert way.velocity[0] == -way.speed and way.time[1] > 0.0
        # it has lost less than a hundredth of its speed: the depth is that of a straight way
        at = run.series.time.values[-1]
        assert way.depth[-1] == pytest.approx(top - 1.85e-6 + 5.0 * at, rel=1e-2)
        below = analysis.measure_column(run)
        assert below.sphere == pytest.approx(way.depth[-1], rel=1e-9)
        assert "largest depth of the sphere" in dict(
            r[:2] for r in tabulate(analysis.summarise(run))
        )
        assert {"sphere", "sphere_column"} <= set(plots.draw_figures(run))
        assert analysis.read_frame(run).sphere[3] == pytest.approx(BALL)
        plots.grains(run, color="uniform", dpi=40)


def test_what_the_sphere_touches(on_disk):
    """Its contacts carry the force on it; the parts of each make its force, and what they have lost
    since they formed is most of what was lost: some have opened before."""
    with analysis.open_run(on_disk) as run:
        touched = run.contacts(group="sphere_contacts")
        force, last = run.snapshots.sphere_force.values[-1], run.series.isel(time=-1)
        of_grains = run.snapshots.grain_loss.isel(snapshot=-1).sum("grain")
    assert len(touched.grain) == int(last.sphere_contact_count) > 0
    np.testing.assert_allclose(-touched.force.sum("sphere_contact"), force, rtol=1e-5)  # of f4
    push, across = touched.normal_force.values, touched.sliding_force.values
    size = np.sqrt(push**2 + np.sum(across**2, axis=1))
    np.testing.assert_allclose(size, np.linalg.norm(touched.force, axis=1), rtol=1e-5)
    assert (touched.overlap > 0.0).any() and float(last.loss_sphere.sum()) > 0.0
    lost = touched.loss.sum("sphere_contact").values
    assert (lost <= last.loss_sphere.values * (1.0 + 1e-9)).all()
    assert lost.sum() > 0.5 * float(last.loss_sphere.sum())
    # by grain: the sphere has no part; of damping the ledger has half a step less
    losses = (last.loss + last.loss_sphere).drop_sel(channel="damping")
    np.testing.assert_allclose(of_grains.sel(channel=losses.channel), losses, rtol=1e-9)


# The same in mixed precision.


@pytest.mark.long
def test_mixed_precision_of_a_hit():
    """Both sides of a contact take the same force, so momentum is kept to rounding of the sums in
    double precision; torques are rounded to 1e-7 of themselves."""
    _, momentum_before, momentum_after, residual, energies = hit("mixed")
    assert np.abs(momentum_after[0] - momentum_before[0]).max() < 1e-12 * momentum_after[2]
    assert np.abs(momentum_after[1] - momentum_before[1]).max() < 1e-7 * momentum_after[3]
    assert abs(residual) < 2e-3
    # the sphere weighs as much as a hundred times the grains, and hardly feels how they fly
    assert energies["sphere_kinetic"] == pytest.approx(hit()[4]["sphere_kinetic"], rel=1e-3)


# Grains of their own radius, of which the largest is the sphere.


def test_it_is_one_very_large_grain():
    """A sample whose last grain has its radius moves alike, but for rounding, which grows."""
    x, last = cluster(), np.array(HIT["position"])
    radii = np.append(np.full(len(x), RADIUS), BALL)
    v, w = np.zeros((10, 3)), np.zeros((10, 3))
    v[-1], w[-1] = HIT["velocity"], HIT["spin"]
    sample = polydisperse(np.vstack([x, last]), radii, None, v, w)
    sim = build(two_materials(boundary=FAR), sample)
    sim.advance(4000)
    sphere_state, expected = hit()[0], sim.motion.measure()
    for first, second in zip(sphere_state, expected, strict=True):
        np.testing.assert_allclose(first, second, rtol=0, atol=1e-6 * np.abs(second).max())


# Grains of their own radius and a sphere across a face of a periodic cell.


@pytest.mark.long  # pairs across faces: test_periodic
def test_across_a_face():
    """What stands across a face is hit as in open space."""
    edges = np.array([20e-6, 20e-6, 0.0])
    shift = np.array([10.2e-6, -9.7e-6, 0.0])
    x = cluster() + shift
    x -= edges * np.round(x / np.where(edges > 0, edges, 1.0))
    far = [[1e-6, 2e-6, -3e-6], [3e-6, -2e-6, -3e-6]]
    sample = polydisperse(np.vstack([x, far]), np.full(11, RADIUS))
    position = np.array(HIT["position"]) + shift
    cell = {"kind": "periodic", "axes": ["x", "y"], "size": ["20 um", "20 um", "fit"]}
    scene = scene_with(position.tolist(), HIT["velocity"], None, HIT["spin"], boundary=cell)
    sim = build(scene, sample)
    sim.advance(4000)
    _, v, w = state(sim)
    _, u, t = hit()[0]
    for first, second in ((v, u), (w, t)):
        both = np.vstack([first[:9], first[-1:]])
        np.testing.assert_allclose(both, second, rtol=0, atol=1e-5 * np.abs(second).max())


@pytest.mark.parametrize(
    "sphere, named",
    [
        ({"gap": "0 um", "position": ["0 um"] * 3}, "exactly one of position and gap"),
        ({"position": ["0 um"] * 3, "offset": ["1 um", "0 um"]}, "offset.*it belongs to gap"),
        ({"gap": "1 nm", "density": "1 g/cm^3", "mass": "1 pg"}, "sphere.mass"),
        ({"gap": "1 nm", "material": "iron"}, "sphere.material.*one of default is needed"),
        ({"gap": "1 nm", "radius": "0.1 um"}, "sphere.radius.*smaller than a grain"),
        ({"gap": "1 nm", "speed": ["1 m/s"] * 3, "spin": ["1 rad/s"] * 3}, "this one is driven"),
    ],
)
def test_refused(sphere, named):
    with pytest.raises(DustError, match=named):
        make_scene(sphere={"radius": "6 um", **sphere})


def test_refused_with_others():
    ball = {"radius": "6 um", "gap": "1 nm"}
    with pytest.raises(DustError, match="single precision does not resolve"):
        make_scene(sphere=ball, numerics={"precision": "f32"})
    cell = {"kind": "periodic", "size": ["9 um"] * 3}
    with pytest.raises(DustError, match=r"gravity.acceleration\[2\] = .*: the cell is periodic"):
        make_scene(gravity={"acceleration": ["0 m/s^2", "0 m/s^2", "1 m/s^2"]}, boundary=cell)
    with pytest.raises(DustError, match="a grain would touch the sphere across both faces"):
        build(make_scene(sphere=ball, boundary=cell), sample_of([[0, 0, 0]]))
    room = {"kind": "box", "at": {"z": ["-1 um", "12 um"]}}
    with pytest.raises(
        DustError, match=r"through the wall (x_min|top) at the start.*leave the wall"
    ):
        build(scene_with((0, 0, 7e-6), boundary=room), sample_of([[0, 0, 0]]))
    with pytest.raises(DustError, match=r"overlaps by 0\.6 µm with grain 0"):
        build(scene_with((0, 0, 6e-6)), sample_of([[0, 0, 0]]))


def test_central_gravity():
    """A circle at the speed that Newton's law asks for; a spring of the same strength has that
    speed too. The leapfrog's error of the radius is (angle a step)^2, 4e-6 here."""
    d, g = 10e-6, 1e5
    speed, period = np.sqrt(g * d), 2 * np.pi * np.sqrt(d / g)
    for exponent in (-2.0, 1.0, -1.0):
        central = {"acceleration": f"{g} m/s^2", "distance": "10 um", "exponent": exponent}
        scene = make_scene(gravity={"central": central}, dt=period / 4000)
        sim = build(scene, sample_of([[d, 0, 0]], [[0, speed, 0]]))
        start = Start.from_measurement(sim.ledger.measure())
        sim.advance(4000)
        x, v, _ = sim.motion.measure()
        np.testing.assert_allclose(x[0], [10.0, 0, 0], atol=1e-4)
        np.testing.assert_allclose(v[0], [0, speed, 0], atol=1e-5)
        assert abs(measure_opening(sim, start)) < 1e-5
