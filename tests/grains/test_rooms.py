"""Kernels are compiled for a room of grains, not for their number."""

import numpy as np
import pytest
from scenes import RADIUS, Probe, box, make_scene, sample_of

from dusttaichi import compiler
from dusttaichi.compute import memory
from dusttaichi.compute.engine import ti
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.walls import make_box
from dusttaichi.errors import GuardStop
from dusttaichi.grains import build
from dusttaichi.grains.kernels import store

SPACING = 2.0 * RADIUS - 1e-10


def rows_of_grains(number, effects=()):
    """A probe of `number` grains in rows of ten that touch, on the floor of a box."""
    places = np.array([(n % 10, n // 10, 0) for n in range(number)]) * SPACING
    scene = make_scene(
        boundary=box("bottom", "x_min", "x_max"),
        effects=effects,
        dt="0.1 ns",
        numerics={"skin": 0.01},
    )
    velocities = np.zeros((number, 3))
    velocities[0] = 1.0, 2.0, 3.0
    return Probe(scene, sample_of(places, velocities))


def test_a_room_holds_its_grains_and_wastes_little():
    for grains in (1, 2, 1024, 1025, 16384, 16385, 65536, 70000, 1_000_000):
        room = memory.capacity_for(grains)
        assert room >= grains
        if grains > memory.COARSE:
            assert room <= 1.25 * grains
    rooms = [memory.capacity_for(n) for n in range(1, 100_000, 37)]
    assert rooms == sorted(rooms)
    assert len(set(rooms)) < 20


def test_scenes_of_one_room_share_their_kernels(tmp_path, monkeypatch):
    monkeypatch.setenv(compiler.variable(compiler.KERNEL_FOLDER), str(tmp_path))

    def kernels_after(number, threads):
        monkeypatch.setattr(build, "threads_of", lambda scene, grains: threads)
        probe = rows_of_grains(number)
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
    """State after some steps: in the usual room, and in one of exactly the number of grains."""
    out = []
    for room in (memory.capacity_for, lambda grains: grains):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(build, "capacity_for", room)
            out.append(settled())
    return out


def settled():
    probe = rows_of_grains(23, ("rolling", "sliding", "twisting"))
    probe.advance(300)
    return probe.sim.arrays(), probe.sim.measure(), probe.sim.search.count


def test_the_room_does_not_show_in_the_results(states):
    (wide, m, searches), (tight, n, same) = states
    assert searches == same > 1
    assert wide.keys() == tight.keys()
    for name in wide:
        if name != "sync":  # what the workers leave behind of the last call
            assert wide[name].tobytes() == tight[name].tobytes(), name
    for name in m:
        assert np.array_equal(m[name], n[name]), name


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
    assert build.has_few_wall_contacts(*cube, grains, radius)
    assert not build.has_few_wall_contacts(
        *room_of([4 * edge, 4 * edge, edge / 16]), grains, radius
    )
    assert not build.has_few_wall_contacts(
        *room_of([edge / 4, edge / 4, 16 * edge]), grains, radius
    )
    assert not build.has_few_wall_contacts(*room_of([edge] * 3, "bottom", "top"), grains, radius)
    repeats = room_of([1, 1, edge], "bottom", "top", edges=[edge, edge, 0])
    assert build.has_few_wall_contacts(*repeats, grains, radius)
    assert not build.has_few_wall_contacts(*cube, grains, radius / 3.0)
    few = room_of([edge / 4] * 3)
    assert not build.has_few_wall_contacts(*few, grains // 64, radius)
    assert not build.has_few_wall_contacts(None, None, grains, radius)
    for n in (20_000, 100_000, 1_000_000):
        small, large = (store.wall_contacts(n, few) for few in (True, False))
        assert small == pytest.approx(large - n)
        assert small <= store.wall_contacts(memory.capacity_for(n), few=True)


def test_room_for_walls_does_not_show_in_the_results(states, monkeypatch):
    monkeypatch.setattr(build, "has_few_wall_contacts", lambda *_: True)
    (wide, m, searches), (small, n, same) = states[0], settled()
    assert searches == same
    for name in ("x", "v", "w", "wall_slot"):
        assert wide[name].tobytes() == small[name].tobytes(), name
    for name in m:
        assert np.array_equal(m[name], n[name]), name


def test_without_room_for_walls_a_run_stops_with_advice(monkeypatch):
    monkeypatch.setattr(store, "wall_contacts", lambda grains, few: 0)
    with pytest.raises(GuardStop, match=r"near walls than their capacity.*numerics.skin"):
        rows_of_grains(200)


def test_a_checkpoint_is_as_large_as_its_scene(states):
    arrays = states[0][0]
    assert len(arrays["x"]) == 23 + 2
    assert sum(a.nbytes for a in arrays.values()) < 23 * 10_000


def test_memory_is_where_taichi_has_it():
    sim = rows_of_grains(12).sim
    rng = np.random.default_rng(1)
    for name, table in sim.fields.items():
        assert np.array_equal(table.to_numpy(), table.field.to_numpy()[: table.rows]), name
    for name in ("x", "contact", "wall_slot", "loss", "entry"):
        table = sim.fields[name]
        values = (100 * rng.random(table.to_numpy().shape)).astype(table.memory.dtype)
        table.from_numpy(values)
        assert np.array_equal(table.field.to_numpy()[: table.rows], values), name


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


def test_memory_that_is_gone_is_not_looked_at():
    sim = rows_of_grains(3).sim
    rows_of_grains(4)
    with pytest.raises(RuntimeError, match="another one was built"):
        sim.fields["x"].to_numpy()


def test_kernels_serve_again():
    """A process that builds scene after scene of one make compiles once; a simulation whose fields
    the next has taken over does not touch them."""
    first = rows_of_grains(7)
    first.advance(3)
    x = first.x
    second = rows_of_grains(7)
    assert second.sim.compiled is first.sim.compiled
    with pytest.raises(RuntimeError, match="another one was built"):
        first.advance(1)
    second.advance(3)
    np.testing.assert_array_equal(second.x, x)
    assert rows_of_grains(7, ("rolling",)).sim.compiled is not first.sim.compiled
