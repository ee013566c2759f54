"""Every effect on its own and all together, pairs and a wall: what the kernels do follows from one
energy, conserves what must be conserved, and does not care who looks at it.

The built-in laws are held against reference.py; a law that is registered (as the example of the
docs is) is tested with its own energy: that the loads are its gradient.
"""

from types import SimpleNamespace

import numpy as np
import pytest
import reference as ref
from scenes import FAR, RADIUS, Probe, box, law_of_the_docs, make_scene, sample_of

from dusttaichi.physics.contact import constants, effect_registry

EFFECTS = {
    "normal": (),
    "rolling": ("rolling",),
    "sliding": ("sliding",),
    "twisting": ("twisting",),
    "all": ("rolling", "sliding", "twisting"),  # last: the tests below find what is compiled
}
SPRINGS = ("rolling", "sliding", "twisting")
# what a contact is rounded to, over that of double precision: in `mixed` contacts are single
ROUNDING = {"mixed": 3e5, "f64": 1.0}
with law_of_the_docs():
    LAWS = {
        f"{effect}, {law}": (effect, law)
        for effect in SPRINGS
        for law in effect_registry.names(effect)
        if law != effect_registry.DEFAULT[effect]
    }
    DAMPING = [
        "none",
        *(law for law in effect_registry.names("damping") if law not in ("viscous", "scaled")),
    ]
SHORT = {(name, "f64") for name in (*LAWS, "all")} | {("all", "mixed")}
NUMBER = {"normal": 0, "rolling": 1, "sliding": 2, "twisting": 3}
FLOOR = np.array([0.0, 0.0, 1.0])


def triangle():
    """Three touching grains on the floor, none of them in equilibrium with the others."""
    d = 2 * RADIUS
    gaps = np.array([-0.25e-9, -0.1e-9, -0.05e-9])
    x = np.array([[0, 0, 0], [d + gaps[0], 0, 0.05e-9], [0, 0, 0.02e-9]])
    a, b = d + gaps[1], d + gaps[2]
    along = (a**2 - b**2 + x[1, 0] ** 2) / (2 * x[1, 0])
    x[2, :2] = along, np.sqrt(a**2 - along**2)
    return x


V = np.array([[0.02, -0.01, 0.004], [-0.01, 0.015, -0.003], [0.003, -0.012, 0.005]])
W = np.array([[2.0, -4.0, 7.0], [-5.0, 3.0, -6.0], [4.0, 6.0, -3.0]]) * 1e4


@pytest.fixture(scope="module", autouse=True)
def law():
    with law_of_the_docs():
        yield


@pytest.fixture(
    scope="module",
    params=[
        pytest.param((name, precision), id=f"{name} {precision}", marks=marks)
        for precision in ROUNDING
        for name in (*LAWS, *EFFECTS)
        # one effect alone repeats what all of them have; the law of the docs is alone anyway
        for marks in [pytest.mark.long if (name, precision) not in SHORT else ()]
    ],
)
def strained_probe(request):
    """(effects, probe): 12 elastic steps after a start with generic velocities and spins."""
    name, precision = request.param
    effect, law = LAWS.get(name, (None, None))
    effects = EFFECTS[name] if law is None else EFFECTS["all"]
    scene = make_scene(effects=effects, boundary=box("bottom"), numerics={"precision": precision})
    if law is not None:
        scene = scene.with_value(f"interaction.{effect}.law", law)
    probe = Probe(scene, sample_of(triangle(), V, W))
    probe.laws = dict(effect_registry.chosen_model(scene.interaction).effects)
    probe.pair = constants.pair_constants(scene.material, scene.interaction)
    probe.wall = constants.wall_constants(scene.material, scene.interaction)
    probe.own, probe.rounding = law is not None, ROUNDING[precision]
    probe.advance(12)
    assert np.all(probe.sim.ledger.measure_energies()["loss"] == 0), "nothing may have slipped yet"
    assert np.all(probe.sim.ledger.measure_energies()["loss_wall"] == 0)
    return effects, probe


class Vec(np.ndarray):
    """A 3-vector as the laws have it, complex on the host."""

    def dot(self, o):
        return np.sum(self * o)


def own_energies(probe, arms, n1, n2, phi):
    """The springs' energies by the laws' own functions; arms: (arm of sliding, n_c[, wall])."""
    laws, wall = probe.laws, len(arms) == 3
    p = probe.wall if wall else probe.pair
    p = SimpleNamespace(R=p.R, **p.numbers)
    arm, nc, n1, n2 = (np.asarray(a, complex).view(Vec) for a in (*arms[:2], n1, n2))
    out = np.zeros(4, complex)
    if "rolling" in laws:
        out[1] = laws["rolling"].energy(p.R * (n1 + (nc if wall else n2)), p)
    if "sliding" in laws:
        out[2] = laws["sliding"].energy(arm - nc * arm.dot(nc), p)
    if "twisting" in laws:
        out[3] = laws["twisting"].energy(phi, p)
    return out


def potentials(probe, effects, x=None, turn=None):
    """Potential by effect, (2, 4): pairs, walls; grains moved to x, turned by the vectors `turn`.

    A turn acts on pointers and twist to first order: all that a complex step needs.
    """
    x = probe.x if x is None else x
    turn = np.zeros((3, 3)) if turn is None else turn
    floor = probe.sim.domain.box.offset[4] * 1e-6
    total = np.zeros((2, 4), complex)
    for (i, j), (n1, n2, phi) in probe.contacts().items():
        n1 = n1 + np.cross(turn[i], n1)
        if j >= 0:
            n2 = n2 + np.cross(turn[j], n2)
            nc = ref.unit(x[i] - x[j])
            phi = phi + ref.dot(turn[i] - turn[j], nc)
            p = ref.numbers(effects=effects)
            pair_energies = ref.pair_energies(x[i], x[j], n1, n2, phi, p).astype(complex)
            if probe.own:
                pair_energies[1:] = own_energies(probe, (RADIUS * (n1 - n2), nc), n1, n2, phi)[1:]
            total[0] += pair_energies
        else:
            phi = phi + ref.dot(turn[i], FLOOR)
            p = ref.numbers(wall=True, effects=effects)
            pair_energies = ref.wall_energies(x[i], n1, n2, phi, FLOOR, floor, p).astype(complex)
            if probe.own:
                arm = x[i] + RADIUS * n1 - n2
                pair_energies[1:] = own_energies(probe, (arm, FLOOR, True), n1, n2, phi)[1:]
            total[1] += pair_energies
    return total


def test_energy_is_what_measure_reports(strained_probe):
    """1e-11: overlaps are differences of positions that are 4000 times as long."""
    effects, probe = strained_probe
    measured = probe.sim.ledger.measure_energies()
    expected = potentials(probe, effects).real / 1e-15
    assert measured["contacts"] == 3 and measured["wall_contacts"] == 3
    for name, expected_value in zip(("potential", "potential_wall"), expected, strict=True):
        own = measured[name]
        np.testing.assert_allclose(
            own, expected_value, rtol=1e-11 * probe.rounding, atol=1e-14 * probe.rounding
        )
    for effect in effects:
        assert expected[0, NUMBER[effect]] > 0 and expected[1, NUMBER[effect]] > 0


def test_loads_are_minus_the_gradient(strained_probe):
    """Complex steps: no cancellation. 1e-9 of the largest force: cancellation of the energies'
    arguments as above, and forces are the small difference of attraction and repulsion."""
    effects, probe = strained_probe
    force, torque = probe.loads()
    h, tolerance = 1e-30, 1e-9 * max(1.0, 0.03 * probe.rounding)
    for grain in range(3):
        for axis in range(3):
            step = np.zeros((3, 3), complex)
            step[grain, axis] = 1j * h
            by_place = -potentials(probe, effects, x=probe.x + step).sum().imag / h
            by_angle = -potentials(probe, effects, turn=step).sum().imag / h
            assert by_place == pytest.approx(
                force[grain, axis], abs=tolerance * np.abs(force).max()
            )
            scale = max(np.abs(torque).max(), 1e-25)  # without effects there is no torque at all
            assert by_angle == pytest.approx(torque[grain, axis], abs=tolerance * scale)


def cluster(speed, spin, rng):
    """Two tight groups of six that collide obliquely, every grain with its own spin."""
    d = 2 * RADIUS - 0.1e-9
    octahedron = np.concatenate([np.eye(3), -np.eye(3)]) * d / np.sqrt(2)
    shift = np.array([d / np.sqrt(2) + 2 * RADIUS + 0.3e-9 + d / np.sqrt(2), 0, 0])
    x = np.concatenate([octahedron, octahedron + shift])
    v = speed * np.array([[0.5, 0.3, 0.1]] * 6 + [[-0.5, -0.2, 0.05]] * 6)
    return x, v + 0.1 * speed * rng.normal(size=(12, 3)), spin * rng.normal(size=(12, 3))


@pytest.fixture(scope="module", params=DAMPING)
def damping(request):
    """One after the other: tests of the same damping share what is compiled."""
    return request.param


@pytest.fixture(scope="module")
def collide():
    def run(x, v, w, steps=0, **keys):
        probe = Probe(make_scene(dt="0.1 ns", boundary=FAR, **keys), sample_of(x, v, w))
        probe.advance(steps)
        return probe

    return run


@pytest.mark.parametrize("speed, spin", [(0.01, 1e4), (0.5, 2e6)], ids=["elastic", "slipping"])
def test_free_cluster_keeps_its_momenta(collide, speed, spin, damping):
    """To rounding, slipping or not: 1000 steps of some 20 contacts each add 1e-16 of the kicks."""
    x, v, w = cluster(speed, spin, np.random.default_rng(5))
    probe = collide(x, v, w, damping=damping)
    probe.assert_momenta_stay(10, 100)
    assert probe.sim.ledger.measure_energies()["loss"][0] > 0.0, (
        "the groups must have met: contacts formed"
    )
    slipped = probe.sim.ledger.measure_energies()["loss"][3:5].sum() > 0
    assert slipped == (speed > 0.1)


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def end_of(probe):
    """Velocities, spins and contacts; Taichi keeps one simulation at a time."""
    return probe.v, probe.w, probe.sim.ledger.measure_energies()["contacts"]


@pytest.mark.parametrize("way", ["turned", "moving"])
def test_another_frame(collide, damping, way):
    """Positions of 2 um are rounded to 4e-16 um, a 2e-12 of delta0; 300 steps (three periods of
    the normal spring, contacts forming) let that grow to some 1e-9 of what happens. 3 m/s is ten
    times what the grains do among themselves."""
    x, v, w = cluster(0.2, 5e5, np.random.default_rng(6))
    Q, frame = rotation(np.random.default_rng(7)), np.zeros(3)
    if way == "moving":
        Q, frame = np.eye(3), np.array([3.0, -2.0, 1.0])
    v1, w1, contacts = end_of(collide(x, v, w, 300, damping=damping))
    v2, w2, other = end_of(collide(x @ Q.T, v @ Q.T + frame, w @ Q.T, 300, damping=damping))
    assert contacts == other > 0
    assert np.abs(v2 - frame - v1 @ Q.T).max() < 1e-8 * np.abs(v1).max()
    assert np.abs(w2 - w1 @ Q.T).max() < 1e-8 * np.abs(w1).max()


def test_action_is_reaction(collide):
    """Loads of a pair: opposite forces to the bit, torques that balance the lever to rounding."""
    x, v, w = cluster(0.3, 5e5, np.random.default_rng(9))
    probe = collide(x, v, w, 40, damping="viscoelastic")
    force, torque = probe.loads()
    # forces of opposite sign and the same bits, summed in different orders
    assert np.abs(force.sum(0)).max() < 1e-14 * np.abs(force).sum()
    lever = np.cross(probe.x, force).sum(0) + torque.sum(0)
    assert np.abs(lever).max() < 1e-13 * (np.abs(torque).sum() + RADIUS * np.abs(force).sum())


@pytest.mark.long  # one by one: test_asperities and the tests above
@pytest.mark.parametrize("precision", ["f64", "mixed"])
def test_losses_are_what_the_energy_lacks(precision):
    """Damping and asperities of a collision that also slips: what they book is what kinetic and
    potential energy have lost, to 1 % of it (first order in the step, which finds a touch late)."""
    x, v, w = cluster(0.5, 2e6, np.random.default_rng(10))
    keys = {"interaction": {"asperities": "on", "damping": "viscoelastic"}}
    scene = make_scene(
        dt="0.02 ns",
        boundary=FAR,
        material="silica_pd08",
        numerics={"precision": precision},
        **keys,
    )
    probe = Probe(scene, sample_of(x, v, w))
    energy, lost, _ = probe.energy()
    probe.advance(1000)
    end_energy, dissipated, _ = probe.energy()
    by_channel = dict(
        zip(probe.sim.layout.channels, probe.sim.ledger.measure_energies()["loss"], strict=True)
    )
    assert by_channel["damping"] > 0.0 and by_channel["asperities"] > 0.0
    assert dissipated - lost == pytest.approx(energy - end_energy, rel=1e-2)
