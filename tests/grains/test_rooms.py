"""Kernels are compiled for a room of grains, not for their number."""

import numpy as np
import pytest
from compilers import taichi_alone
from scenes import RADIUS, Probe, box, make_scene, sample_of

from dusttaichi.compute import compiler, memory
from dusttaichi.compute.engine import ti
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.walls import make_box
from dusttaichi.errors import GuardStop
from dusttaichi.grains import build, compiled_grains, layout_choice
from dusttaichi.grains.kernels import store

SPACING = 2.0 * RADIUS - 1e-10


def rows_of_grains(number, effects=("rolling", "sliding", "twisting"), moving=0):
    """A probe of `number` grains in rows of ten that touch, on a floor, of which one moves."""
    values = np.array([(n % 10, n // 10, 0) for n in range(number)]) * SPACING
    scene = make_scene(
        boundary=box("bottom", "x_min", "x_max"),
        effects=effects,
        dt="0.1 ns",
        numerics={"skin": 0.01},
    )
    velocities = np.zeros((number, 3))
    velocities[moving] = 1.0, 2.0, 3.0
    return Probe(scene, sample_of(values, velocities))


def test_a_room_holds_its_grains_and_wastes_little():
    for grains in (1, 2, 1024, 1025, 16384, 16385, 65536, 70000, 1_000_000):
        room = memory.capacity_for(grains)
        assert room >= grains
        if grains > memory.COARSE:
            assert room <= 1.25 * grains
    rooms = [memory.capacity_for(n) for n in range(1, 100_000, 37)]
    assert rooms == sorted(rooms)
    assert len(set(rooms)) < 20


@pytest.mark.long  # writes a cache of its own
def test_scenes_of_one_room_share_their_kernels(tmp_path, monkeypatch):
    monkeypatch.setenv(compiler.variable(compiler.KERNEL_FOLDER), str(tmp_path))

    def kernels_after(number, threads):
        monkeypatch.setattr(build, "threads_of", lambda scene, grains: threads)
        probe = rows_of_grains(number, ())  # quick to compile
        probe.advance(3)
        probe.energy()
        ti.reset()  # the cache is written now
        return {path.name for path in tmp_path.rglob("*.*c")}  # .tic or .qdc

    first = kernels_after(7, 1)
    assert len(first) > 5
    assert kernels_after(43, 1) == first
    assert kernels_after(20, 2) == first


@pytest.fixture(scope="module")
def states():
    """State after some steps: in the usual room, and in one of exactly the number of grains, with
    the smaller capacity for wall contacts."""
    with pytest.MonkeyPatch.context() as patch:
        wide = settle_rows()
        patch.setattr(compiled_grains, "capacity_for", lambda grains: grains)
        patch.setattr(build, "has_few_wall_contacts", lambda *_: True)
        return wide, settle_rows()


def settle_rows():
    probe = rows_of_grains(23)
    probe.advance(300)
    arrays, contacts = dict(probe.sim.grain_state.arrays()), probe.contacts()
    return (
        arrays,
        probe.sim.ledger.measure_energies() | {"searches": probe.sim.search.count},
        contacts,
    )


def test_the_room_does_not_show_in_the_results(states):
    (wide, m, contacts), (tight, n, same) = states
    assert m["searches"] > 1 and wide.keys() == tight.keys()
    # what the workers leave behind of the last call; rooms
    alike = [a for a in set(wide) - {"sync", "counts"} if wide[a].shape == tight[a].shape]
    assert {"x", "v", "w", "pair_i", "pair_j", "wall_slot", "loss"} <= set(alike)
    for name in alike:
        assert wide[name].tobytes() == tight[name].tobytes(), name
    for name in m:
        assert np.array_equal(m[name], n[name]), name
    assert contacts.keys() == same.keys() and min(j for _, j in contacts) < 0
    for key, expected in contacts.items():
        assert all(np.array_equal(a, b) for a, b in zip(expected, same[key], strict=True)), key


def room_of(size, *walls, edges=None):
    """(Box, Cell or None) of lengths size (3,) [um]; edges: of a cell that repeats along them."""
    low, size = np.zeros(3), np.array(size, float)
    made = make_box(make_scene(boundary=box(*walls)).boundary, low, low + size, size)
    if edges is None:
        return made, None
    axes = tuple(np.flatnonzero(edges))
    return made, Cell(np.array(edges, float), np.zeros(3), np.zeros(3), low, axes)


def test_samples_with_few_wall_contacts_take_less_memory():
    """At a filling factor of 0.2 few of 1e5 grains in a cube reach the walls. Many do of a slab, a
    tower, grains with an open side, few grains, and a small grain among large ones."""
    grains, radius = 100_000, 0.6
    edge = (grains * 4.0 / 3.0 * np.pi * radius**3 / 0.2) ** (1.0 / 3.0)
    cube = room_of([edge] * 3)
    assert layout_choice.has_few_wall_contacts(*cube, grains, radius)
    assert not layout_choice.has_few_wall_contacts(
        *room_of([4 * edge, 4 * edge, edge / 16]), grains, radius
    )
    assert not layout_choice.has_few_wall_contacts(
        *room_of([edge / 4, edge / 4, 16 * edge]), grains, radius
    )
    assert not layout_choice.has_few_wall_contacts(
        *room_of([edge] * 3, "bottom", "top"), grains, radius
    )
    repeats = room_of([1, 1, edge], "bottom", "top", edges=[edge, edge, 0])
    assert layout_choice.has_few_wall_contacts(*repeats, grains, radius)
    assert not layout_choice.has_few_wall_contacts(*cube, grains, radius / 3.0)
    few = room_of([edge / 4] * 3)
    assert not layout_choice.has_few_wall_contacts(*few, grains // 64, radius)
    assert not layout_choice.has_few_wall_contacts(None, None, grains, radius)
    for n in (20_000, 100_000, 1_000_000):
        small, large = (store.wall_contacts(n, few) for few in (True, False))
        assert small == pytest.approx(large - n)
        assert small <= store.wall_contacts(memory.capacity_for(n), few=True)


def test_without_room_for_walls_a_run_stops_with_advice(monkeypatch):
    # a capacity of grains that no other test has: this structure serves none of them
    monkeypatch.setattr(compiled_grains, "capacity_for", lambda grains: grains)
    monkeypatch.setattr(store, "wall_contacts", lambda grains, few: 0)
    with pytest.raises(GuardStop, match=r"near walls than their capacity.*numerics.skin"):
        rows_of_grains(200)


def test_a_checkpoint_is_as_large_as_its_scene(states):
    arrays = states[0][0]
    assert len(arrays["x"]) == 23 + 2
    assert sum(a.nbytes for a in arrays.values()) < 23 * 10_000
    counts, width = arrays["counts"], arrays["pair_i"].shape[1]
    pairs, on_walls = -(-counts[store.PAIRS] // width), counts[store.WALL_BLOCKS]
    assert len(arrays["pair_i"]) == len(arrays["pair_j"]) == pairs, "not its capacity"
    assert len(arrays["contact"]) == len(arrays["load"]) == pairs + on_walls
    assert len(arrays["entry"]) == arrays["entry_start"][-1]


@taichi_alone
def test_memory_is_where_taichi_has_it():
    """First and last row of each field: a kernel writes what the memory has."""
    tables = list(rows_of_grains(12).sim.fields.values())
    fields = [table.field for table in tables]
    last = [table.rows - 1 for table in tables]

    @ti.kernel
    def mark():
        for k in ti.static(range(len(fields))):
            ends = ti.Vector([0 for _ in range(len(fields[k].shape))])
            fields[k][ends] = 0 * fields[k][ends] + 2 * k + 1
            ends[0] = last[k]
            fields[k][ends] = 0 * fields[k][ends] + 2 * k

    mark()
    for k, table in enumerate(tables):
        array = table.to_numpy()
        first, end = (np.ravel(array[row])[0] for row in (0, -1))
        assert end == 2 * k and first == (2 * k + 1 if last[k] else 2 * k)
    table = tables[0]
    values = (100 * np.random.default_rng(1).random(table.to_numpy().shape)).astype(
        table.memory.dtype
    )
    table.from_numpy(values)
    assert np.array_equal(table.field.to_numpy()[: table.rows], values)


def test_without_shared_memory_the_used_rows_are_written_alone():
    rows_of_grains(3)  # starts the compiler, if no other test has
    field = ti.field(ti.f64, shape=(6, 2))
    table = memory.Table(field, rows=4)
    field.fill(7.0)
    table.from_numpy(np.zeros((3, 2)))
    assert table.to_numpy().shape == (4, 2)
    assert np.array_equal(field.to_numpy()[:, 0], [0, 0, 0, 7, 7, 7])
    with pytest.raises(ValueError, match="5 rows"):
        table.from_numpy(np.zeros((5, 2)))
    with pytest.raises(ValueError, match="7 rows of a field of 6"):
        memory.Table(field, rows=7)


def test_memory_that_is_gone_is_not_looked_at():
    sim = rows_of_grains(3).sim
    rows_of_grains(4)
    with pytest.raises(RuntimeError, match="another one was built"):
        sim.fields["x"].to_numpy()


def test_a_smaller_scene_has_its_own_energies():
    """Sums over grains of a larger one that the same kernels have served are none of it."""
    rows_of_grains(600, moving=599).energy()
    probe = rows_of_grains(7)
    found = probe.sim.ledger.measure_energies()
    # one of them moves, at 1, 2, 3 m/s; what forces add in half a step is below 1e-3 of it
    moving = 0.5 * probe.sim.bodies.unit_mass * 14.0
    assert found["kinetic_translation"] == pytest.approx(moving, rel=1e-3)
    assert found["kinetic_rotation"] < 1e-3 * moving


@pytest.mark.parametrize("method", ["contacts.restore", "search.update", "stepper.advance"])
def test_what_was_interrupted_does_not_show_in_the_next_scene(states, method, monkeypatch):
    """A build, a search and a run of a state that differs, each stopped at its end."""
    part, name = method.split(".")
    kind = type(getattr(rows_of_grains(23).sim, part))
    original = getattr(kind, name)

    def stop(*arguments, **options):
        original(*arguments, **options)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(kind, name, stop)
        rows_of_grains(40, moving=35).advance(50)
    expected, (arrays, _, _) = states[0][0], settle_rows()
    for name in set(expected) - {"sync"}:
        assert arrays[name].tobytes() == expected[name].tobytes(), name


def test_kernels_serve_again():
    """A process that builds scene after scene of one make compiles once; a simulation whose fields
    the next has taken over does not touch them."""
    first = rows_of_grains(7)
    first.advance(3)
    x = first.x
    second = rows_of_grains(7)
    assert second.sim.kernels is first.sim.kernels
    with pytest.raises(RuntimeError, match="another one was built"):
        first.advance(1)
    second.advance(3)
    np.testing.assert_array_equal(second.x, x)
    assert rows_of_grains(7, ()).sim.kernels is not first.sim.kernels
