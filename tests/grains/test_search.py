"""Neighbour search against brute force, while grains move; their order; bits and threads."""

import os
from types import SimpleNamespace

import numpy as np
import pytest
from scenes import FAR, RADIUS, Probe, box, make_scene, sample_of

from dusttaichi import samples
from dusttaichi.compute import backend, compiler
from dusttaichi.grains.kernels.list_entries import decode_entries
from dusttaichi.grains.kernels.store import OPPOSITE
from dusttaichi.grains.order import PART, grain_order

GRAINS = 300
FREE = {"boundary": FAR, "dt": "0.1 ns"}


def make_gas(seed=31, speed=20.0):
    """A dense gas: sites of a loose lattice, random velocities [m/s], random spins."""
    rng = np.random.default_rng(seed)
    sites = np.stack(np.meshgrid(*[np.arange(7)] * 3, indexing="ij"), -1).reshape(-1, 3)[:GRAINS]
    x = sites * 2.15 * RADIUS + rng.uniform(-0.07, 0.07, (GRAINS, 3)) * RADIUS
    return x, speed * rng.normal(size=(GRAINS, 3)), 1e6 * rng.normal(size=(GRAINS, 3))


def overlaps(x):
    d = np.linalg.norm(x[:, None] - x[None], axis=-1)
    return 2 * RADIUS - d


def test_contacts_against_brute_force():
    """Every pair that overlaps is an active contact, and none that is past pull-off."""
    probe = Probe(make_scene(**FREE, numerics={"skin": 0.05}), sample_of(*make_gas()))
    formed = 0
    for _ in range(60):
        probe.advance(25)
        active = set(probe.contacts())
        gap = overlaps(probe.x)
        # rounding of positions: a pair within 1e-17 m of touching may be seen either way
        assert set(zip(*np.nonzero(np.triu(gap > 1e-17, 1)), strict=True)) <= active
        assert not any(gap[pair] < -0.1373e-9 for pair in active)
        assert probe.sim.ledger.measure_energies()["contacts"] == len(active)
        formed = max(formed, len(active))
    assert formed > 10 and probe.sim.search.count > 10


def test_each_contact_is_in_the_lists_of_both_grains():
    """With opposite forces, also after loads are put back."""
    probe = Probe(make_scene(**FREE, numerics={"skin": 0.05}), sample_of(*make_gas()))
    probe.advance(400)
    sim = probe.sim
    state, i, j = sim.grain_state, *sim.grain_state.pairs()
    start, entry = state["entry_start"], state["entry"]
    for grain in range(GRAINS):
        listed = entry[start[grain] : start[grain + 1]]
        assert listed[-1] == -1
        contacts, is_second = decode_entries(listed[:-1], sim.layout.width)
        expected = [np.flatnonzero(j == grain), np.flatnonzero(i == grain)]
        assert np.array_equal(contacts, np.concatenate(expected))
        assert np.array_equal(is_second, np.repeat([True, False], [len(n) for n in expected]))
    sim.stepper.evaluate()
    loads = state.fields["load"].to_numpy(state.used_blocks()[0].stop)
    assert np.any(loads[:, :3]) and np.array_equal(loads[:, OPPOSITE:12], -loads[:, :3])


def test_fast_grain_is_not_missed():
    """A bullet of 500 m/s through a gap-free line of sight: it has to touch what stands in its way
    at the first step that finds an overlap, with every time a new search between."""
    rng = np.random.default_rng(33)
    x = np.zeros((GRAINS, 3))
    x[:, 0] = np.arange(GRAINS) * 40 * RADIUS
    x[:, 1:] = rng.uniform(-1, 1, (GRAINS, 2)) * RADIUS * 0.1
    x[0] = x[1] - [7 * RADIUS, 0, 0]
    v = np.zeros((GRAINS, 3))
    v[0, 0] = 500.0
    probe = Probe(make_scene(**FREE, numerics={"skin": 0.05}), sample_of(x, v))
    while overlaps(probe.x)[0, 1] <= 0:
        assert not probe.contacts()
        probe.advance(1)
    assert set(probe.contacts()) == {(0, 1)}
    assert probe.sim.search.count > 10


def state(probe):
    fields = ("x", "v", "w")
    return [probe._grains(name) for name in fields], probe.contacts()


def same_bits(first, second):
    assert all(np.array_equal(a, b) for a, b in zip(first[0], second[0], strict=True))
    assert set(first[1]) == set(second[1])
    for key, contact in first[1].items():
        assert all(np.array_equal(a, b) for a, b in zip(contact, second[1][key], strict=True)), key


def probe_of_gas(**numerics):
    return Probe(make_scene(**FREE, numerics=numerics), sample_of(*make_gas()))


@pytest.fixture(scope="module")
def usual():
    """State of the gas after 600 steps, and the number of searches that they took."""
    probe = probe_of_gas()
    probe.advance(600)
    state_before = state(probe)
    assert len(state_before[1]) > 1
    searches = probe.sim.search.count
    # the history survives a search
    probe.sim.search.update(probe.sim.step)
    same_bits(state_before, state(probe))
    return state_before, searches


@pytest.mark.parametrize("skin", [0.05, 0.3])
def test_other_searches_change_no_bit(skin, usual):
    """The skin decides when a search is made and which pairs are listed, never what happens."""
    probe = probe_of_gas(skin=skin)
    probe.advance(600)
    same_bits(usual[0], state(probe))
    assert probe.sim.search.count != usual[1]


PIECES = {"asked": [50] * 12, "cut": [1] * 100 + [7] * 50 + [150]}


@pytest.mark.parametrize("scene_kind", PIECES)
def test_pieces_and_searches_between_them_change_no_bit(scene_kind, usual):
    """`search` asks for one in the next step: wherever it falls, nothing else changes."""
    probe = probe_of_gas()
    for steps in PIECES[scene_kind]:
        probe.advance(steps)
        if scene_kind == "asked":
            probe.sim.search.ask()
    same_bits(usual[0], state(probe))


@pytest.mark.parametrize("skin", [1e-4, 2e-3])
def test_a_stretched_contact_survives_any_skin(skin):
    """Grains stay bonded down to an overlap of -0.137 nm: a search has to list that far, even
    where the skin (here 0.06 nm) is shorter."""
    x = np.zeros((12, 3))
    x[:, 1] = np.arange(12) * 10 * RADIUS
    x[1] = x[0] + [2 * RADIUS - 0.16627e-9, 0, 0]
    v = np.zeros((12, 3))
    v[0, 0], v[1, 0] = -0.069, 0.069  # pulled apart, not beyond pull-off: less than 0.11 m/s
    probe = Probe(make_scene(dt="0.02 ns", boundary=FAR, numerics={"skin": skin}), sample_of(x, v))
    while overlaps(probe.x)[0, 1] > -0.09e-9:
        probe.advance(1)
        assert probe.sim.step < 1000
    assert set(probe.contacts()) == {(0, 1)}
    probe.sim.search.update(probe.sim.step)
    assert set(probe.contacts()) == {(0, 1)}


def beyond(depth, least):
    """Keys (grain, -1 - wall) where depth (grains, walls) exceeds `least`."""
    return {(i, -1 - n) for i, n in zip(*np.nonzero(depth > least), strict=True)}


def test_wall_contacts_against_brute_force():
    """60 grains shaken in a box: every grain that overlaps a wall is in contact with it."""
    scene = make_scene(
        boundary=box(wall_speed=1.0, side_walls=1e-3),
        dt="0.1 ns",
        sample={"kind": "rbd", "grains": 60, "seed": 3},
    )
    sample = samples.make(scene)
    rng = np.random.default_rng(35)
    v = 2.0 * rng.normal(size=sample.positions.shape)
    probe = Probe(scene, sample_of(sample.positions, v))
    box_ = probe.sim.domain.box
    touched = 0
    for _ in range(40):
        probe.advance(50)
        walls = {key for key in probe.contacts() if key[1] < 0}
        plane = box_.offset + box_.speed * probe.sim.time
        overlap = RADIUS - (probe.x @ box_.normal.T - plane * 1e-6)
        assert beyond(overlap, 1e-17) <= walls
        # pull-off on a wall: at -0.8255 * 0.419 nm
        assert not walls & beyond(-overlap, 0.3459e-9)
        touched = max(touched, len(walls))
    assert touched > 5


def gas(threads):
    scene = make_scene(dt="0.1 ns", damping="viscoelastic", boundary=FAR, threads=threads)
    return Probe(scene, sample_of(*make_gas()))


def press_cake(threads):
    scene = make_scene(
        damping="viscoelastic",
        threads=threads,
        boundary=box(wall_speed=1.0, side_walls=1e-3),
        sample={"kind": "rbd", "grains": 420, "seed": 3},
    )
    return Probe(scene, samples.make(scene))


def numbers(probe):
    m = probe.sim.ledger.measure_energies()
    return np.concatenate([np.atleast_1d(m[name]).astype(float) for name in sorted(m)])


def test_threads_change_no_bit():
    """More threads than cores as well: the first worker goes on alone if the others do not come."""
    expected = {}
    for threads in (1, 2, 3):
        for make in (gas, press_cake):
            probe = make(threads)
            probe.advance(150)
            outcome = state(probe), numbers(probe)
            first = expected.setdefault(make, outcome)
            same_bits(first[0], outcome[0])
            assert np.array_equal(first[1], outcome[1])


def test_settings_of_taichi_in_the_shell_change_nothing(monkeypatch):
    seen = []
    monkeypatch.setattr(backend.ti, "init", lambda **options: seen.append(dict(os.environ)))
    monkeypatch.setattr(backend, "settings", SimpleNamespace)
    foreign = {compiler.variable("ARCH"): "vulkan", compiler.variable("DEBUG"): "1"}
    folder = compiler.variable(compiler.KERNEL_FOLDER)
    for name, value in foreign.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv(folder, "/here")
    backend.start_taichi(make_scene(**FREE), 1)
    assert not foreign.keys() & set(seen[0])
    assert seen[0][folder] == "/here" and foreign.items() <= os.environ.items()


SIDE = 16  # grains along an edge of a cube of them, a diameter of 2 apart


def cube():
    coordinates = np.arange(SIDE, dtype=float)
    grid = np.stack(np.meshgrid(coordinates, coordinates, coordinates, indexing="ij"), axis=-1)
    return 2.0 * np.random.default_rng(1).permutation(grid.reshape(-1, 3))


@pytest.mark.parametrize("workers", [2, 4, 8])
def test_workers_have_blocks_of_the_sample(workers):
    """Each has a box of the cube, so that no more than its faces are another's neighbours: of a
    cube of n^3 grains one, two and three planes of n^2 pairs part 2, 4 and 8 workers."""
    x = cube()
    order = grain_order(x, 4.0)
    assert np.array_equal(np.sort(order), np.arange(len(x)))
    owner = np.empty(len(x), int)
    owner[order] = np.arange(len(x)) * workers // len(x)
    at = {tuple(position): worker for position, worker in zip(x, owner, strict=True)}
    parted = sum(
        at[x, y, z] != at[beyond]
        for x, y, z in at
        for beyond in [(x + 2.0, y, z), (x, y + 2.0, z), (x, y, z + 2.0)]
        if beyond in at
    )  # fmt: skip
    assert parted == {2: 1, 4: 2, 8: 3}[workers] * SIDE**2


def test_grains_at_the_first_cut_stand_together():
    """Last in each part, so that those of a half are as many runs as it has parts."""
    x = cube()
    order = grain_order(x, 4.0)
    half = x[order[: len(x) // 2]]
    axis = int(np.argmin(np.ptp(half, axis=0)))
    at_cut = half[:, axis] == half[:, axis].max()
    if half[:, axis].min() > 0.0:  # the upper half
        at_cut = half[:, axis] == half[:, axis].min()
    runs = np.count_nonzero(np.diff(at_cut.astype(int)) == 1)
    assert at_cut.sum() == SIDE**2 and runs <= len(half) // PART
