"""Samples for the map that no scene has: perturbed, compressed, pulled, and others."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi import samples
from dusttaichi.grains.build import build
from dusttaichi.grains.grain_scene import GrainsScene
from dusttaichi.physics.contact.constants import mixed_constants, pair_constants
from dusttaichi.physics.encounter import breaking_speed
from dusttaichi.physics.stability import close_packed
from dusttaichi.samples import Sample
from dusttaichi.scene import Scene
from dusttaichi.studies.extremes_cells import BASE

# compression of a compacted cake
COMPRESSED = BASE | {
    "interaction": BASE["interaction"] | {"damping": "viscoelastic"},
    "sample": {"kind": "rbd", "grains": 300},
    "boundary": {"kind": "box", "wall_speed": "2 m/s"},
}
COMPRESSED_TO = 0.4  # filling factor
SETTLE = 20_000  # steps without walls, about 6 us, until vibrations and creep have ended


def make(scene: GrainsScene, spec: dict[str, Any]) -> Sample:
    """The Sample of a `spec`, in the material of the scene.

    spec: `kind`, its own numbers, and `speed` [m/s], `spin` [rad/s]: standard deviations of random
    velocities and spins of every grain.
    """
    spec = dict(spec)
    speed, spin = spec.pop("speed", 0.0), spec.pop("spin", 0.0)
    sample = KINDS[spec.pop("kind")](scene, **spec)
    rng = np.random.default_rng(3)
    sample.velocities[:] += speed * rng.normal(size=sample.velocities.shape)
    sample.spins[:] += spin * rng.normal(size=sample.spins.shape)
    radius = scene.material.radius
    sizes = (radius, 2.0 * radius) if sample.radii is None else (sample.radii, None)
    sample.info.update(samples.describe(sample, *sizes))
    return sample


def place_grains(
    scene: GrainsScene,
    positions: ArrayLike,
    velocities: ArrayLike = ((0, 0, 0),),
    spins: ArrayLike = ((0, 0, 0),),
) -> Sample:
    """Grains at positions [radii] with velocities [m/s] and spins [rad/s]."""
    x = np.array(positions, float) * scene.material.radius
    v, w = (np.array(values, float) + np.zeros_like(x) for values in (velocities, spins))
    return Sample(x, v, w)


def make_cluster(scene: GrainsScene, grains: int) -> Sample:
    """Close-packed grains at rest."""
    contact = pair_constants(scene.material, scene.interaction)
    return Sample.at_rest(close_packed(grains) * (2.0 * contact.r - contact.delta0))


def make_collision(scene: GrainsScene, sticking: float) -> Sample:
    """Two grains just before contact, at `sticking` times their sticking speed, off-centre."""
    c = pair_constants(scene.material, scene.interaction)
    v = sticking * breaking_speed(c)
    y = 2.0 * c.r * 0.3
    x = np.sqrt((2.0 * c.r + c.delta0) ** 2 - y**2)
    half = np.array([0.5 * v, 0.0, 0.0])
    return Sample(
        np.array([[0.0, 0.0, 0.0], [x, y, 0.0]]), np.array([half, -half]), np.zeros((2, 3))
    )


@cache
def _compress() -> tuple[NDArray[np.float64], dict[str, NDArray[Any]]]:
    """Positions and contacts of a cake after compression in a box and relaxation without it."""
    scene = Scene.from_dict(COMPRESSED)
    sim = build(scene, samples.make(scene))
    while sim.bodies.volume / np.prod(sim.environment.lengths()) < COMPRESSED_TO:
        sim.advance(200)
    sim = build(scene.with_value("boundary", {"kind": "open"}), _read_at_rest(sim))
    sim.advance(SETTLE)
    settled = _read_at_rest(sim)
    return settled.positions, settled.contacts or {}


def _read_at_rest(sim: Any) -> Sample:
    """Sample from a simulation: positions and strained contacts, at rest."""
    state = sim.contacts.measure_pairs()
    contacts = {name: state[name] for name in ("pointer_i", "pointer_j", "twist")}
    contacts |= {"i": state["grain_i"], "j": state["grain_j"]}
    contacts["approach"] = np.zeros(len(state["twist"]))
    x = sim.motion.measure()[0] * sim.units("m")
    return Sample(x, np.zeros_like(x), np.zeros_like(x), contacts)


def compress_cake(scene: GrainsScene) -> Sample:
    """A cake of silicate after compression, with its strained contacts."""
    x, contacts = _compress()
    return Sample(x.copy(), np.zeros_like(x), np.zeros_like(x), contacts)


def pull_chain(scene: GrainsScene, grains: int) -> Sample:
    """A chain with all contacts just before pull-off."""
    c = pair_constants(scene.material, scene.interaction)
    x = np.zeros((grains, 3))
    x[:, 0] = (2.0 * c.r + c.delta_c * (1.0 - 1e-9)) * np.arange(grains)
    i = np.arange(grains - 1)
    along = np.tile([1.0, 0.0, 0.0], (grains - 1, 1))
    contacts = {"i": i, "j": i + 1, "pointer_i": along, "pointer_j": -along}
    contacts |= {name: np.zeros(grains - 1) for name in ("twist", "approach")}
    return Sample(x, np.zeros_like(x), np.zeros_like(x), contacts)


def scatter_gas(scene: GrainsScene, grains: int, filling_factor: float) -> Sample:
    """Random grains without contacts in a periodic cube of a filling factor."""
    r = scene.material.radius
    edge = (grains * 4.0 / 3.0 * np.pi * r**3 / filling_factor) ** (1.0 / 3.0)
    rng, x = np.random.default_rng(7), list[NDArray[np.float64]]()
    while len(x) < grains:
        position = edge * rng.random(3)
        apart = np.array(x).reshape(-1, 3) - position
        apart -= edge * np.round(apart / edge)
        if np.min(np.linalg.norm(apart, axis=1), initial=np.inf) > 2.02 * r:
            x.append(position)
    sample = Sample.at_rest(np.array(x))
    sample.info["period"] = [edge] * 3
    return sample


def make_of_scene(scene: GrainsScene, block: dict[str, Any]) -> Sample:
    """A sample of a kind that scenes have, at rest."""
    sample = samples.make(scene.with_value("sample", block))
    return Sample.at_rest(sample.positions, sample.info)


def surround_grain(
    scene: GrainsScene, ratio: float, around: int = 1, speed_in: float = 0.0
) -> Sample:
    """A grain of `ratio` times the radius with `around` small ones.

    They are in equilibrium contact, or at a small distance with speed_in [m/s] towards it.
    """
    small = scene.material.radius
    c = mixed_constants(scene.material, small, scene.material, ratio * small, scene.interaction)
    directions = _spread_directions(around)
    gap = c.delta0 if speed_in else -c.delta0
    x = np.concatenate([np.zeros((1, 3)), ((1.0 + ratio) * small + gap) * directions])
    v = np.concatenate([np.zeros((1, 3)), -speed_in * directions])
    radii = np.r_[ratio * small, np.full(around, small)]
    return Sample(x, v, np.zeros_like(x), radii=radii)


def _spread_directions(n: int) -> NDArray[np.float64]:
    """n directions uniformly over the sphere (Fibonacci), (n, 3)."""
    k = np.arange(n) + 0.5
    z, angle = 1.0 - 2.0 * k / n, np.pi * (1.0 + 5.0**0.5) * k
    return np.column_stack(
        [np.sqrt(1.0 - z**2) * np.cos(angle), np.sqrt(1.0 - z**2) * np.sin(angle), z]
    )


KINDS: dict[str, Callable[..., Sample]] = {
    "given": place_grains,
    "cluster": make_cluster,
    "meeting": make_collision,
    "compacted": compress_cake,
    "pulled": pull_chain,
    "gas": scatter_gas,
    "of scene": make_of_scene,
    "polydisperse": surround_grain,
}
