"""Forces of the contacts of a scene as it starts, in numbers: what `dust check --forces` prints."""

import numpy as np

from dusttaichi import samples, units
from dusttaichi.grains.build import build
from dusttaichi.names import WALLS
from dusttaichi.scene import quantities


def forces(scene):
    """Sections (title, rows of (what, value)) of the configuration that a scene starts from: its
    sample is made and built, no step is made."""
    sim = build(scene, samples.make(scene))
    now, (force, _) = sim.measure(), sim.forces()
    rows = [*_contact_rows(sim, now), *_grain_rows(force)]
    if sim.box is not None:
        rows += _wall_rows(sim)
    if sim.sphere is not None:
        rows.append(("force on the sphere", _vector(now["sphere_load"][0])))
    return [("Forces of the contacts at the start", [*rows, *_energy_rows(sim, now)])]


def _contact_rows(sim, now):
    rows = [("contacts between grains", f"{now['contacts']:,}")]
    if sim.box is not None:
        rows.append(("contacts with walls", f"{now['wall_contacts']:,}"))
    if sim.sphere is not None:
        rows.append(("contacts with the sphere", f"{now['sphere_contacts']:,}"))
    return [*rows, ("coordination number", f"{2.0 * now['contacts'] / sim.grains:.4g}")]


def _grain_rows(force):
    """force [nN] on every grain, (N, 3)."""
    size = np.linalg.norm(force, axis=1)
    most = int(size.argmax())
    return [
        ("largest force on a grain", f"{_force(size[most])}, grain {most}"),
        ("mean force on a grain", _force(size.mean())),
    ]


def _wall_rows(sim):
    """The force of the grains on each wall, and on all of them together."""
    on_walls, rows = -sim.wall_forces(), []
    for n in np.flatnonzero(sim.box.present):
        along = float(on_walls[n] @ sim.box.normal[n])
        text = "none" if along == 0.0 else f"{_force(abs(along))}, {_sense(along)}"
        rows.append((f"normal force on the wall {WALLS[n]}", text))
    return [*rows, ("total force on the walls", _vector(on_walls.sum(axis=0)))]


def _sense(along):
    """In words, of a force on a wall along the normal of the wall, which points to the grains."""
    return "pulled inwards" if along > 0.0 else "pushed outwards"


def _energy_rows(sim, now):
    """Potential energy by effect, of all kinds of contact together."""
    names = sim.layout.model.potentials
    stored = now["potential"] + now["potential_wall"] + now["potential_sphere"]
    rows = [
        (f"potential energy, {name}", _energy(u)) for name, u in zip(names, stored, strict=True)
    ]
    return [*rows, ("potential energy, all effects", _energy(stored.sum()))]


def _force(value):
    return quantities.format(float(value) * units.FORCE, "force", digits=4)


def _energy(value):
    return quantities.format(float(value) * units.ENERGY, "energy", digits=4)


def _vector(force):
    return "(" + ", ".join(_force(component) for component in force) + ")"
