"""Forces from outside on grains: closed forms, and an energy ledger that closes for each."""

import numpy as np
import pytest
import reference as ref
import reference_forces
from scenes import EXAMPLES, RADIUS, Probe, import_bundled, make_scene, sample_of
from test_pair import compare

import dusttaichi
from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.grains.build import build
from dusttaichi.method import Start
from dusttaichi.physics.forces import drag
from dusttaichi.running.ledger import ledger
from dusttaichi.scene import from_yaml

FALL = {"kind": "gravity", "acceleration": ["0 m/s^2", "0 m/s^2", "-10 m/s^2"]}
WIND = {"kind": "gas_drag", "stopping_time": "1 us", "velocity": ["0.2 m/s", "0 m/s", "0 m/s"]}
REST = {"kind": "gas_drag", "stopping_time": "1 us"}


def vector(values, unit):
    return [f"{a:.17g} {unit}" for a in values]


def started(forces, positions=((0, 0, 0),), velocities=((0, 0, 0),), dt="1 ns", **blocks):
    """Simulation of grains with forces from outside, and its Start."""
    sim = build(
        make_scene(forces=forces, dt=dt, **blocks), sample_of(list(positions), list(velocities))
    )
    return sim, Start.from_measurement(sim.ledger.measure())


def balance(sim, start):
    """Measurement now [J]: losses by channel, work, and the residual over what went through."""
    m = sim.ledger.measure()
    losses = dict(zip(sim.layout.channels, m.losses * units.ENERGY, strict=True))
    return losses, m.work * units.ENERGY, ledger(m, start)[1]


def test_a_grain_falls_at_its_terminal_speed():
    """v = u + g tau; then the gas takes the power of gravity, and gives that of the wind."""
    sim, start = started([FALL, WIND])
    sim.advance(20_000)
    _, v, _ = sim.motion.measure()
    np.testing.assert_allclose(v[0], [0.2, 0.0, -1e-5], rtol=1e-8, atol=1e-12)
    losses, work, residual = balance(sim, start)
    mass = sim.bodies.mass * units.MASS
    # the wind does m u^2 of work, half of it is lost; the fall: g times the way, less m v^2/2
    fall = mass * 10.0 * 1e-5 * (20e-6 - 1e-6)
    assert work == pytest.approx(mass * 0.2**2 + fall, rel=1e-6)
    assert losses["drag"] == pytest.approx(0.5 * mass * 0.2**2, rel=1e-6)
    assert abs(residual) < 1e-12


def test_stopping_distance():
    """x = v tau (1 - e^(-t/tau)); all of the kinetic energy goes to the channel of the drag."""
    sim, start = started([FALL | {"acceleration": ["0 m/s^2"] * 3}, REST], velocities=[[3, 0, 0]])
    sim.advance(1000)
    x, v, _ = sim.motion.measure()
    # the leapfrog is second order in the step, a thousandth of the stopping time here
    np.testing.assert_allclose(x[0, 0] * units.LENGTH, 3e-6 * (1 - np.exp(-1)), rtol=1e-6)
    np.testing.assert_allclose(v[0, 0], 3 * np.exp(-1), rtol=1e-6)
    sim.advance(19_000)
    assert sim.motion.measure()[0][0, 0] * units.LENGTH == pytest.approx(3e-6, rel=1e-6)
    losses, work, residual = balance(sim, start)
    assert losses["drag"] == pytest.approx(0.5 * sim.bodies.mass * units.MASS * 9.0, rel=1e-9)
    assert work == 0.0 and abs(residual) < 1e-12


def test_epstein():
    """tau = rho_s r/(rho_g v_th) with v_th = sqrt(8 k T/(pi m_g)), 1592 m/s at 280 K."""
    gas = {"kind": "gas_drag", "density": "1 kg/m^3", "temperature": "280 K"}
    speed = drag.thermal_speed(280.0, 2.34)
    assert speed == pytest.approx(1592.0, rel=1e-3)
    scene = make_scene(forces=[gas], dt="auto")
    tau = scene.material.density * scene.material.radius / speed
    sim, _ = started([FALL | {"acceleration": ["0 m/s^2"] * 3}, gas], velocities=[[1, 0, 0]])
    steps = 500
    sim.advance(steps)
    decay = np.exp(-steps * 1e-9 / tau)
    assert sim.motion.measure()[1][0, 0] == pytest.approx(decay, rel=1e-5)


def test_the_time_step_knows_the_forces():
    quick = REST | {"stopping_time": "0.2 ns"}
    scene = make_scene(forces=[quick], dt="auto")
    sim = build(scene, sample_of([[0, 0, 0]]))
    assert sim.dt * units.TIME == pytest.approx(scene.numerics.step_fraction * 0.2e-9)
    with pytest.raises(DustError, match=r"time_step = .*not stable.*0\.2 ns"):
        build(make_scene(forces=[quick], dt="0.1 ns"), sample_of([[0, 0, 0]]))


@pytest.mark.parametrize(
    "force, said",
    [
        ({"kind": "gas_darg"}, r"forces\[0\].kind = \"gas_darg\": did you mean \"gas_drag\""),
        ({"kind": "gas_drag"}, r"forces\[0\]: exactly one of stopping_time and density is needed"),
        (
            {"kind": "gas_drag", "stopping_time": "1 um"},
            r"stopping_time = .*a time above 0 is needed",
        ),
        (REST | {"temperature": "10 K"}, r"forces\[0\].temperature.*belongs to a density"),
        ({"kind": "gravity"}, r"forces\[0\]: exactly one of acceleration and central is needed"),
    ],
)
def test_what_a_force_cannot_be(force, said):
    with pytest.raises(DustError, match=said):
        make_scene(forces=[force])


@pytest.mark.parametrize("key, value", [("deviation", "1e-18 C"), ("seed", 3)])
def test_a_charge_by_mass_has_no_scatter(key, value):
    with pytest.raises(DustError, match=f"charge.{key} = .*it belongs to a mean"):
        make_scene(charge={"per_mass": "1 C/kg", key: value})


def test_a_resolved_scene_with_forces_loads_again():
    """With every default, also of keys that belong to others."""
    scene = make_scene(charge={"per_mass": "1 C/kg"}, forces=[FALL, REST])
    assert from_yaml(scene.to_yaml()) == scene


def test_periodic_faces_and_gravity():
    cell = {"kind": "periodic", "size": ["10 um"] * 3}
    with pytest.raises(DustError, match=r"forces\[0\].acceleration\[2\].*the cell is periodic"):
        make_scene(forces=[FALL], boundary=cell)


def test_a_charge_drifts():
    """v = q E tau/m in the gas; a free one gyrates about B, at q B/m, and keeps its energy."""
    field = {"kind": "electric_field", "field": ["1e4 V/m", "0 V/m", "0 V/m"]}
    sim, start = started([field, REST], charge="1e-15 C")
    sim.advance(20_000)
    speed = 1e-15 * 1e4 * 1e-6 / (sim.bodies.mass * units.MASS)
    _, v, _ = sim.motion.measure()
    np.testing.assert_allclose(v[0], [speed, 0, 0], rtol=1e-8, atol=1e-12)
    losses, work, residual = balance(sim, start)
    assert work == pytest.approx(1e-15 * 1e4 * speed * (20e-6 - 1e-6), rel=1e-6)
    assert losses["drag"] == pytest.approx(
        work - 0.5 * sim.bodies.mass * units.MASS * speed**2, rel=1e-6
    )
    assert abs(residual) < 1e-12

    magnet = field | {"field": ["0 V/m"] * 3, "magnetic_field": ["0 T", "0 T", "1e6 T"]}
    slow = REST | {"stopping_time": "1e9 s"}
    sim, start = started([magnet, slow], velocities=[[1, 0, 0]], charge={"mean": "1e-15 C"})
    sim.advance(1000)
    angle = 1e-15 * 1e6 / (sim.bodies.mass * units.MASS) * sim.time * units.TIME
    _, v, _ = sim.motion.measure()
    np.testing.assert_allclose(v[0], [np.cos(angle), -np.sin(angle), 0], atol=1e-6)
    assert abs(balance(sim, start)[2]) < 1e-12


def test_charges():
    block = make_scene(charge={"mean": "1e-17 C", "deviation": "1e-18 C"}).charge
    drawn = block.draw(np.ones(4000), np.ones(4000))
    assert drawn.mean() == pytest.approx(1e-17, rel=0.01)
    assert drawn.std() == pytest.approx(1e-18, rel=0.05)
    block = make_scene(charge={"surface_density": "1 C/m^2"}).charge
    np.testing.assert_allclose(
        block.draw(np.ones(2), np.array([1.0, 2.0])), [4 * np.pi, 16 * np.pi]
    )
    field = {"kind": "electric_field", "field": ["1 V/m"] * 3}
    with pytest.raises(DustError, match=r"forces\[0\].kind.*have no charge; give the key charge"):
        make_scene(forces=[field])
    with pytest.raises(DustError, match="exactly one of mean, surface_density, per_mass"):
        make_scene(charge={})


def test_a_free_grain_in_a_rotating_frame():
    """A straight line, and a steady spin, seen from the frame: second order in the step."""
    rate, center = 1e5, np.array([1e-6, 0.0, 0.0])
    frame = {
        "kind": "rotating_frame",
        "angular_velocity": ["0 rad/s", "0 rad/s", f"{rate} rad/s"],
        "centre": vector(center, "m"),
    }
    v, w = np.array([0.3, 0.2, 0.1]), np.array([2e5, 1e5, -3e5])
    start_at, turning = np.array([5e-6, 1e-6, 0.0]), np.array([0.0, 0.0, rate])
    relative = v - np.cross(turning, start_at - center)
    scene = make_scene(forces=[frame], dt="1 ns")
    sim = build(scene, sample_of([start_at], [relative], [w - turning]))
    start = Start.from_measurement(sim.ledger.measure())
    sim.advance(10_000)
    angle = -rate * sim.time * units.TIME
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    x, u, s = sim.motion.measure()
    place = center + turn @ (start_at - center + v * sim.time * units.TIME)
    np.testing.assert_allclose(x[0] * units.LENGTH, place, atol=1e-12)
    inertial = turn @ v - np.cross(turning, place - center)
    np.testing.assert_allclose(u[0], inertial, atol=1e-6)
    np.testing.assert_allclose(s[0] * units.SPIN, turn @ w - turning, rtol=1e-6)
    # of the order of the square of the angle that the frame turns by in a step, 1e-8
    assert abs(balance(sim, start)[2]) < 1e-8


def test_a_script_sets_forces_and_velocities():
    """m a and m v^2/2 as they are set; a checkpoint has them, and the ledger closes throughout."""
    scene = make_scene(forces=[{"kind": "script"}], stop={"steps": 3000}, dt="1 ns")
    with dusttaichi.simulate(scene, progress=False, log=lambda *_: None) as simulation:
        mass = simulation._run.sim.bodies.mass * units.MASS
        simulation.set_forces([1e-9, 0, 0])
        simulation.advance(1000)
        speed = 1e-9 / mass * 1e-6
        assert simulation.velocities[0, 0] == pytest.approx(speed, rel=1e-12)
        simulation.set_velocities([[0, 2.0, 0]], [[0, 0, 1e5]])
        np.testing.assert_allclose(simulation.velocities[0], [0, 2, 0], atol=1e-12)
        np.testing.assert_allclose(simulation.spins[0], [0, 0, 1e5])
        now = simulation.measure()
        energy = 0.5 * mass * 4.0 + 0.5 * simulation._run.sim.bodies.inertia * units.INERTIA * 1e10
        assert now.force_work == pytest.approx(energy, rel=1e-9)
        simulation.run()
        assert abs(simulation.measure().energy_residual_relative) < 1e-12
        with pytest.raises(DustError, match=r"set_forces: finite numbers of the shape \(1, 3\)"):
            simulation.set_forces([[1.0, 2.0]])
    with dusttaichi.simulate(make_scene(), progress=False, log=lambda *_: None) as simulation:
        with pytest.raises(DustError, match="add {kind: script} to `forces`"):
            simulation.set_velocities([0, 0, 0])


def in_warm_gas(threads):
    """400 grains far apart in a gas of 280 K, after twenty stopping times; seeds are the same."""
    noise = {"kind": "thermal_noise", "stopping_time": "5 ns", "temperature": "280 K"}
    places = 1e-5 * np.stack(np.meshgrid(*[np.arange(8.0)] * 3), -1).reshape(-1, 3)[:400]
    with import_bundled(EXAMPLES / "thermal_noise.py"):
        sim, start = started([noise], places, np.zeros((400, 3)), dt="0.5 ns", threads=threads)
        sim.advance(200)
        return sim, start


def test_equipartition():
    """m <v^2> = 3 k T within three standard errors, on any number of threads the same bits."""
    sim, start = in_warm_gas(1)
    v = sim.grain_state.of_grains("v")  # half a step back, where k T/m is exact for any step
    energies = sim.bodies.mass * units.MASS * np.sum(v**2, axis=1) / (drag.BOLTZMANN * 280.0)
    assert energies.mean() == pytest.approx(3.0, abs=3 * np.sqrt(6.0 / 400))
    # energies of one component are distributed as chi^2 of one degree of freedom: variance 2
    squares = sim.bodies.mass * units.MASS * v[:, 0] ** 2 / (drag.BOLTZMANN * 280.0)
    assert squares.var() == pytest.approx(2.0, abs=1.0)
    losses, _, residual = balance(sim, start)
    kinetic = sim.ledger.measure().kinetic * units.ENERGY
    assert losses["thermal"] == pytest.approx(-kinetic, rel=0.2)  # the noise has given it
    assert abs(residual) < 1e-12
    again, _ = in_warm_gas(2)
    assert again.grain_state.of_grains("v").tobytes() == v.tobytes()


def test_a_spinning_pair_in_both_frames():
    """A pair that spins about its middle is stretched as one at rest in the frame that turns."""
    rate = 2e6
    pair = {"kind": "pair", "gap": "0 nm"}
    x = np.array([[-0.59992e-6, 0, 0], [0.59992e-6, 0, 0]])
    turning = np.array([0.0, 0.0, rate])
    frame = {"kind": "rotating_frame", "angular_velocity": vector(turning, "rad/s")}
    found = []
    for forces, v, w in (([], np.cross(turning, x), turning), ([frame], 0 * x, 0 * turning)):
        scene = make_scene(forces=forces, damping="viscous", dt="0.05 ns", sample=pair)
        sim = build(scene, sample_of(x, v, np.tile(w, (2, 1))))
        start = Start.from_measurement(sim.ledger.measure())
        sim.advance(4000)
        places = sim.motion.measure()[0] * units.LENGTH
        overlap = 2 * scene.material.radius - np.linalg.norm(places[1] - places[0])
        found.append((overlap, sim.ledger.measure().lost))
        assert abs(balance(sim, start)[2]) < 1e-4  # of a step of a fiftieth of the period
    (inertial, lost), (turned, lost_in_frame) = found
    assert turned == pytest.approx(inertial, abs=1e-14)
    assert lost_in_frame == pytest.approx(lost, rel=1e-3)


FIELD, MAGNETIC = np.array([3e3, 0.0, -2e3]), np.array([0.0, 4e5, 1e5])
GAS, TURNING = np.array([0.3, -0.2, 0.1]), np.array([4e5, 0.0, 1e6])
CENTRE = np.array([2e-6, 1e-6, -3e-6])
DOWN = np.array([1e5, 0.0, -2e6])
ORACLES = {
    "gravity": (
        [{"kind": "gravity", "acceleration": vector(DOWN, "m/s^2")},
         {"kind": "gravity", "central": {"centre": vector(CENTRE, "m"), "mass": "1e5 kg"}}],
        [reference_forces.uniform(DOWN), reference_forces.attraction(1e5, CENTRE)],
    ),
    "gas_drag": (
        [{"kind": "gas_drag", "density": "0.2 kg/m^3", "temperature": "300 K",
          "molecular_mass": 28.0, "velocity": vector(GAS, "m/s")}],
        [reference_forces.epstein(0.2, 300.0, 28.0, GAS)],
    ),
    "rotating_frame": (
        [{"kind": "rotating_frame", "angular_velocity": vector(TURNING, "rad/s"),
          "centre": vector(CENTRE, "m")}],
        [reference_forces.rotating(TURNING, CENTRE)],
    ),
    "electric_field": (
        [{"kind": "electric_field", "field": vector(FIELD, "V/m"), "frequency": "2e6 /s",
          "phase": "0.4 rad", "magnetic_field": vector(MAGNETIC, "T")}],
        [reference_forces.electric(2e-15, FIELD, MAGNETIC, 2e6, 0.4)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", ORACLES)
def test_like_the_reference(kind):
    """Two grains that hit obliquely and stick, and a third one alone, under each force: like the
    NumPy reference within what rounding leaves (test_pair); without the force they would be
    further apart by more than a thousand times that."""
    blocks, outside = ORACLES[kind]
    x = np.array([[-RADIUS, 0, 0], [RADIUS + 1e-11, 0, 0], [4e-6, 5e-6, 3e-6]])
    v = np.array([[0.03, 0.004, 0.0], [-0.03, -0.002, 0.003], [0.2, -0.1, 0.3]])
    w = 2e4 * np.array([[1.0, -2.0, 0.5], [0.3, 1.0, -1.0], [-1.0, 0.2, 2.0]])
    charge = {"charge": "2e-15 C"} if kind == "electric_field" else {}
    scene = make_scene(forces=blocks, damping="viscoelastic", dt="0.1 ns", **charge)
    probe = Probe(scene, sample_of(x, v, w))
    numbers = ref.numbers(damping="viscoelastic")
    plain = ref.Reference(x, v, w, probe.dt, numbers)
    plain.advance(600)
    compare(probe, ref.Reference(x, v, w, probe.dt, numbers, outside=outside), 1e-8, 600, 150)
    assert np.abs(probe.v - plain.velocities()).max() > 1e-5 * np.abs(probe.v).max()
    assert len(plain.contacts) == 1
