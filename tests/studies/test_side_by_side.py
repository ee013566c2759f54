"""Collisions side by side in one simulation: each has the bits that it has alone."""

import json

import numpy as np
import pytest
from scenes import box, make_scene

from dusttaichi import samples
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.grains.build import build
from dusttaichi.grains.grain_engine import BODIES, GrainEngine
from dusttaichi.physics.geometry import label_components, number_by_first
from dusttaichi.samples.side_by_side import join_members
from dusttaichi.studies.collide import Collisions, side_by_side
from dusttaichi.studies.collide_batch import Batch, make_collisions
from dusttaichi.studies.collide_course import Collision
from dusttaichi.studies.collide_files import build_course_dataset

PAIRS = 50
SPEEDS = ("0.1 m/s", "8 m/s", "0.5 m/s")  # of one time step, which the scene states
# sums by channel that are added up in another order, and in single precision between two searches
LEDGER = ("loss", "compression_loss", "stretching_loss", "collision_loss", "residual")
ROUNDING = 1e-6  # of the impact energy


def collision_of(number, phases=False, scene_keys=(), **keys):
    body = {"kind": "pca", "grains": 8 + number % 4}
    sample = {
        "kind": "collision",
        "target": {**body, "seed": number},
        "projectile": {**body, "seed": 1000 + number},
        "speed": SPEEDS[number % 3],
        "impact_parameter": 0.1 * (number % 10),
        "seed": number,
        "gap": "5 nm",
    }
    settings = {"damping": "viscous", "dt": "0.2 ns", "sample": sample | keys}
    scene = make_scene(**settings | dict(scene_keys)).with_values({"stop": {"time": "500 ns"}})
    return Collision(number, scene, samples.make(scene), phases=phases)


def collide(collisions, abreast, room=10**9, signals=()):
    """label -> row, or the error, of Collisions at most that many side by side."""
    answers = {}
    make_collisions(
        collisions,
        lambda label, row, error=None: answers.setdefault(label, row or error),
        **{"abreast": abreast, "room": room, "signals": signals},
    )
    return answers


def assert_same(row, alone):
    """The bits of the collision alone; sums over contacts to rounding."""
    assert isinstance(row, dict), row
    for name, value in alone.items():
        if name == "course":
            (series, grain_numbers), (expected, _) = row[name].values(), value.values()
            assert grain_numbers == value["grains"]
            losses = [list(losses["loss"].values()) for losses in (series, expected)]
            np.testing.assert_allclose(*losses, rtol=0.0, atol=ROUNDING * alone["impact_energy"])
            assert {**series, "loss": 0} == {**expected, "loss": 0}
        elif name not in LEDGER:
            assert row[name] == value, name
        elif value is not None:
            scale = 1.0 if name == "residual" else alone["impact_energy"]
            numbers = [list(v.values()) if isinstance(v, dict) else v for v in (row[name], value)]
            np.testing.assert_allclose(*numbers, rtol=0.0, atol=ROUNDING * scale)


def test_fifty_pairs_have_the_bits_of_each_alone():
    """Of several sizes, on places that others have left, and with misses among them."""
    alone = [collision_of(n, phases=n % 2 == 0) for n in range(PAIRS)]
    alone = {label: row for collision in alone for label, row in collide([collision], 1).items()}
    outcomes = {row["outcome"] for row in alone.values()}
    assert len(outcomes) >= 4 and "miss" in outcomes
    together = collide((collision_of(n, phases=n % 2 == 0) for n in range(PAIRS)), 12)
    assert sorted(together) == list(range(PAIRS))
    for label, row in together.items():
        assert_same(row, alone[label])


@pytest.mark.parametrize("precision", ["mixed", "f32"])
def test_other_precisions_have_the_bits_of_each_alone(precision):
    numerics = {"numerics": {"precision": precision}}.items()
    alone = collide([collision_of(n, scene_keys=numerics) for n in range(8)], 1)
    together = collide([collision_of(n, scene_keys=numerics) for n in range(8)], 5)
    for label, row in together.items():
        assert_same(row, alone[label])


def test_small_pairs_are_examined_together(monkeypatch):
    """At multiples of 50 steps, whenever each touches; a shorter time after the touch is kept."""
    steps, advance = [], GrainEngine.advance

    def note(self, count):
        advance(self, count)
        steps.append(self.step)

    monkeypatch.setattr(GrainEngine, "advance", note)
    pairs = [collision_of(n, gap=f"{5 + n} nm") for n in (1, 4, 10)]
    rows = collide(pairs, 3)
    assert len({pair.touch for pair in pairs}) == 3
    assert steps == sorted(set(steps)) and not any(step % 50 for step in steps)
    assert all(0.0 <= rows[pair.label]["time"] <= 500e-9 for pair in pairs)
    short = collision_of(1)
    short.scene = short.scene.with_value("stop.time", "4 ns")
    assert collide([short], 1)[1]["time"] == pytest.approx(4e-9)


SIZES = {"kind": "power", "exponent": -2.5, "smallest": "0.4 um", "largest": "0.9 um"}


def polydisperse_collision(number):
    """Of grains of many sizes, and of two materials, where the number is even."""
    materials = {"materials": {"ice": "ice_t19"}, "dt": "0.1 ns"}
    keys = {}
    if number % 2 == 0:
        body = {"kind": "rbd", "grains": 9, "sizes": SIZES, "shares": {"default": 2, "ice": 1}}
        keys = {name: body | {"seed": number + k} for k, name in enumerate(BODIES)}
    return collision_of(number, phases=number % 3 == 0, scene_keys=materials.items(), **keys)


def test_grains_of_many_sizes_have_the_bits_of_each_alone(monkeypatch):
    """Pairs of equal grains are no neighbours of those with sizes: their kernels are others."""
    alone = collide([polydisperse_collision(n) for n in range(10)], 1)
    assert len({row["outcome"] for row in alone.values()}) >= 3
    sizes, compose = [], Batch._compose

    def note(self, entering):
        compose(self, entering)
        sizes.append(len(self.live))

    monkeypatch.setattr(Batch, "_compose", note)
    order = [0, 2, 4, 6, 8, 1, 3, 5, 7, 9]
    together = collide([polydisperse_collision(n) for n in order], 4)
    assert max(sizes) >= 3
    mixed = collide([polydisperse_collision(n) for n in range(10)], 4)
    for label, row in [*together.items(), *mixed.items()]:
        assert_same(row, alone[label])


def test_a_guard_ends_its_own_pair_alone(monkeypatch):
    """One that a look refuses, and one that stops a step of all: both halves begin again."""
    alone = collide([collision_of(n) for n in range(6)], 1)
    look, advance = Collision.validate, GrainEngine.advance
    faulty_position = collision_of(3).sample.positions[0, 0]

    def refuse(self, measurement):
        if self.label == 1:
            raise GuardStop("too deep")
        look(self, measurement)

    def stop(self, steps):
        if (self.sample.positions[:, 0] == faulty_position).any():
            raise GuardStop("not a number")
        advance(self, steps)

    monkeypatch.setattr(Collision, "validate", refuse)
    monkeypatch.setattr(GrainEngine, "advance", stop)
    together = collide((collision_of(n) for n in range(6)), 6)
    assert [n for n, row in sorted(together.items()) if not isinstance(row, dict)] == [1, 3]
    assert str(together[1]) == "too deep" and str(together[3]) == "not a number"
    for label in (0, 2, 4, 5):
        assert_same(together[label], alone[label])


def interrupt_after(monkeypatch, count):
    """Signals that get one once an engine has advanced `count` times."""
    signals, advance, calls = [], GrainEngine.advance, []

    def note(self, steps):
        calls.append(steps)
        signals.extend([2] * (len(calls) == count))
        advance(self, steps)

    monkeypatch.setattr(GrainEngine, "advance", note)
    return signals


def check_continued(monkeypatch, make, count, pauses):
    """Interrupted after each of these pauses, `count` collisions have the rows of those alone."""
    alone = collide([make(n) for n in range(count)], 1)
    rows, waiting = {}, {n: make(n) for n in range(count)}
    for pause in [*pauses, 10**9]:
        with monkeypatch.context() as patch:
            signals = interrupt_after(patch, pause)
            answers = collide(waiting.values(), 4, signals=signals)
        checkpoints = {n: answer.pop("checkpoint", None) for n, answer in answers.items()}
        rows |= {n: answers[n] for n, checkpoint in checkpoints.items() if checkpoint is None}
        waiting = {n: make(n) for n in waiting if n not in rows}
        assert waiting or pause == 10**9
        for n in waiting.keys() & checkpoints:
            waiting[n] = make(n, json.loads(json.dumps(checkpoints[n])))
    assert sorted(rows) == list(range(count))
    for n in range(count):
        assert_same(rows[n], alone[n])


def test_interrupted_collisions_continue_their_checkpoints(monkeypatch):
    """With the bits of those without an interruption, beside others than before."""

    def make(number, checkpoint=None):
        collision = collision_of(number, phases=number % 2 == 0)
        collision.files, collision.checkpoint = number == 2, checkpoint
        return collision

    check_continued(monkeypatch, make, 8, (2, 20, 30))


def test_an_interrupted_collision_between_walls_continues(monkeypatch):
    """It has the state of its simulation."""

    def make(number, checkpoint=None):
        walls = {"boundary": box(size=(2e-5, 2e-5, 2e-5))}
        collision = collision_of(1, scene_keys=walls.items())
        collision.label, collision.checkpoint = number, checkpoint
        return collision

    check_continued(monkeypatch, make, 1, (2, 3))


def test_each_has_a_file_on_request():
    collision = collision_of(1)
    collision.files = True
    row = collide([collision, collision_of(2)], 2)[1]
    data = build_course_dataset(json.loads(json.dumps(row["course"])))
    # its last record is that of the row, and its fragments are those of its grains
    total = row["impact_energy"]
    np.testing.assert_allclose(data.kinetic[-1], row["kinetic"])
    for name, lost in row["loss"].items():
        assert float(data.loss.sel(channel=name)[-1]) == pytest.approx(lost, abs=ROUNDING * total)
    assert np.bincount(data.fragment).tolist() == row["fragments"]
    assert data.position.dims == ("moment", "grain", "xyz") and data.position.attrs["units"] == "m"
    np.testing.assert_allclose(data.position[0], collision.sample.positions, rtol=1e-12, atol=1e-18)
    assert not np.allclose(data.position[1], data.position[0], rtol=1e-3)


def test_members_do_not_see_each_other():
    """Even where the search finds them in the same cells; one at rest touches nothing."""
    collision = collision_of(0)
    sim = build(
        collision.scene,
        join_members([collision.sample] * 3, collision.scene.material.radius),
        step=collision.time_step,
    )
    members, count = sim.members, len(collision.sample)
    sim.grain_state["origin"] = np.zeros((sim.size, 3))
    sim.search.ask()
    sim.advance(50)
    pairs = [np.subtract(members.touching(k)[1:], k * count) for k in range(3)]
    assert pairs[0].size and all(np.array_equal(pairs[0], member_pairs) for member_pairs in pairs)
    looks = members.measure(range(3), [True, False, True])
    assert looks[1].measurement is None and not looks[1].fragment.size
    label = label_components(sim.grain_state.order[pairs[0].T], count)[1]
    for look in looks[::2]:
        np.testing.assert_array_equal(number_by_first(look.fragment), label)
    i, j = sim.grain_state.pairs()
    assert np.array_equal(i // count, j // count)
    members.rest(1)
    sim.advance(50)
    assert len(members.touching(1)[0]) == 0 and len(members.touching(2)[0])
    assert not sim.grain_state["v"][members.grains(1)].any()
    # what the list of contacts says of a stranger is an error
    sim.grain_state["body"] = np.repeat([0, -1, 0], count)
    sim.search.ask()
    sim.advance(1)
    for measure in (members.touching, lambda member: members.measure([member], [True])):
        with pytest.raises(RuntimeError, match="touch those of another"):
            [measure(k) for k in (0, 2)]


def test_how_many_are_side_by_side(tmp_path):
    scene = collision_of(0).scene
    assert side_by_side(scene, "off")["abreast"] == 1
    assert side_by_side(scene, "7")["abreast"] == side_by_side(scene, 7)["abreast"] == 7
    assert side_by_side(scene, "auto")["room"] < side_by_side(scene, 7)["room"]
    # walls, gravity and a sphere act on what is there: one at a time
    boxed = make_scene(boundary=box(size=(1e-4, 1e-4, 1e-4)))
    assert side_by_side(boxed, 7)["abreast"] == 1
    in_gas = scene.with_value("forces", [{"kind": "gas_drag", "stopping_time": "1 us"}])
    assert side_by_side(in_gas, 7)["abreast"] == 1
    for wrong in ("many", 0, "-1"):
        with pytest.raises(DustError, match="allowed: auto, off, or a number of at least 1"):
            side_by_side(scene, wrong)
    with pytest.raises(DustError, match="has no block `collisions`"):
        Collisions(scene, tmp_path)
