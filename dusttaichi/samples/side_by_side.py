"""Samples side by side: several in one, each about its own origin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dusttaichi.samples.sample import Sample


def join_members(members: Sequence[Sample], radius: float) -> Sample:
    """Several samples of two bodies as the members of one simulation (grains.members).

    Their positions stay those about their own origins. info: members, grains of both bodies.

    Parameters
    ----------
    members
    radius
        Radius of the grains of a sample that states none [m].
    """
    unequal = any(sample.radii is not None or sample.materials is not None for sample in members)
    fields = ("positions", "velocities", "spins")
    joined = {n: np.concatenate([getattr(member, n) for member in members]) for n in fields}
    grains = join_grains(members, [radius if s.radii is None else s.radii for s in members])
    bodies = [[s.info["target_grains"], len(s) - s.info["target_grains"]] for s in members]
    info = {"members": bodies} | (dict(members[0].info) if len(members) == 1 else {})
    arrays: dict[str, Any] = joined | (grains if unequal else {})
    return Sample(**arrays, contacts=join_contacts(members), info=info)


def join_grains(samples: Sequence[Sample], radii: Sequence[Any]) -> dict[str, np.ndarray]:
    """Radii and materials of several samples; radii: of each, one number [m] or (N,)."""
    materials = [
        np.zeros(len(body), np.int32) if body.materials is None else body.materials
        for body in samples
    ]
    every = zip(radii, samples, strict=True)
    return {
        "radii": np.concatenate([np.broadcast_to(r, len(body)) for r, body in every]),
        "materials": np.concatenate(materials),
    }


def join_contacts(samples: Sequence[Sample]) -> dict[str, np.ndarray] | None:
    """Contacts of several samples, None without any; others follow from distances."""
    starts = np.cumsum([0, *(len(body) for body in samples)])
    stored_contacts = [
        (body.contacts, first)
        for body, first in zip(samples, starts[:-1], strict=True)
        if body.contacts
    ]
    if not stored_contacts:
        return None
    shapes = {
        name: values.shape[1:]
        for contacts, _ in stored_contacts
        for name, values in contacts.items()
    }
    joined = {}
    for name, shape in shapes.items():
        # history of an effect that only another body had is zero
        arrays = [
            contacts.get(name, np.zeros((len(contacts["i"]), *shape)))
            for contacts, _ in stored_contacts
        ]
        if name in ("i", "j"):
            arrays = [
                numbers + first for numbers, (_, first) in zip(arrays, stored_contacts, strict=True)
            ]
        joined[name] = np.concatenate(arrays)
    return joined
