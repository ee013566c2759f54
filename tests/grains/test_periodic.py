"""Periodic cells: images, moving faces, stress. Two makes of kernels, all axes and a slab."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import RADIUS, Probe, box, make_scene, residual, sample_of

from dusttaichi import units
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.grains.build import build
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact import jkr as normal
from dusttaichi.samples import make
from dusttaichi.scene import Drive, from_yaml

SCENE = make_scene(boundary={"kind": "periodic"}, damping="viscoelastic")
PAIR = constants.pair_constants(SCENE.material, SCENE.interaction)
REST = 2 * RADIUS - PAIR.delta0  # distance of two grains in equilibrium contact


def cell(size=None, axes="xyz", **drive):
    block = {"kind": "periodic", "axes": list(axes), **drive}
    return block if size is None else block | {"size": [f"{edge:.17g} m" for edge in size]}


def lattice(n, distance):
    return distance * np.array(np.meshgrid(*[np.arange(n)] * 3)).reshape(3, -1).T


def jkr_force(delta):
    """JKR force [N] at an overlap: the root of the polynomial on the stable branch."""
    roots = np.roots([3.0, 0.0, 0.0, -2.0, -delta / PAIR.delta0])
    s = max(r.real for r in roots if abs(r.imag) < 1e-9)
    return 4.0 * PAIR.F_c * normal.force(s)


@pytest.mark.parametrize("overlap", [2.0, 1.0, 0.5])
def test_lattice_has_the_stress_of_its_contacts(overlap):
    """A simple cubic lattice of spacing d has one contact along each axis for each d^3:
    stress = -F(delta)/d^2 along each axis, and no shear."""
    d = 2 * RADIUS - overlap * PAIR.delta0
    probe = Probe(
        make_scene(boundary=cell([4 * d] * 3), damping="viscoelastic"), sample_of(lattice(4, d))
    )
    assert probe.sim.ledger.measure_energies()["contacts"] == 3 * 64
    flux_before = probe.sim.kernel_sums.read_loads().momentum_flux()
    probe.advance(10)
    volume = np.prod(probe.sim.environment.lengths())
    stress = (
        -(probe.sim.kernel_sums.read_loads().momentum_flux() - flux_before)
        / (volume * 10 * probe.sim.dt)
        * units.PRESSURE
    )
    expected = -jkr_force(overlap * PAIR.delta0) / d**2 * np.eye(3)
    # the Newton steps of the kernel end at 1e-10 of F_c, which is the scale where F = 0
    np.testing.assert_allclose(stress, expected, atol=1e-9 * PAIR.F_c / d**2, rtol=1e-9)


def test_lattice_at_rest_stays_at_rest():
    probe = Probe(
        make_scene(boundary=cell([4 * REST] * 3), damping="viscoelastic"),
        sample_of(lattice(4, REST)),
    )
    probe.advance(500)
    # rounding of positions (1e-16 x 3 um) times the stiffness, over some 10 periods
    assert np.abs(probe.v).max() < 1e-9


CHAIN = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0], [5, 0, 0]]) * REST


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("pace", [2.0, -1.5])
def test_chain_across_a_moving_face_stays_at_rest_in_its_own_frame(axis, pace):
    """Three grains of a straight chain stand before a moving face, three behind it, where they
    have the speed of the edge: to the chain nothing happens, damping takes nothing (T19 eq 12)."""
    drive = ["0 m/s"] * 3
    drive[axis] = f"{pace} m/s"
    edge = 20e-6
    scene = make_scene(boundary=cell([edge] * 3, face_speed=drive), damping="viscoelastic")
    x = np.roll(CHAIN, axis, axis=1)
    x[:, axis] += edge - 2.5 * REST
    v = np.zeros_like(x)
    out = np.floor(x[:, axis] / edge)
    x[:, axis] -= out * edge
    v[:, axis] -= out * 2 * pace
    # the cell is centred about the grains: one far from the chain puts it where it is meant to be
    far = np.full((1, 3), 0.9 * edge)
    far[0, axis] = 0.5 * edge
    x[:, [k for k in range(3) if k != axis]] += 0.1 * edge
    x, v = np.concatenate([x, far]), np.concatenate([v, np.zeros((1, 3))])
    probe = Probe(scene, sample_of(x, v))
    start = probe.sim.ledger.measure_energies()
    assert start["contacts"] == 5
    probe.advance(2000)
    m = probe.sim.ledger.measure_energies()
    assert m["contacts"] == 5
    # contacts hold some 0.05 fJ each; what happens is rounding of edge x step
    assert m["loss"].sum() < 1e-12 and abs(residual(start, m)) < 1e-9
    moved = np.concatenate([v[:3], v[3:6]])
    np.testing.assert_allclose(probe.v[:6], moved, atol=1e-7)


CAKE = """
name: cake
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 200, seed: 3}
boundary: {kind: periodic, %s}
stop: {steps: 1}
numerics: {time_step: 0.2 ns, threads: %d, precision: f64, newton_steps: 2}
"""
DRIVEN = "size: fit, face_speed: [-1 m/s, 0.5 m/s, 0 m/s]"
STEPS = 6000


def cake(boundary=DRIVEN, threads=1, drift=0.0, shift=0.0):
    """A simulation of a cake in a driven cell; every grain drifts, or the origin is elsewhere."""
    scene = from_yaml(CAKE % (boundary, threads))
    sample = make(scene)
    velocities = sample.velocities + drift
    if shift:
        x = sample.positions
        low, high = x.min(axis=0), x.max(axis=0)
        edges = high - low + REST
        low = 0.5 * (low + high - edges)
        out = np.floor((x + shift - low) / edges)
        # the outermost grains of the sample stay where they are, so that the cell does: `fit` is
        # replaced by its edges, which the sample cannot show any more
        sizes = ", ".join(f"{edge:.17g} m" for edge in edges)
        scene = from_yaml(CAKE % (boundary.replace("fit", f"[{sizes}]"), threads))
        sample = replace(sample, positions=x + shift - out * edges)
        velocities = velocities - out * np.array([-2.0, 1.0, 0.0])
    return build(scene, replace(sample, velocities=velocities))


def course(**options):
    """(start, end, state, crossings, flux) of a cake after STEPS steps."""
    sim = cake(**options)
    start = sim.ledger.measure_energies()
    sim.advance(STEPS)
    sim.crossed = sim.fields["wraps"].to_numpy()
    sim.raw = sim.fields["v"].to_numpy()[: sim.bodies.count] * 1.0
    return (
        start,
        sim.ledger.measure_energies(),
        sim.motion.measure(),
        sim.crossed,
        sim.kernel_sums.read_loads().momentum_flux(),
        sim,
    )


@pytest.fixture(scope="module")
def still():
    return course()[:5]


def test_contacts_of_a_periodic_deposit_are_found_across_its_sides():
    text = CAKE.replace("seed: 3", "seed: 3, periodic: true") % (DRIVEN, 1)
    scene = from_yaml(text)
    sample = make(scene)
    sim = build(scene, sample)
    np.testing.assert_allclose(sim.domain.cell.edges(0.0), 1e6 * np.array(sample.info["period"]))
    # each grain sticks to the one that it fell on, those on the floor to none
    assert sim.ledger.measure_energies()["contacts"] == len(sample) - sample.info["floor_grains"]


def test_ledger_closes_across_wraps(still):
    start, m, _, crossed, _ = still
    assert np.abs(crossed).sum() > 3
    assert m["loss"].sum() > 5.0
    # what remains is the step's own error, and the jolt of faces that start at once
    assert abs(residual(start, m)) < 2e-3 * abs(m["face_work"])


def test_a_drifting_frame_changes_nothing(still):
    """All grains drift and cross faces in hundreds: contacts, losses and residual stay as they are,
    momentum changes by what the faces give to the grains that cross."""
    start, m = still[:2]
    begin, end, _, crossed, _, sim = course(drift=5.0)
    assert np.abs(crossed).sum() > 200
    assert end["contacts"] == m["contacts"]
    # positions of 10 um are rounded to 2e-15 um, forces to some 1e-9 nN, grown over 6000 steps
    np.testing.assert_allclose(end["loss"], m["loss"], rtol=1e-6, atol=1e-7)
    assert residual(begin, end) == pytest.approx(residual(start, m), abs=1e-5)
    gained = sim.raw.sum(axis=0) - 5.0 * sim.bodies.count
    energy_given = -crossed.sum(axis=0) * sim.domain.cell.speeds(sim.time)
    np.testing.assert_allclose(
        gained, energy_given, atol=1e-8
    )  # rounding of 200 x 5 m/s in 6000 steps


def test_the_origin_may_be_anywhere(still):
    start, m = still[:2]
    begin, end, _, crossed, _, _ = course(shift=2.3e-6)
    assert end["contacts"] == m["contacts"]
    np.testing.assert_allclose(end["loss"], m["loss"], rtol=1e-6, atol=1e-7)  # as above
    assert residual(begin, end) == pytest.approx(residual(start, m), abs=1e-5)


def test_a_change_of_drive_keeps_the_books():
    """Edges go on from where they are, and the ledger closes over the change."""
    sim = cake()
    start = sim.ledger.measure_energies()
    sim.advance(4000)
    lengths_before = sim.environment.lengths()
    sim.drive(Drive(strain_rate=["4e4 s^-1", "0 s^-1", "-4e4 s^-1"]))
    # the anchor of the new law is the old edge to rounding
    np.testing.assert_allclose(sim.environment.lengths(), lengths_before, rtol=1e-14)
    time = sim.time
    sim.advance(4000)
    grown = lengths_before * np.exp(np.array([4e-2, 0.0, -4e-2]) * (sim.time - time))
    np.testing.assert_allclose(sim.environment.lengths(), grown, rtol=1e-12)
    m = sim.ledger.measure_energies()
    assert abs(m["face_work"]) > 1.0
    assert abs(residual(start, m)) < 5e-3 * abs(m["face_work"])  # two starts with a jolt


def test_compression_rate_is_that_of_kataoka():
    """L = L_0 exp(-2 C_v t/t_c) with t_c of T19 (Kataoka et al. 2013)."""
    sim = cake("compression_rate: 1e-5")
    lengths_before = sim.environment.lengths()
    sim.advance(1000)
    t_c = constants.characteristic_time(from_yaml(CAKE % (DRIVEN, 1)).material)
    shrunk = lengths_before * np.exp(-2e-5 * sim.time * units.TIME / t_c)
    np.testing.assert_allclose(sim.environment.lengths(), shrunk, rtol=1e-13)


def test_refused_cells():
    with pytest.raises(DustError, match="four radii"):
        make_scene(boundary=cell([2e-6, 9e-6, 9e-6]))
    with pytest.raises(DustError, match="shorter than four radii"):
        build(make_scene(boundary={"kind": "periodic"}), sample_of(lattice(2, REST)[:4]))
    with pytest.raises(DustError, match="overlap with images"):
        build(
            make_scene(boundary=cell([3 * RADIUS * 2.5] * 3)), sample_of(lattice(4, 2.2 * RADIUS))
        )


def test_a_cell_that_shrinks_too_far_is_stopped():
    sim = cake("face_speed: [-50 m/s, 0 m/s, 0 m/s]")
    sim.search.fixed_skin = 0.1
    with pytest.raises(GuardStop):
        sim.advance(5000)


@pytest.mark.long  # test_threads_change_no_bit has them in a box and in the open
def test_same_bits_on_two_threads(still):
    _, _, state, _, flux, _ = course(threads=2)
    np.testing.assert_array_equal(np.array(state), np.array(still[2]))
    np.testing.assert_array_equal(flux, still[4])


def test_energies_and_stress_are_those_of_the_images_of_a_snapshot():
    """Grains that drift through a cell that shrinks and stretches, none of them touching: series
    and snapshots tell of the same images, those inside, and the stress is that of velocities
    against the even flow of the edges, which are the same for all images."""
    rng = np.random.default_rng(2)
    # lanes along x: the grains of each have one speed, so that none meet
    x = 6e-6 * np.array(np.meshgrid(np.arange(2), np.arange(3), np.arange(3))).reshape(3, -1).T
    v = np.zeros_like(x)
    v[:, 0] = 40.0 * rng.normal(size=(3, 3))[tuple((x[:, 1:] / 6e-6).round().astype(int).T)]
    speeds = ["-2 m/s", "3 m/s", "0 m/s"]
    scene = make_scene(
        boundary=cell([8.6e-6, 14.6e-6, 14.6e-6], face_speed=speeds),
        damping="viscoelastic",
        dt="0.5 ns",
    )
    sim = Probe(scene, sample_of(x, v)).sim
    sim.search.fixed_skin = 0.5
    rate = 2.0 * np.array([-2.0, 3.0, 0.0])
    flux_before = sim.kernel_sums.read_loads().momentum_flux()
    worst = flux = outside = 0.0
    for _ in range(60):
        sim.advance(3)
        at, velocities, _ = sim.motion.measure()
        outside += np.any(sim.domain.cell.outside(sim.grain_state.of_grains("x"), sim.time))
        m = sim.ledger.measure_energies()
        worst = max(
            worst,
            abs(0.5 * sim.bodies.mass * np.sum(velocities**2) / m["kinetic_translation"] - 1.0),
        )
        gentle = velocities - rate / sim.environment.lengths() * (at - sim.domain.cell.centre)
        flux += sim.bodies.mass * np.einsum("na,nb->ab", gentle, gentle) * 3 * sim.dt
        assert m["contacts"] == 0
    assert outside > 2 and worst < 1e-12
    # a sum at every third step stands for all of them
    np.testing.assert_allclose(
        sim.kernel_sums.read_loads().momentum_flux() - flux_before,
        flux,
        rtol=3e-3,
        atol=3e-3 * flux.max(),
    )


SLAB = {"axes": "xy", "walls": ["bottom", "top"]}


def test_neighbours_across_faces_against_brute_force():
    rng = np.random.default_rng(5)
    edges = np.array([6.1, 7.3, 20.0]) * RADIUS
    room = edges + [0.0, 0.0, 4 * RADIUS]
    scene = make_scene(boundary=cell(room, **SLAB), damping="viscoelastic")
    x = np.empty((0, 3))
    while len(x) < 60:
        point = rng.uniform(size=3) * edges
        d = x - point
        d[:, :2] -= np.round(d[:, :2] / edges[:2]) * edges[:2]
        if len(x) == 0 or np.linalg.norm(d, axis=1).min() > 1.9 * RADIUS:
            x = np.concatenate([x, [point]])
    sim = build(scene, sample_of(x))
    sim.search.skin = 0.0
    i, j = sim.grain_state.pairs()
    pairs = {
        tuple(sorted(pair))
        for pair in zip(sim.grain_state.order[i], sim.grain_state.order[j], strict=True)
    }
    reach = (2 * sim.bodies.radius + sim.search.skin + sim.numbers.pair.reach) * units.LENGTH
    close = set()
    for a in range(60):
        for b in range(a):
            for kx in (-1, 0, 1):
                for ky in (-1, 0, 1):
                    image = x[b] + np.array([kx * edges[0], ky * edges[1], 0.0])
                    if np.linalg.norm(x[a] - image) < reach:
                        close.add((b, a))
    assert close and close <= pairs


def test_wall_contacts_go_with_grains_that_cross():
    """A slab between walls drifts and wraps along x and y: ledger and losses as without drift, foot
    points of wall contacts included."""
    slab = "axes: [x, y], walls: [bottom, top], wall_speed: 2 m/s"  # SLAB, pressed
    found = []
    for drift in ([0.0, 0.0], [3.0, -2.0]):
        sim = cake(slab)
        # a wall at rest would brake the drift
        walls = replace(sim.domain.box, strength=np.zeros(6))
        sim.environment.place(replace(sim.domain, box=walls))
        sim.fields["v"].from_numpy(sim.fields["v"].to_numpy() + [*drift, 0.0])
        start = sim.ledger.measure_energies()
        sim.advance(5000)
        m = sim.ledger.measure_energies()
        found.append((residual(start, m), m["loss"].sum(), m["wall_work"]))
    assert found[0][2] > 5.0
    np.testing.assert_allclose(found[1], found[0], rtol=1e-5, atol=1e-5)


def test_sticking_walls_hold_what_crosses_a_face():
    """Walls that stick, at rest, and grains that roll over them across faces: the
    sliding springs do not notice the crossing."""
    scene = make_scene(boundary=cell([4e-6] * 3, **SLAB), damping="viscoelastic")
    wall = constants.wall_constants(SCENE.material, SCENE.interaction)
    height = RADIUS - wall.delta0
    x = [[0.5e-6, 2e-6, height], [3.0e-6, 0.5e-6, height + 3 * RADIUS]]
    v, w = 3.0, 3.0 / RADIUS
    probe = Probe(scene, sample_of(x, [[v, 0, 0], [0, 0, 0]], [[0, w, 0], [0, 0, 0]]))
    start = probe.sim.ledger.measure_energies()
    probe.advance(15_000)  # 1.5 us: some 4 um, across a face
    m = probe.sim.ledger.measure_energies()
    assert np.abs(probe.sim.fields["wraps"].to_numpy()[:, 0]).sum() > 0
    # rolling past its limit loses energy, sliding stays within its own
    lost = m["loss_wall"]
    assert lost[4] < 1e-3 * lost[3]
    assert abs(residual(start, m)) < 2e-3 * start["kinetic_translation"]


@pytest.mark.long  # virial and stress of a lattice are above
def test_wall_pressure_and_virial_agree():
    """Exactly, by the virial theorem: the time integral of sum m v v + branch x force is the change
    of sum m x v less what the walls at their planes have given."""
    # normal forces only: a tangential one acts on the wall beside the centre, not above it
    scene = make_scene(boundary=box(), damping="viscoelastic", effects=(), output={"stress": True})
    rng = np.random.default_rng(2)
    x = lattice(3, REST)
    probe = Probe(scene, sample_of(x, 0.05 * rng.normal(size=x.shape)))
    sim = probe.sim

    def moment():
        """sum m x v with the velocities that the next step moves by."""
        ahead = 2.0 * probe.v - probe._grains("v")
        return sim.bodies.mass * (probe.x / units.LENGTH).T @ (ahead / units.SPEED)

    start, flux, impulse = (
        moment(),
        sim.kernel_sums.read_loads().momentum_flux(),
        sim.kernel_sums.read_loads().impulses(),
    )
    probe.advance(4000)
    planes = sim.domain.box.planes(0.0)
    wall_virial = np.zeros((3, 3))
    for n in range(6):
        wall_virial[n // 2] += planes[n] * (sim.kernel_sums.read_loads().impulses() - impulse)[n]
    cell_virial = sim.kernel_sums.read_loads().momentum_flux() - flux
    right = moment() - start - wall_virial
    # exact for the leapfrog; rounding of 4000 steps
    np.testing.assert_allclose(np.diag(cell_virial), np.diag(right), rtol=1e-9)
