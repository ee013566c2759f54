"""Surfaces under a controlled load: as walls, with JKR's overlap; stages, stop conditions, ends."""

import numpy as np
import pytest
from domain.test_servo import overlap_under
from scenes import RADIUS, Probe, balance, make_scene, sample_of

from dusttaichi.domain.servo import EVERY
from dusttaichi.errors import DustError
from dusttaichi.scene.drive import Drive

SIDE = 2.0 * RADIUS - 1e-10  # of the cells of a cubic lattice
LATTICE = SIDE * np.array(np.meshgrid(*[np.arange(3)] * 3)).reshape(3, -1).T
HEIGHT = 3.0 * SIDE


OPEN_TOP = {"omit": ["top"]}


def lengths(values):
    return [f"{value:.17g} m" for value in values]


def plane(z, **keys):
    return {"kind": "plane", "name": "lid", "point": lengths((0.0, 0.0, z)), "normal": [0, 0, -1],
            **keys}  # fmt: skip


def press(boundary, surfaces=(), **keys):
    scene = make_scene(
        boundary={"kind": "box", "size": lengths((HEIGHT,) * 3)} | boundary,
        surfaces=surfaces,
        damping="viscoelastic",
        **keys,
    )
    return Probe(scene, sample_of(LATTICE))


def pressed_by(boundary, surfaces=()):
    """After forty changes of speed: places [m], shift of the lid [um], changes of the energies."""
    probe = press(boundary, surfaces)
    top = probe.sim.domain.box.planes(0.0)[5]
    start = balance(probe.sim.ledger.measure_energies())
    probe.advance(40 * EVERY)
    domain, time = probe.sim.domain, probe.sim.environment.time
    if surfaces:
        shift = domain.surfaces.displacement_of("lid", time)
    else:
        shift = top - domain.box.planes(time)[5]
    return probe.x, shift, balance(probe.sim.ledger.measure_energies()) - start


@pytest.mark.parametrize("load", ["pressure", "force"])
def test_a_plane_under_a_load_is_the_top_wall(load):
    """The same steps of the same controller: speed, shift and work differ by the rounding of one
    contact, which the controller carries on; a force is the pressure times the area."""
    wall_way = {"pressure": "20 kPa", "wall_speed": "1 m/s"}
    values = {"pressure": "20 kPa", "force": f"{20e3 * HEIGHT**2:.17g} N"}
    top = press(wall_way).sim.domain.box.planes(0.0)[5] * 1e-6
    lid = plane(top, largest_speed="1 m/s", **{load: values[load]})
    (x, shift, changes), (seen, pressed, found) = pressed_by(wall_way), pressed_by(OPEN_TOP, [lid])
    assert shift > 1e-5 and pressed == pytest.approx(shift, rel=1e-6)
    assert np.abs(seen - x).max() < 1e-6 * np.abs(x - LATTICE - (x[0] - LATTICE[0])).max()
    assert found == pytest.approx(changes, rel=1e-6)
    stored, lost, work = found
    assert work > 0.0 and abs(stored + lost - work) < 1e-3 * work


def test_a_sphere_held_at_a_force_has_the_overlap_of_jkr():
    """An indenter on a grain on the floor: each of both contacts at rest under that force."""
    force, large = 4e-8, 6e-6
    x = np.array([(0.0, 0.0, RADIUS - 1e-10), (30e-6, 0.0, RADIUS - 1e-10)])
    ball = {"kind": "sphere", "name": "ball", "grains": "outside", "radius": lengths([large])[0],
            "centre": lengths((0.0, 0.0, 2 * RADIUS + large - 2e-10)), "direction": [0, 0, -2],
            "force": f"{force} N"}  # fmt: skip
    floor = {"kind": "box", "omit": ["x_min", "x_max", "y_min", "y_max", "top"],
             "at": {"z": ["0 m", "20 um"]}}  # fmt: skip
    scene = make_scene(boundary=floor, surfaces=[ball], damping="viscoelastic", dt="0.3 ns")
    probe = Probe(scene, sample_of(x))
    probe.advance(800 * EVERY)
    table, walls = probe.sim.contact_table, probe.sim.contacts.measure_walls()
    mine = walls["grain"] == 0
    overlaps = dict(zip(walls["wall"][mine].tolist(), walls["overlap"][mine] * 1e-6, strict=True))
    assert overlaps[4] == pytest.approx(overlap_under(force, table.wall((0, RADIUS))), rel=2e-3)
    assert overlaps[6] == pytest.approx(
        overlap_under(force, table.surface((0, RADIUS), 0)), rel=2e-3
    )


def go_on(sim):
    """Pressed, held where it is, pulled back, pressed with a force."""
    sim.stepper.advance(5 * EVERY)
    assert sim.domain.surfaces.velocities[0, 2] < 0.0
    sim.stepper.drive(Drive.model_validate({"surfaces": {"lid": {"velocity": ["0 m/s"] * 3}}}))
    held = sim.domain.surfaces.displacement_of("lid", sim.environment.time)
    sim.stepper.advance(100)
    assert sim.domain.surfaces.displacement_of("lid", sim.environment.time) == pytest.approx(
        held, rel=1e-12
    )
    up = ["0 m/s", "0 m/s", "1 m/s"]
    sim.stepper.drive(Drive.model_validate({"surfaces": {"lid": {"velocity": up}}}))
    sim.stepper.advance(100)
    shift = sim.domain.surfaces.displacement_of("lid", sim.environment.time)
    assert shift == pytest.approx(held - 100 * sim.dt)
    sim.stepper.drive(Drive.model_validate({"surfaces": {"lid": {"force": "20 nN"}}}))
    (servo,) = sim.domain.surfaces.servos
    assert not servo.per_area and servo.load == pytest.approx([20.0])
    assert servo.speed == pytest.approx([-1.0])  # that of the stage before
    return sim.motion.measure().tobytes()


def test_stages_move_it_and_a_checkpoint_has_its_load():
    """A simulation that is resumed has the same bits."""
    lid = plane(2.0 * SIDE + RADIUS, largest_speed="1 m/s", pressure="20 kPa")
    first = press(OPEN_TOP, [lid]).sim
    first.stepper.advance(6 * EVERY + 7)
    state = first.state()
    end = go_on(first)
    again = press(OPEN_TOP, [lid]).sim
    again.restore(state)
    assert go_on(again) == end


# -- in YAML ---------------------------------------------------------------------------------------

BALL = {"kind": "sphere", "radius": "6 um", "name": "ball", "direction": [0, 0, -1]}


@pytest.mark.parametrize(
    "surface, keys, message",
    [
        ({"force": "1 nN", "direction": None}, {}, r"force.*acts along a direction, and there is"),
        ({"force": "1 nN", "pressure": "1 kPa"}, {}, "force is given already"),
        ({"force": "0 N"}, {}, "must not be 0; to release the surface give a velocity"),
        ({"pressure": "1 kPa"}, {}, r"surfaces\[0\].pressure.*no area is defined; give"),
        ({"force": "1 nN", "velocity": ["0 m/s", "0 m/s", "1 m/s"]}, {}, "a velocity across that"),
        ({"direction": [0, 0, 0]}, {}, "a direction is needed"),
        ({"name": "tube"}, {}, "it is used already"),
        ({"name": None}, {"stop": {"steps": 1, "surfaces": {"ball": {"force": {"above": "1 nN"}}}}},
         r"stop.surfaces.ball.*there is no surface of that name; give one of `surfaces`"),
        ({}, {"stop": {"steps": 1, "surfaces": {"lid": {"force": {"above": "1 nN"}}}}},
         "no surface of that name; allowed: ball"),
        ({}, {"stop": {"surfaces": {"ball": {"force": {"above": "1 nN"}}}}},
         "add a time or steps as the latest end"),
        ({}, {"stop": {"steps": 1, "surfaces": {"ball": {"force": {}}}}},
         "above, below or both are needed, for example {below: 20 nN}"),
        ({}, {"stop": {"steps": 1, "surfaces": {"ball": {"pressure": {"above": "1 kPa"}}}}},
         r"stop.surfaces.ball.pressure.*no area is defined"),
    ],
)  # fmt: skip
def test_what_a_load_cannot_be(surface, keys, message):
    block = {key: value for key, value in (BALL | surface).items() if value is not None}
    with pytest.raises(DustError, match=message):
        make_scene(surfaces=[block], **keys)


def test_a_stage_that_drives_what_is_not_there():
    stage = {"name": "a", "drive": {"surfaces": {"lid": {"force": "1 nN"}}}, "stop": {"steps": 1}}
    text = r"stages\[0\].drive.surfaces.lid.*there is no surface of that name; allowed: ball"
    with pytest.raises(DustError, match=text):
        make_scene(surfaces=[BALL], stages=[stage], stop=None)
    spin = {"spin": ["0 rad/s", "0 rad/s", "1 rad/s"]}
    spin = {"name": "a", "drive": {"surfaces": {"lid": spin}}, "stop": {"steps": 1}}
    with pytest.raises(DustError, match=r"stages\[0\].drive.surfaces.lid.spin.*no centre"):
        make_scene(surfaces=[plane(1e-5)], stages=[spin], stop=None)
