"""Surfaces beside the walls: contacts with spheres, rods and tubes, fixed and moving."""

from contextlib import nullcontext

import numpy as np
import pytest
import reference as ref
from scenes import RADIUS, Probe, balance, make_scene, polydisperse, sample_of
from scipy.special import ellipe, ellipk

from dusttaichi.errors import DustError
from dusttaichi.grains.build import prepare
from dusttaichi.physics.contact import constants
from dusttaichi.physics.surfaces.surface_model import reduced_radius

LARGE = 6e-6
FAR = (0.0, 0.0, 90e-6)  # of a second grain, on which nothing depends


def surface(kind, radius=LARGE, **keys):
    return {"kind": kind, "radius": f"{radius:.17g} m", **keys}


def probe_of(surfaces, x, v=(0, 0, 0), w=(0, 0, 0), **keys):
    """Probe of a grain by some surfaces; another one is far away, or in the middle of a shell."""
    inside = surfaces[0].get("grains", "inside") == "inside"
    far = (0, 0, 0) if surfaces[0]["kind"] == "sphere" and inside else FAR
    both = (np.array([a, b], float) for a, b in ((x, far), (v, (0, 0, 0)), (w, (0, 0, 0))))
    keys = {"dt": "0.05 ns"} | keys
    return Probe(make_scene(surfaces=surfaces, **keys), sample_of(*both))


# -- constants -------------------------------------------------------------------------------------


def ellipse(ratio):
    """(approach, mean radius) of Hertz's ellipse with R'/R'' = ratio, over those of a circle.

    Of the same load and R' R'' (Johnson 1985, eqs 4.24 to 4.26, solved without approximation).
    """
    low, high = 1e-3, 1.0 - 1e-9
    for _ in range(200):
        k = 0.5 * (low + high)
        K, E = ellipk(1 - k * k), ellipe(1 - k * k)
        low, high = (k, high) if (E / k**2 - K) / (K - E) > ratio else (low, k)
    e2, relative = 1 - k * k, 0.5 / np.sqrt(ratio)
    a = (1.5 / np.pi * (K - E) / (e2 * relative)) ** (1 / 3)
    return 1.5 / (np.pi * a) * K / (9 / 16) ** (1 / 3), np.sqrt(k) * a / 0.75 ** (1 / 3)


@pytest.mark.parametrize("ratio, error", [(1.06, 1e-4), (1.25, 1e-3), (2.0, 7e-3)])
def test_a_circle_for_an_ellipse(ratio, error):
    """What the docstring of reduced_radius says."""
    assert ellipse(ratio) == pytest.approx((1.0, 1.0), abs=error)


def test_reduced_radii():
    """Of a sphere outside that of a pair; inside 1/R = 1/r - 1/R; in a tube the mean of both."""
    assert reduced_radius(1.0, (-0.25, -0.25)) == pytest.approx(constants.reduced_radius(1.0, 4.0))
    assert reduced_radius(1.0, (0.25, 0.25)) == pytest.approx(4.0 / 3.0)
    assert reduced_radius(1.0, (0.25, 0.0)) == pytest.approx(np.sqrt(4.0 / 3.0))
    assert reduced_radius(0.6, (0.0, 0.0)) == pytest.approx(0.6)


@pytest.mark.parametrize("overlap", [0.3, 1.0, 1.5])
def test_jkr_inside_a_shell(overlap):
    """The force of a kernel is that of 1/R = 1/r - 1/R_shell; wall 6 is the first surface."""
    numbers = ref.numbers(wall=True, R=reduced_radius(RADIUS, (1 / LARGE, 1 / LARGE)))
    place = LARGE - RADIUS + overlap * numbers.delta0
    probe = probe_of([surface("sphere")], (0, 0.6 * place, -0.8 * place))
    contact = probe.sim.contact_table.surface((0, RADIUS), 0)
    assert (contact.F_c, contact.delta0) == pytest.approx((numbers.F_c, numbers.delta0), rel=1e-9)
    walls = probe.sim.contacts.measure_walls()
    exact = ref.normal_force(ref.contact_radius(overlap * numbers.delta0, numbers), numbers)
    assert walls["wall"].tolist() == [6] and walls["overlap"] * 1e-6 == pytest.approx(
        overlap * numbers.delta0, rel=1e-6
    )
    assert walls["force"][0] * 1e-9 == pytest.approx(
        exact * np.array([0, -0.6, 0.8]), abs=1e-5 * numbers.F_c
    )


def test_a_sphere_is_a_grain_that_does_not_move():
    """An oblique hit of a sphere and of a grain of its size, 1e12 times as heavy, in the reference:
    within what the two say differently, the lever (the overlap over the radius, 1e-4)."""
    effects = ("rolling", "sliding")
    x, v, w = (0, 0, LARGE + RADIUS + 1e-11), (0.3, 0.1, -0.06), (2e5, -3e5, 0.0)
    probe = probe_of([surface("sphere", grains="outside")], x, v, w, effects=effects)
    both = (np.array([a, (0, 0, 0)], float) for a in (x, v, w))
    pair = ref.mix_constants({}, {"r": LARGE}, effects=effects)
    masses, radii = ref.mass_and_inertia()[0] * np.array([1.0, 1e12]), np.array([RADIUS, LARGE])
    reference = ref.Reference(*both, probe.dt, pair, masses=masses, radii=radii)
    for _ in range(4):
        probe.advance(500)
        reference.advance(500)
        assert probe.x[0] == pytest.approx(reference.x[0], abs=1e-3 * np.linalg.norm(v) * 1e-7)
        assert probe.v[0] == pytest.approx(reference.velocities()[0], abs=1e-3)
        assert probe.w[0] == pytest.approx(reference.spins()[0], abs=2e-3 * 3e5)
    assert len(probe.sim.contacts.measure_walls()["wall"]) == 1


def test_polydisperse_grains_have_reduced_radii_of_their_own():
    """At rest in a tube each overlaps by its own delta0 and feels no force."""
    radii = np.array([RADIUS, 0.5 * RADIUS])
    deltas = [
        ref.numbers(wall=True, material={"r": r}, R=reduced_radius(r, (1 / LARGE, 0.0))).delta0
        for r in radii
    ]
    x = [(LARGE - radii[0] + deltas[0], 0, 0), (0, LARGE - radii[1] + deltas[1], 0)]
    sim = Probe(make_scene(surfaces=[surface("cylinder")]), polydisperse(x, radii)).sim
    walls = sim.contacts.measure_walls()
    assert walls["overlap"] * 1e-6 == pytest.approx(deltas, rel=1e-6)
    assert np.abs(walls["force"]).max() * 1e-9 < 1e-4 * ref.numbers().F_c


# -- motion ----------------------------------------------------------------------------------------

STUCK = (-(LARGE - RADIUS) - 1e-10, 0, 0)  # of a grain in the tube or shell


def vector(values, unit):
    return [f"{a:.17g} {unit}" for a in values]


@pytest.mark.parametrize("kind", ["cylinder", "sphere"])
def test_only_relative_motion_counts(kind):
    """A surface that moves at a grain, and a grain that moves at a surface, to rounding."""
    way, spin, found = np.array([0.05, 0.2, -0.1]), (1e5, 2e5, -1e5), []
    for velocity, moving in ((way, True), (0 * way, False)):
        surfaces = [surface(kind, velocity=vector(velocity, "m/s"))]
        probe = probe_of(surfaces, STUCK, 0 * way if moving else -way, spin)
        probe.advance(4000)
        gone = velocity * 4000 * probe.dt
        found.append((probe.x[0] - gone, probe.w[0]))
        assert (probe.sim.ledger.measure().work != 0.0) == moving
    (x, w), (fixed_x, fixed_w) = found
    assert x == pytest.approx(fixed_x, abs=1e-9 * np.linalg.norm(fixed_x - STUCK) + 1e-15)
    assert w == pytest.approx(fixed_w, rel=1e-6)


def test_a_tube_that_turns_as_seen_in_its_frame():
    """A grain that a turning tube takes along, and one at a tube at rest in the frame that turns:
    both see inertia by other forces; they differ by the second order of the step."""
    rate = 3e4
    turn = np.array([0.0, 0.0, rate])
    probe = probe_of([surface("cylinder", spin=vector(turn, "rad/s"))], STUCK)
    probe.advance(6000)
    x, w, angle = probe.x[0], probe.w[0], -rate * 6000 * probe.dt
    frame = {"kind": "rotating_frame", "angular_velocity": vector(turn, "rad/s")}
    far = np.array([STUCK, FAR], float)
    scene = make_scene(surfaces=[surface("cylinder")], forces=[frame], dt="0.05 ns")
    seen = Probe(scene, sample_of(far, -np.cross(turn, far), -turn + 0 * far))
    seen.advance(6000)
    c, s = np.cos(angle), np.sin(angle)
    back = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = np.linalg.norm(x - STUCK)
    assert moved > 5e-9
    assert back @ x == pytest.approx(seen.x[0], abs=1e-4 * moved)
    assert w - turn == pytest.approx(seen.w[0], abs=1e-3 * rate)


@pytest.mark.parametrize(
    "keys",
    [{"axial_speed": "0.2 m/s"}, {"rotation": "5e4 rad/s"}, {"closing_speed": "0.02 m/s"}],
)
def test_the_ledger_has_the_work_of_a_tube(keys):
    """Energies, losses and the work of the tube, for each motion that it may have."""
    tube = {"kind": "tube", "radius": f"{LARGE:.17g} m", "axis": ["0 m", "0 m"], "gap": "40 um"}
    scene = make_scene(boundary=tube | keys, damping="viscoelastic", dt="0.02 ns")
    low = (0.0, 0.0, -10e-6)
    probe = Probe(scene, sample_of([STUCK, low]))
    before = balance(probe.sim.ledger.measure_energies())
    probe.advance(20_000)
    after = balance(probe.sim.ledger.measure_energies())
    stored, lost, work = after - before
    assert work > 0.0 and abs(stored + lost - work) < 2e-3 * (abs(work) + abs(lost))
    if "axial_speed" in keys:
        assert probe.v[0, 2] == pytest.approx(0.2, rel=0.5)
    if "closing_speed" in keys:
        assert probe.sim.domain.surfaces.tube_radius(1.0) == pytest.approx(6.0 - 0.02)
        assert probe.sim.domain.clock().filling_factor_at(20_000) > (
            probe.sim.domain.clock().filling_factor_at(0)
        )


def test_a_checkpoint_has_the_surfaces():
    spinning = surface("cylinder", spin=["0 rad/s", "0 rad/s", "1e5 rad/s"])
    sim = probe_of([spinning], STUCK).sim
    sim.stepper.advance(80)
    state = sim.state()
    sim.stepper.advance(120)
    end = sim.motion.measure().tobytes()
    again = probe_of([spinning], STUCK).sim
    again.restore(state)
    again.stepper.advance(120)
    assert again.motion.measure().tobytes() == end


# -- in YAML ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "surfaces, message",
    [
        ([{"kind": "cylindr", "radius": "6 um"}], r'surfaces\[0\].kind = "cylindr".*"cylinder"'),
        ([surface("plane")], r"surfaces\[0\].radius"),
        ([{"kind": "plane", "point": ["0 m"] * 3, "normal": [0, 0, 0]}], "a direction is needed"),
        (
            [{"kind": "plane", "point": ["0 m"] * 3, "normal": [0, 0, 1],
              "spin": ["0 rad/s", "0 rad/s", "1 rad/s"]}],
            r"surfaces\[0\].spin.*it has no centre to turn about",
        ),
    ],
)  # fmt: skip
def test_what_a_surface_cannot_be(surfaces, message):
    with pytest.raises(DustError, match=message):
        make_scene(surfaces=surfaces)


@pytest.mark.parametrize(
    "radius, message",
    [(0.5 * RADIUS, "the largest grain has 0.6"), (0.8e-6, r"surfaces\[0\]: grain 0 .* overlaps")],
)
def test_grains_must_fit(radius, message):
    with pytest.raises(DustError, match=message):
        probe_of([surface("sphere", radius)], (5e-6, 0, 0))


# -- in periodic cells, and in single precision ----------------------------------------------------

ROD = [surface("cylinder", grains="outside", axis=[1, 0, 0])]
ALONG = {"kind": "periodic", "axes": ["x"], "size": ["16 um", "fit", "fit"]}


def roll_along(boundary=None, precision="f64"):
    """A grain at a rod along x that slides, rolls and twists on it, through the face at 8 um."""
    x = np.array([(7.9e-6, 0, LARGE + RADIUS - 1e-10), (-7.9e-6, 0, LARGE + 3 * RADIUS)])
    v, w = np.array([(1.0, 0.3, 0), (0, 0, 0)]), np.array([(1e5, 5e5, 2e5), (0, 0, 0)])
    numerics = {"precision": precision}
    keys = {"boundary": boundary, "damping": "viscoelastic", "dt": "0.1 ns", "numerics": numerics}
    probe = Probe(make_scene(surfaces=ROD, **keys), sample_of(x, v, w))
    probe.advance(3000)
    assert len(probe.sim.contacts.measure_walls()["wall"]) == 1
    return probe.x[0], probe.w[0], np.linalg.norm(probe.x[0] - x[0])


def test_a_rod_through_the_faces_of_a_cell():
    """A grain that a search has put to its image goes on as in open space, to rounding."""
    (x, w, way), (seen, turning, _) = roll_along(), roll_along(ALONG)
    assert x[0] > 8.05e-6 and seen[0] < -7.8e-6
    assert seen + (16e-6, 0, 0) == pytest.approx(x, abs=1e-9 * way + 1e-19)
    assert turning == pytest.approx(w, abs=1e-6 * np.linalg.norm(w))


@pytest.mark.parametrize(
    "precision, error", [("f32", 5e-4), pytest.param("mixed", 1e-4, marks=pytest.mark.long)]
)
def test_lower_precision_is_the_same_model(precision, error):
    """In single precision a position of 6 um is rounded to 2.4e-13 m in each step, by chance up or
    down: after 3000 steps 6e-5 of the way, of which eight times as much is allowed; mixed rounds
    loads to 1e-7, which these steps carry on as in test_precision."""
    (x, w, way), (seen, turning, _) = roll_along(), roll_along(precision=precision)
    assert np.abs(seen - x).max() < error * way
    assert turning == pytest.approx(w, abs=error * np.linalg.norm(w))


CELL = {"kind": "periodic", "size": ["20 um"] * 3}
INSIDE = [(9e-6, 9e-6, 9e-6), (-9e-6, -9e-6, -9e-6)]


@pytest.mark.parametrize(
    "block, keys, message",
    [
        ({"kind": "sphere"}, {}, None),
        ({"kind": "sphere", "spin": ["0 rad/s", "0 rad/s", "1e5 rad/s"]}, {}, None),
        ({"kind": "sphere", "radius": "9 um"}, {}, "crosses the faces of the cell across x, or is"),
        ({"kind": "sphere", "radius": "9 um", "centre": ["0 m", "0 m", "40 um"],
          "velocity": ["0 m/s", "0 m/s", "-1 m/s"]},
         {"boundary": {"kind": "periodic", "axes": ["x", "y"], "size": ["20 um", "20 um", "fit"]}},
         "crosses the faces of the cell across x"),
        ({"kind": "sphere", "centre": ["0 m", "0 m", "40 um"],
          "velocity": ["0 m/s", "0 m/s", "-1 m/s"]},
         {"boundary": {"kind": "periodic", "axes": ["x", "y"], "size": ["20 um", "20 um", "fit"]}},
         None),
        ({"kind": "sphere", "velocity": ["0 m/s", "1 m/s", "0 m/s"]}, {},
         "it moves along y, which is periodic"),
        ({"kind": "sphere", "force": "1 nN", "direction": [0, 0, 1]}, {}, "it moves along z"),
        ({"kind": "cylinder", "velocity": ["0 m/s", "0 m/s", "1 m/s"]}, {}, None),
        ({"kind": "cylinder", "axis": [1, 0, 0]}, {}, None),
        ({"kind": "cylinder", "axis": [0.01, 0, 1]}, {}, "crosses the faces of the cell across z"),
        ({"kind": "sphere"}, {"boundary": CELL | {"strain_rate": "-1 s^-1"}},
         "the faces of a cell with surfaces must rest"),
    ],
)  # fmt: skip
def test_surfaces_in_a_cell(block, keys, message):
    """Those that stay away from its faces, or are the same along them."""
    block = {"radius": "6 um", "grains": "outside", "name": "body"} | block
    outcome = nullcontext() if message is None else pytest.raises(DustError, match=message)
    with outcome:
        scene = make_scene(**({"surfaces": [block], "boundary": CELL} | keys))
        prepare(scene, sample_of(INSIDE))
