"""Inventory of a built scene: parts of the model, fields, kernels, values of its preset.

And the forces of its contacts at the start, which `dust check --forces` prints.
"""

import numpy as np

from dusttaichi import samples, units
from dusttaichi.compute.memory import capacity_for
from dusttaichi.grains.build import build
from dusttaichi.grains.wall_geometry import list_present, name_walls
from dusttaichi.physics.contact.effect_registry import EFFECTS, law_name
from dusttaichi.physics.geometry import AXES, WALLS
from dusttaichi.scene import quantities


def tables(engine):
    """All fields of a GrainEngine by name: state, scratch of the search, sums of measurements."""
    return {**engine.fields, **engine.scratch, **engine.kernel_sums.tables}


def compiled_rows(scene, engine):
    """Rows (what, value): effects, boundary, measurements, kernels, state."""
    layout = engine.layout
    named = {effect: law_name(scene.interaction, effect) for effect in EFFECTS}
    on = [f"{effect} ({name})" for effect, name in named.items() if name is not None]
    on += list(scene.interaction.effects)
    off = [effect for effect, name in named.items() if name is None]
    walls, faces = "none", "none"
    box, cell = engine.domain.box, engine.domain.cell
    if box is not None:
        named = zip(name_walls(engine.domain), list_present(engine.domain), strict=True)
        walls = ", ".join(name for name, is_present in named if is_present)
    if cell is not None:
        faces = "across " + ", ".join(AXES[n] for n in cell.axes)
    sphere = "none"
    if engine.sphere is not None:
        sphere = "moves by forces" if engine.sphere.speed is None else "driven"
    pushes = [
        name
        for name, has_push in (("force", layout.forced), ("carried grains", layout.carried))
        if has_push
    ]
    polydisperse = "their own radius and material" if layout.polydisperse else "equal"
    return [
        ("forces", ", ".join(on)),
        ("left out", ", ".join(off) or "nothing"),
        ("grains", polydisperse),
        ("walls", walls),
        ("periodic faces", faces),
        ("pushes", ", ".join(pushes) or "none"),
        ("rigid sphere", sphere),
        ("forces from outside", _name_forces(layout)),
        ("summed in every step", ", ".join(_list_sums(engine))),
        ("written", ", ".join(_list_outputs(scene))),
        ("contacts an iteration (lanes)", f"{layout.width}"),
        ("history of a contact", f"{layout.state_rows} numbers: {_history(layout)}"),
        ("kernels", ", ".join(vars(engine.kernels))),
        (
            "backend, precision, threads",
            f"{scene.numerics.backend}, {scene.numerics.precision}, {engine.stepper.threads}",
        ),
    ]


def _name_forces(layout):
    """Names of the laws of the forces from outside."""
    names = [getattr(law, "__name__", type(law).__name__) for law in layout.forces.laws]
    return ", ".join(name.rpartition(".")[2] for name in names) or "none"


def _list_sums(engine):
    out = [f"losses ({', '.join(engine.layout.channels)})"]
    out += ["forces on the walls"] if engine.domain.box is not None else []
    out += ["force and torque on the sphere"] if engine.sphere is not None else []
    out += ["work of the faces"] if engine.domain.cell is not None else []
    return out + (["virial stress"] if engine.layout.stress else [])


def _list_outputs(scene):
    plans = scene.stage_plans
    requested = {
        "time series": any(plan.series is not None for plan in plans),
        "profiles": any(plan.profiles is not None for plan in plans),
        "snapshots": any(plan.snapshots is not None for plan in plans),
    }
    out = [name for name, is_requested in requested.items() if is_requested]
    out += [] if requested["snapshots"] else ["first and last snapshot"]
    return out + (["contacts of snapshots"] if scene.output.contacts else [])


def _history(layout):
    return ", ".join(f"{name} {width}" for name, (_, width) in layout.rows.items())


def field_rows(engine):
    """Rows (name, what it takes) of the fields from the largest on, those under 1 % in one.

    Bytes are counted for the capacity in grains (compute.memory.capacity_for).
    """
    room = capacity_for(engine.size)
    sizes = {name: field.nbytes for name, field in tables(engine).items()}
    total_size = sum(sizes.values())
    rows, small = [], []
    for name, size in sorted(sizes.items(), key=lambda item: -item[1]):
        if size < 0.01 * total_size:
            small.append(name)
            continue
        shape = " x ".join(str(n) for n in tables(engine)[name].field.shape)
        rows.append((name, f"{_amount(size)}, {size / room:.0f} bytes a grain ({shape})"))
    if small:
        rows.append(
            (
                f"{len(small)} more",
                f"{_amount(sum(sizes[n] for n in small))}: {', '.join(sorted(small))}",
            )
        )
    size_per_grain = f"{total_size / room:.0f} bytes a grain, capacity {room:,}"
    return [*rows, ("all", f"{_amount(total_size)}, {size_per_grain}")]


def _amount(size):
    return f"{size / 2**20:.3g} MiB" if size >= 2**20 else f"{size / 2**10:.3g} KiB"


def preset_rows(scene):
    """Rows of the keys that numerics.accuracy sets, and those that the scene sets itself."""
    numerics = scene.numerics
    rows = [("accuracy", f"{numerics.accuracy}; it sets")]
    for key, value in numerics.preset.items():
        current = getattr(numerics, key)
        text = f"{value}" if current == value else f"{current}, given (the preset has {value})"
        if key == "step_fraction" and numerics.time_step != "auto":
            text = f"{value}, not used: time_step is given"
        rows.append((f"  {key}", text))
    keys_beside = [
        key for key in type(numerics).fields_in_order() if key not in {*numerics.preset, "accuracy"}
    ]
    rows.append(
        ("not set by it", ", ".join(f"{key} {_value(numerics, key)}" for key in keys_beside))
    )
    return rows


def _value(numerics, key):
    value = getattr(numerics, key)
    return f"{value * 1e9:.4g} ns" if key == "time_step" and value != "auto" else f"{value}"


# -- forces at the start --------------------------------------------------------------------------


def forces(scene):
    """Sections (title, rows) of the initial configuration of a scene.

    The scene is built; no step is computed.
    """
    engine = build(scene, samples.make(scene))
    energies, (force, _) = engine.ledger.measure_energies(), engine.stepper.evaluate()
    rows = [*_contact_rows(engine, energies), *_grain_rows(force)]
    if engine.domain.box is not None:
        rows += _wall_rows(engine)
    if engine.sphere is not None:
        rows.append(("force on the sphere", _vector(energies["sphere_load"][0])))
    return [("Forces of the contacts at the start", [*rows, *_energy_rows(engine, energies)])]


def _contact_rows(engine, energies):
    rows = [("contacts between grains", f"{energies['contacts']:,}")]
    if engine.domain.box is not None:
        rows.append(("contacts with walls", f"{energies['wall_contacts']:,}"))
    if engine.sphere is not None:
        rows.append(("contacts with the sphere", f"{energies['sphere_contacts']:,}"))
    return [*rows, ("coordination number", f"{2.0 * energies['contacts'] / engine.size:.4g}")]


def _grain_rows(force):
    """force [nN] on every grain, (N, 3)."""
    size = np.linalg.norm(force, axis=1)
    most_loaded = int(size.argmax())
    return [
        ("largest force on a grain", f"{_force(size[most_loaded])}, grain {most_loaded}"),
        ("mean force on a grain", _force(size.mean())),
    ]


def _wall_rows(engine):
    """The force of the grains on each wall, and on all of them together."""
    loads, box = engine.kernel_sums.read_loads(), engine.domain.box
    on_walls, rows = -loads.wall_force(), []
    for n in np.flatnonzero(box.present):
        along = float(on_walls[n] @ box.normal[n])
        text = "none" if along == 0.0 else f"{_force(abs(along))}, {_sense(along)}"
        rows.append((f"normal force on the wall {WALLS[n]}", text))
    total = on_walls.sum(axis=0)
    if engine.domain.surfaces is not None:
        on_surfaces = -engine.kernel_sums.surface_loads()
        total = total + on_surfaces[:, :3].sum(axis=0)
        for name, pressing in zip(engine.domain.surfaces.names, on_surfaces[:, 3], strict=True):
            text = "none" if pressing == 0.0 else f"{_force(abs(pressing))}, {_sense(pressing)}"
            rows.append((f"normal force on the {name}, all of it", text))
    return [*rows, ("total force on the walls", _vector(total))]


def _sense(along):
    """Sense, in words, of a force on a wall along its normal, which points to the grains."""
    return "pulled inwards" if along > 0.0 else "pushed outwards"


def _energy_rows(engine, energies):
    """Potential energy by effect, of all kinds of contact together."""
    names = engine.layout.model.potentials
    stored = energies["potential"] + energies["potential_wall"] + energies["potential_sphere"]
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
