"""Grains in a tube: rolling around it, weight and pressure on its wall, and the NumPy reference."""

import numpy as np
import pytest
import reference as ref
from scenes import RADIUS, Probe, balance, make_scene, sample_of
from test_pair import compare

from dusttaichi.errors import DustError
from dusttaichi.physics.surfaces.surface_model import reduced_radius
from dusttaichi.scene import Scene

TUBE = 10e-6
R = reduced_radius(RADIUS, (1 / TUBE, 0.0))
WALL = ref.numbers(wall=True, R=R)
MASS, INERTIA = ref.mass_and_inertia()
REST = TUBE - RADIUS + WALL.delta0  # distance from the axis of a grain at rest on the wall
LOW = (0.0, 0.0, -10e-6)  # of a grain on the bottom, far from the tube


def tube(radius=TUBE, **keys):
    return {"kind": "tube", "radius": f"{radius:.17g} m", "axis": ["0 m", "0 m"],
            "gap": "40 um", **keys}  # fmt: skip


def probe_of(x, v, w, **keys):
    """Probe of a grain in the tube; another one lies on the bottom, on which it depends alone."""
    both = (np.array([a, b], float) for a, b in ((x, LOW), (v, (0, 0, 0)), (w, (0, 0, 0))))
    return Probe(make_scene(boundary=tube(), **keys), sample_of(*both))


def test_a_grain_rolls_around_the_tube_as_on_a_plane():
    """It stops after v^2/2a, a = 5 R k_r xi_crit/(7 m r): 1.9 rad from where it began. The rolling
    displacement swings by its limit of 2 nm about that of steady rolling; 1e-3 of 17.8 um is nine
    times as much."""
    speed = 4.0
    probe = probe_of((-REST, 0, 0), (0, speed, 0), (0, 0, speed / RADIUS), dt="0.1 ns")
    start = probe.sim.ledger.measure_energies()
    probe.advance(95_000)
    x = probe.x[0]
    arc = REST * np.arctan2(x[1], -x[0])
    way = speed**2 * 7.0 * MASS * RADIUS / (10.0 * WALL.k_r * WALL.xi_crit * R)
    assert arc == pytest.approx(way, rel=1e-3) and arc / REST > 1.8
    assert abs(x[2]) < 1e-12 and np.hypot(*x[:2]) == pytest.approx(REST, abs=0.2 * WALL.delta0)
    end = probe.sim.ledger.measure_energies()
    (before, *_), (now, lost, _) = balance(start), balance(end)
    assert abs(now + lost - before) < 2e-5 * before
    rolled = end["loss_wall"][probe.sim.layout.channels.index("rolling")]
    assert rolled == pytest.approx(0.7 * MASS * speed**2 * 1e15, rel=1e-3)


@pytest.mark.parametrize("damping", ["none", "viscoelastic"])
def test_like_the_reference(damping):
    """An oblique hit that sticks, rolls and slides around and along the tube, and twists; tolerance
    as for walls: the two differ by the step of the leapfrog, and fall with its square."""
    x, v, w = (RADIUS + 1e-10 - TUBE, 0, 0), (-0.05, 0.3, 0.2), (3e5, 2e5, -4e5)
    probe = probe_of(x, v, w, damping=damping, dt="0.02 ns")
    x, v, w = (np.array([a, b], float) for a, b in ((x, LOW), (v, (0, 0, 0)), (w, (0, 0, 0))))
    walls = [ref.Wall(np.array([0.0, 0.0, 1.0]), -1.0)] * 4
    box = probe.sim.domain.box.offsets(0.0) * 1e-6
    walls += [ref.Wall(np.array([0.0, 0.0, s]), box[n]) for s, n in ((1.0, 4), (-1.0, 5))]
    pair, curved = ref.numbers(damping=damping), ref.numbers(wall=True, damping=damping, R=R)
    flat = ref.numbers(wall=True, damping=damping)
    walls.append(ref.Tube(TUBE))
    reference = ref.Reference(x, v, w, probe.dt, pair, lambda i: (curved, flat)[i], walls)
    compare(probe, reference, 2e-3, 6000, 1500)


def test_weight_and_pressure_on_the_tube():
    """A grain that sticks to the wall, under gravity across and along the axis: the tube carries
    m g, by pressure across and by friction along; means over the periods that remain."""
    across, along = 4e6, 4e5
    keys = {"damping": "viscoelastic", "dt": "0.1 ns"}
    gravity = {"acceleration": [f"-{across} m/s^2", "0 m/s^2", f"-{along} m/s^2"]}
    scene = make_scene(boundary=tube(), **keys).with_value("gravity", gravity)
    x = np.array([(-REST, 0, 0), LOW])
    probe = Probe(scene, sample_of(x))
    sim = probe.sim
    sim.stepper.advance(5_000)
    before, time = sim.kernel_sums.read_loads().surface_impulses()[0], sim.time
    sim.stepper.advance(10_000)
    impulse = sim.kernel_sums.read_loads().surface_impulses()[0] - before
    force = impulse / (sim.time - time) * 1e-9
    weight = MASS * across
    carried = [weight, 0.0, MASS * along, weight, 0.0]  # force, pressing, power
    assert force == pytest.approx(carried, abs=0.02 * weight)
    now = sim.kernel_sums.surface_loads()[0] * 1e-9
    assert now == pytest.approx(force, abs=0.2 * weight)


def test_a_tube_is_as_wide_as_the_sample_and_has_a_filling_factor():
    scene = make_scene(boundary={"kind": "tube", "gap": "4 um"})
    sim = Probe(scene, sample_of(np.array([(0, 0, 0), (3e-6, 4e-6, 0)]))).sim
    surfaces = sim.domain.surfaces
    radius = surfaces.tube_radius(0.0)
    curved = ref.numbers(wall=True, R=reduced_radius(RADIUS, (1e6 / radius, 0.0)))
    assert radius * 1e-6 == pytest.approx(2.5e-6 + RADIUS - curved.delta0, rel=1e-6)
    assert surfaces.numbers(0, 0.0).centre == pytest.approx((1.5, 2.0, 0.0))
    assert surfaces.strengths() == pytest.approx([1.0])
    volume = 2 * 4 / 3 * np.pi * 0.6**3
    assert sim.domain.clock().filling_factor_at(0) == pytest.approx(
        volume / (np.pi * radius**2 * 4.0)
    )
    with pytest.raises(DustError, match="boundary.radius: the sample does not fit"):
        Probe(make_scene(boundary=tube(2e-6)), sample_of(np.array([(0, 0, 0), (3e-6, 0, 0)])))


def test_a_sphere_in_a_tube_is_refused():
    data = {
        "name": "a", "material": "silicate_s12", "sample": {"kind": "chain", "grains": 2},
        "boundary": {"kind": "tube"}, "stop": {"steps": 1},
        "sphere": {"radius": "3 um", "gap": "10 nm"},
    }  # fmt: skip
    with pytest.raises(DustError, match="contacts with a tube are not computed"):
        Scene.from_dict(data)
