"""Searches of both methods against brute force: the pairs within reach, all of them and no other.

One list of cases: open, periodic, sheared and mirrored space, equal and unequal particles.
"""

from itertools import product

import numpy as np
import pytest
from continuum import dust
from scenes import FAR, RADIUS, make_scene, polydisperse, sample_of, two_materials

from dusttaichi.compute.backend import Loops
from dusttaichi.continuum.dust_build import build as build_dust
from dusttaichi.errors import GuardStop
from dusttaichi.grains.build import build as build_grains
from dusttaichi.grains.kernels.store import PAIRS
from dusttaichi.particles.cells import lay_grid

LAUNCHES = Loops(1, 1, "launches")

# -- grains ----------------------------------------------------------------------------------------


def gas(unequal=False, **boundary):
    """(scene, sample) of 300 grains at random places on a loose lattice, in motion."""
    rng = np.random.default_rng(4)
    sites = np.stack(np.meshgrid(*[np.arange(7)] * 3, indexing="ij"), -1).reshape(-1, 3)[:300]
    x = sites * 2.2 * RADIUS + rng.uniform(-0.05, 0.05, (300, 3)) * RADIUS
    v = rng.normal(size=x.shape)
    radii = RADIUS * rng.uniform(0.8, 1.04, 300)
    make = two_materials if unequal else make_scene  # structures that other tests have
    scene = make(boundary=boundary or FAR, damping="viscoelastic", numerics={"skin": 0.3})
    return scene, polydisperse(x, radii, v=v) if unequal else sample_of(x, v)


def cell(**options):
    return {"kind": "periodic", "size": [f"{7 * 2.2 * RADIUS} m"] * 3} | options


def listed_grains(sim):
    """Pairs that a search has listed, in their order."""
    count = int(sim.fields["counts"].to_numpy()[PAIRS])
    return [sim.fields[name].to_numpy().ravel()[:count] for name in ("pair_i", "pair_j")]


def near_grains(sim):
    """Pairs within reach of each other, by brute force, in the order of their numbers."""
    x = sim.grain_state.of_grains("x")
    edges, tilt = np.zeros(3), 0.0
    if sim.domain.cell is not None:
        edges, tilt = sim.domain.cell.edges(sim.time), sim.domain.cell.offset(sim.time)
    apart = np.full((len(x), len(x)), np.inf)
    for turns in product(*[(-1, 0, 1) if edge > 0.0 else (0,) for edge in edges]):
        image = np.array(turns) * edges + [turns[2] * tilt, 0.0, 0.0]
        apart = np.minimum(apart, np.linalg.norm(x[:, None] - x - image, axis=2))
    reach = 2.0 * sim.bodies.radius
    if sim.bodies.properties is not None:
        radius = sim.grain_state.of_grains("radius")
        reach = radius[:, None] + radius
    return np.nonzero(np.triu(apart < reach + sim.numbers.pair.far + sim.search.skin, 1))


@pytest.mark.parametrize(
    "unequal, boundary",
    [
        (False, {}),
        (True, {}),
        (False, cell()),
        pytest.param(False, cell(shear_rate="2e6 s^-1"), marks=pytest.mark.long),
        (True, cell(shear_rate="2e6 s^-1")),
    ],
    ids=["open", "unequal", "periodic", "sheared", "unequal, sheared"],
)
def test_pairs_of_grains(unequal, boundary):
    sim = build_grains(*gas(unequal, **boundary))
    for steps in (0, 300, 900):
        sim.advance(steps)
        sim.search.update(sim.step)
        pairs, expected = listed_grains(sim), near_grains(sim)
        assert len(expected[0]) > 50
        for ours, theirs in zip(pairs, expected, strict=True):
            np.testing.assert_array_equal(ours, theirs)


# -- continuum -------------------------------------------------------------------------------------


def in_the_open(count, _speed):
    return dust.scene(), dust.particles(*dust.rows(9, count))


def images(engine, x):
    """Places of all images within reach of the space of the originals, by brute force."""
    search, out = engine.search, []
    for signs, shifts in search.images():
        image, near = x * signs + shifts, np.ones(len(x), bool)
        for axis, low, high in search.surfaces.edges:
            near &= (image[:, axis] > low - search.reach) & (image[:, axis] < high + search.reach)
        for axis, side, plane in search.surfaces.mirrors:
            near &= (image[:, axis] - plane) * (1.0 if side else -1.0) < search.reach
        out.append(image[near])
    return np.concatenate(out or [x[:0]])


def lists(engine):
    """All that a search leaves: particles in order, their lists, images and surfaces."""
    n, state = engine.size, engine.dust_state
    arrays = {name: state.of_particles(name) for name in state.names}
    blocks = -(-n // engine.layout.lanes)
    for name, end, columns in (
        ("first", blocks, ["entry"]),
        ("touch_first", n, ["touch_row"]),
        ("ghost_first", n, ["ghost_sign", "ghost_shift"]),
    ):
        if name in engine.scratch:
            arrays[name] = engine.scratch[name].copy_rows(0, end + 1)
            for column in columns:
                arrays[column] = engine.scratch[column].copy_rows(0, arrays[name][end])
    return arrays


def check_lists(engine):
    """Lists against brute force; returns them."""
    n, lanes, arrays = engine.size, engine.layout.lanes, lists(engine)
    x, ghosts = engine.dust_state.of_particles("x"), arrays.get("ghost_first", [0])[-1]
    seen = engine.fields["x"].copy_rows(0, n + ghosts)
    expected = images(engine, x)
    assert np.array_equal(seen[:n], x) and len(expected) == ghosts
    if ghosts:
        # rounding of places of a millimetre: 1e-19 m
        far = np.linalg.norm(seen[n:, None] - expected, axis=2)
        assert far.min(axis=0).max() < 1e-18 and far.min(axis=1).max() < 1e-18
    apart = np.linalg.norm(x[:, None] - seen, axis=2) < engine.search.reach
    for block, (begin, end) in enumerate(zip(arrays["first"], arrays["first"][1:], strict=False)):
        near = apart[lanes * block : lanes * (block + 1)].any(axis=0)
        entries = arrays["entry"][begin:end]
        assert np.array_equal(np.sort(entries), np.flatnonzero(near))
    assert len(arrays["entry"]) > 10 * n / lanes
    return arrays


@pytest.mark.parametrize(
    "make, loops",
    [
        pytest.param(in_the_open, None, id="in_the_open-workers"),
        pytest.param(dust.press_column, None, id="pressed-workers"),
        pytest.param(dust.mirror_column, None, id="mirrored-workers"),
        pytest.param(in_the_open, LAUNCHES, id="in_the_open-launches", marks=pytest.mark.long),
        pytest.param(dust.press_column, LAUNCHES, id="pressed-launches", marks=pytest.mark.long),
        pytest.param(dust.mirror_column, LAUNCHES, id="mirrored-launches", marks=pytest.mark.long),
    ],
)
def test_neighbours_of_dust(make, loops, launches):
    """By a search, and the very same lists again from a checkpoint."""
    engine = build_dust(*make(8, 1.0), loops=loops)
    dust.stir_particles(engine)
    state = engine.dust_state
    arrays_before = {name: state.of_particles(name) for name in state.names}
    engine.search.update()
    arrays = check_lists(engine)
    assert np.array_equal(np.sort(arrays["number"]), np.arange(engine.size))
    for name in state.names:  # all variables of a particle stay together
        ours = arrays_before[name][np.argsort(arrays_before["number"])][arrays["number"]]
        assert np.array_equal(arrays[name], ours) or name in ("x", "x_search"), name
    if engine.layout.rigid:
        assert len(arrays["touch_row"]) > 6
    state["x"] = state.of_particles("x") + 0.01 * dust.SPACING
    moved = state.of_particles("x")
    engine.search.again()
    assert np.array_equal(state.of_particles("x"), moved)
    second_arrays = lists(engine)
    for name in arrays.keys() - {"x"}:
        assert np.array_equal(second_arrays[name], arrays[name]), name


def test_what_is_wrong_with_dust_is_said():
    """Particles that are nowhere, and more neighbours than the capacity."""
    engine = build_dust(*dust.press_column(300, 1.0))
    x = engine.dust_state.of_particles("x")
    engine.dust_state["x"] = 1e-3 * x
    with pytest.raises(GuardStop, match="have come together without limit"):
        engine.search.update()
    x[[3, 5]] = np.nan
    engine.dust_state["x"] = x
    with pytest.raises(GuardStop, match="2 particles have a position that is not a number"):
        engine.search.update()


# -- cells -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("edges", [(0.0, 0.0), (0.0, 5.0), (7.0, 5.0)])
def test_a_grid_covers_its_extent(edges):
    """No cell is narrower than asked, and there are no more than allowed, however far it is.

    Along axes that do not repeat there is an empty cell more on each side.
    """
    for extent in (edges, (3.2, 5.0), (1e9, 1e-3)):
        extent = [edge or a for edge, a in zip(edges, extent, strict=True)]
        numbers = lay_grid((0.0, 0.0), extent, (0.7, 0.7), 40, edges=edges, growth=1.1)
        width, cells = 1.0 / np.array(numbers[2:4]), np.array(numbers[4:6])
        assert np.prod(cells) == numbers[-1] <= 40 and width.min() >= 0.7 * (1.0 - 1e-12)
        covered = (cells - 2 * (np.array(edges) == 0.0)) * width
        assert (covered >= np.array(extent) * (1.0 - 1e-12)).all()
        for edge, along in zip(edges, covered, strict=True):
            assert edge == 0.0 or along == pytest.approx(edge, rel=1e-12)
