"""Pushed grains of a scene, and the changes by pushes before the first step."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.contact.constants import pair_constants
from dusttaichi.physics.geometry import WALLS, rigid_rotation
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample
from dusttaichi.scene.fields import AnyScene
from dusttaichi.scene.push import Push


def apply_pushes(scene: AnyScene, sample: Sample) -> Sample:
    """Apply the displacements and velocities of the pushes of a scene to a sample.

    info["push"] has for every push its `kind`, the numbers of its `grains`, its `face`, and the
    `size` of a displacement [m]. Contacts are found afterwards: displacements strain them along the
    normal only. A sample with info["push"] is returned unchanged.

    Parameters
    ----------
    scene : Scene
    sample

    Raises
    ------
    DustError
        A grain does not exist, or is both carried and pushed.
    """
    if not scene.push or "push" in sample.info:
        return sample
    x, v, w = sample.positions.copy(), sample.velocities.copy(), sample.spins.copy()
    delta0 = pair_constants(scene.material, scene.interaction).delta0
    groups = [
        find_pushed_grains(f"push[{n}]", push, sample.positions, scene.material.radius)
        for n, push in enumerate(scene.push)
    ]
    _check_carried(scene.push, groups)
    masses = Materials(scene).masses(sample)
    for push, group in zip(scene.push, groups, strict=True):
        if push.displacement is not None:
            x[group] += push.displacement
        elif push.displacement_delta0 is not None:
            x[group] += delta0 * np.array(push.displacement_delta0)
        elif push.velocity is not None:
            v[group] += push.velocity
        elif push.spin is not None:
            v[group] += rigid_rotation(push.spin, x[group], masses[group, None])
            w[group] += push.spin
        elif push.speed is not None:
            v[group], w[group] = push.speed, 0.0
    pairs = zip(scene.push, groups, strict=True)
    info = sample.info | {"push": [_describe_push(push, group, delta0) for push, group in pairs]}
    return replace(sample, positions=x, velocities=v, spins=w, info=info)


def find_pushed_grains(origin: str, push: Push, positions: np.ndarray, radius: float) -> np.ndarray:
    """Find the numbers of the grains of a push, sorted.

    Parameters
    ----------
    origin
        Path of the push in the YAML.
    push : Push
    positions
        [m], (N, 3).
    radius
        Radius of the grains [m].

    Returns
    -------
    array
        (n,) of int.

    Raises
    ------
    DustError
        A grain does not exist.
    """
    if push.face is not None:
        face = WALLS.index(push.face)
        sign = -1.0 if face % 2 else 1.0
        behind = sign * positions[:, face // 2]
        depth = radius if push.depth is None else push.depth
        # a layer of a lattice is level to rounding only
        return np.flatnonzero(behind <= behind.min() + depth + 1e-9 * radius)
    if push.grains == "all":
        return np.arange(len(positions))
    group: NDArray[np.int64] = np.unique(np.array(push.grains, np.int64))
    if group[-1] >= len(positions):
        raise DustError(
            f"{origin}.grains: there is no grain {group[-1]}; allowed: 0 to {len(positions) - 1}"
        )
    return group


def _check_carried(pushes: Any, groups: Any) -> None:
    for n, (push, group) in enumerate(zip(pushes, groups, strict=True)):
        for m, (other_push, other_group) in enumerate(zip(pushes, groups, strict=True)):
            if m == n or push.speed is None or other_push.kind.startswith("displacement"):
                continue
            both = np.intersect1d(group, other_group)
            if len(both):
                raise DustError(
                    f"push[{n}].speed: grain {both[0]} is carried, and also pushed by push[{m}]; "
                    "use one of them for each grain"
                )


def _describe_push(push: Push, group: np.ndarray, delta0: float) -> dict[str, Any]:
    description = {"kind": push.kind, "grains": group.tolist()}
    if push.face is not None:
        description["face"] = push.face
    if push.displacement is not None:
        description["size"] = float(np.linalg.norm(push.displacement))
    if push.displacement_delta0 is not None:
        description["size"] = float(delta0 * np.linalg.norm(push.displacement_delta0))
    return description
