"""Output of `dust check` for grains: sample, contacts, step, memory; what is compiled in."""

import numpy as np

from dusttaichi import samples
from dusttaichi.compute.memory import TYPES, capacity_for
from dusttaichi.domain.walls import wall_strengths
from dusttaichi.grains import contact_network
from dusttaichi.grains.advice import advice
from dusttaichi.grains.build import build, prepare
from dusttaichi.grains.impacts import softened_remarks, softened_rows
from dusttaichi.grains.inventory import compiled_rows, field_rows, preset_rows
from dusttaichi.grains.kernels.declare import declare
from dusttaichi.grains.time_step import short_loads
from dusttaichi.method import Preview
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import chosen_model
from dusttaichi.physics.geometry import AXES
from dusttaichi.samples.sample import LARGEST_ERROR
from dusttaichi.scene import quantities
from dusttaichi.scene.dimensions import DIMENSIONS
from dusttaichi.scene.forces import find_law, list_forces
from dusttaichi.scene.material import DEFAULT


def preview(scene):
    """The Preview of a scene (dusttaichi.method): its sample is made, nothing is compiled."""
    sample = samples.make(scene)
    preparation = prepare(scene, sample)
    scene, step, domain = preparation.scene, preparation.step, preparation.domain
    domain.driven(scene.stage_plans[0].drive, 0).check_start()
    sections = [("Sample", _sample(scene, preparation)), *_contacts(preparation.contact_table)]
    if preparation.sphere is not None:
        sections.append(("Sphere", _sphere(preparation.sphere, preparation.properties.radius)))
        contact = _contact(preparation.contact_table.farthest_sphere, scene)
        sections.append(("Contact of a grain and the sphere", contact))
    sections += _forces(scene)
    if scene.softened:
        remarks = [("remark", text) for text in softened_remarks(scene, step.impact)]
        sections.append(("Softened contacts", [*softened_rows(scene), *remarks]))
    sections.append(("Time step", _step(step)))
    if texts := short_loads(scene, step.dt):
        sections.append(("Controlled loads", [("remark", text) for text in texts]))
    if texts := advice(scene, sample, step.impact):
        sections.append(("Defaults to change", [tuple(text.split(": ", 1)) for text in texts]))
    sections.append(("Memory", [("state", _state_memory(preparation))]))
    return Preview(sections, len(sample), step.dt, domain.plan_stages(scene))


def _contacts(table):
    """Sections of the contacts of two grains, and of a grain with a wall.

    Where grains differ, of every two materials that they have, at their median radii; each with a
    wall.
    """
    if table.properties is None:
        pairs = {"two grains": table.farthest_pair}
        walls = {"a grain and a wall": table.farthest_wall}
    else:
        pairs, walls = _median_contacts(table)
    scene = table.scene
    rows = {f"Contact of {name}": _contact(c, scene) for name, c in pairs.items()}
    if scene.has_walls:
        at_sides = _side_walls(scene.boundary)
        rows |= {f"Contact of {name}": _contact(c, scene) + at_sides for name, c in walls.items()}
    return list(rows.items())


def _side_walls(boundary):
    """Row of the factor at the side walls, which may hold grains far less than top and bottom."""
    factors = [factor for factor in (wall_strengths(boundary) or ())[:4] if factor is not None]
    if not factors or factors[0] == 1.0:
        return []
    text = f"times {factors[0]:g} (boundary.side_walls)"
    return [("rolling, sliding, twisting at side walls", text)]


def _median_contacts(table):
    """(name -> ContactConstants of every two materials, and of each and a wall)."""
    names, properties = [DEFAULT, *table.scene.materials], table.properties
    grains = []
    for number in np.unique(properties.material).tolist():
        radii = properties.radius[properties.material == number]
        grains.append((number, float(np.median(radii))))

    def name_of(grain):
        number, radius = grain
        return f"{names[number]} ({quantities.format(radius, 'length', digits=3)})"

    pairs = {
        f"two grains, {name_of(a)} and {name_of(b)}": table.pair(a, b)
        for k, a in enumerate(grains)
        for b in grains[k:]
    }
    return pairs, {f"a grain, {name_of(a)}, and a wall": table.wall(a) for a in grains}


def internals(scene):
    """More sections, of the scene built: what is compiled in, fields, contacts at the start."""
    engine = build(scene, samples.make(scene))
    stability = contact_network.tabulate_stability(
        engine.contacts, engine.contact_table, engine.motion
    )
    return [
        ("Contacts at the start", stability),
        ("Accuracy", preset_rows(scene)),
        ("Compiled in", compiled_rows(scene, engine)),
        ("Fields", field_rows(engine)),
    ]


def _sphere(placed, radii):
    """Rows of a RigidSphere at the start; radii [m]: of the grains."""
    quantity, radius, mass = quantities.format, placed.radius, placed.mass
    centre = ", ".join(quantity(a, "length", digits=4) for a in placed.position)
    speed = quantity(float(np.linalg.norm(placed.velocity)), "speed", digits=4)
    density = mass / (4.0 / 3.0 * np.pi * radius**3)
    times = radius / np.median(radii)
    return [
        ("radius", f"{quantity(radius, 'length', digits=4)}, {times:.3g} of a grain's"),
        ("mass", f"{quantity(mass, 'mass', digits=5)} ({density / 1e3:.4g} g/cm^3)"),
        ("centre at the start", centre),
        ("speed", f"{speed}{', driven' if placed.speed is not None else ' at the start, free'}"),
    ]


def _forces(scene):
    """Sections of the forces from outside: the constants of their laws."""
    sections = []
    for block in list_forces(scene):
        law, law_name = find_law(block), getattr(block, "kind", "gravity")
        values = law.numbers(block)
        rows = [
            (name, _vector(np.ravel(values[name]), number.unit))
            for name, number in law.NUMBERS.items()
        ]
        sections.append((f"Force: {law_name}", rows))
    return sections


def _vector(values, unit):
    """Components of a number of a law with their unit."""
    if len(values) == 1:
        return _number(float(values[0]), unit)
    return f"{', '.join(f'{value:.4g}' for value in values)} {unit}"


def _step(step):
    """Rows of a TimeStep."""
    out = []
    if np.isfinite(step.period):
        out.append(("stiffest period (densest packing, walls)", f"{step.period * 1e9:.4g} ns"))
        out.append(("largest stable step there", f"{step.limit * 1e9:.4g} ns"))
    if np.isfinite(step.resolved) and step.resolved < 10.0 * step.dt:
        out.append(("step resolving the impact", f"{step.resolved * 1e9:.4g} ns"))
    if step.impact is not None:
        out.append(("impact speed of two grains", step.impact.text()))
    step_text = f"{step.dt * 1e9:.4g} ns"
    if np.isfinite(step.period):
        step_text += f" = {step.dt / step.period:.3g} of the stiffest period"
    if step.dt > step.resolved * (1.0 + 1e-9):
        step_text += f", {step.dt / step.resolved:.2g} times the step resolving the impact"
    return [*out, ("time step", step_text)]


def _state_memory(preparation):
    """Memory of the state, without the scratch of the search."""
    room = capacity_for(len(preparation.order))
    size = sum(
        int(np.prod(v.shape)) * max(v.element[1], 1) * np.dtype(TYPES[v.element[0]]).itemsize
        for v in declare(room, preparation.layout, preparation.domain.box is not None)
    )
    room = f"{room:,} grains, plus up to 17 % for the neighbour search"
    return f"{size / 2**20:.3g} MiB for a capacity of {room}"


def _contact(c, scene):
    quantity = quantities.format
    rows = [
        ("reduced radius R", quantity(c.R, "length", digits=5)),
        ("contact radius at equilibrium a0", quantity(c.a0, "length", digits=5)),
        ("overlap at equilibrium delta0", quantity(c.delta0, "length", digits=5)),
        ("breaks at overlap -delta_c", quantity(-c.delta_c, "length", digits=5)),
        ("pull-off force F_c", quantity(c.F_c, "force", digits=5)),
        ("normal stiffness k_n", f"{c.k_n:.5g} N/m"),
    ]
    model = chosen_model(scene.interaction)
    for effect, law in model.effects[1:]:
        for name, number in law.NUMBERS.items():
            label = f"{number.meaning} {name}"
            label = label if effect in label else f"{effect}: {label}"
            rows.append((label, _number(c.numbers[name], number.unit)))
    return rows


def _number(value, unit):
    """A number of a law with its unit."""
    for name, dimension in DIMENSIONS.items():
        if dimension.unit == unit:
            return quantities.format(value, name, digits=5)
    return f"{value:.5g} {unit}".removesuffix(" 1")


def _sample(scene, preparation):
    """Rows of the Sample of a Prepared."""
    bodies, info = preparation.properties, preparation.sample.info
    mass = quantities.format(constants.grain_mass(scene.material), "mass", digits=5)
    rows = [("grains", f"{len(preparation.sample):,}")]
    if bodies.material is not None:
        names = [DEFAULT, *scene.materials]
        material_names = [names[number] for number in np.unique(bodies.material)]
        ends = (bodies.radius.min(), bodies.radius.max())
        ends = (quantities.format(r, "length", digits=5) for r in ends)
        rows.append(("radii", " to ".join(ends)))
        rows.append(("materials", ", ".join(material_names)))
        masses = (bodies.mass.min(), bodies.mass.max())
        mass = " to ".join(quantities.format(m, "mass", digits=5) for m in masses)
    rows += [("mass of a grain", mass), *_sizes(preparation.domain, info, bool(scene.surfaces))]
    named = {
        "bulk_filling_factor": "filling factor of the inner part",
        "pieces": "connected fragments",
        "loose_grains": "grains not connected to the floor of the deposit",
        "left_out": "grains that the cut has disconnected, left out",
    }
    known_keys = [key for key in named if key in info and np.isfinite(info[key])]
    if info.get("pieces") == info["network"]["fragments"]:  # which the contacts state already
        known_keys.remove("pieces")
    if np.isfinite(info.get("fractal_dimension", np.nan)):
        dimension = min(info["fractal_dimension"], 3.0)  # more within its error: homogeneous
        text = f"{dimension:.1f}, with an error below {LARGEST_ERROR:g}"
        rows.append(("fractal dimension of the core", text))
    rows += [(named[key], f"{info[key]:.4g}") for key in known_keys]
    if info["kind"] == "collision":
        for key, text in (
            ("impact_parameter", "impact parameter"),
            ("gap", "gap before first contact"),
        ):
            rows.append((text, quantities.format(info[key], "length", digits=4)))
        if not info["hit"]:
            rows[-1] = ("gap before first contact", "none: the bodies miss each other")
    return rows + [("note", text) for text in info.get("remarks", ())]


def _sizes(domain, info, has_surfaces):
    """Rows of the measures of a sample (samples.describe) in a Domain.

    has_surfaces: whether the scene has `surfaces`, behind which the box continues.
    """
    network, edges, rows = info["network"], domain.lengths(0), []
    axes = [] if domain.cell is None else list(domain.cell.axes)
    if axes:
        along = "" if len(axes) == 3 else f" along {', '.join(AXES[n] for n in axes)}"
        tilt = domain.tilt(0)
        tilted = f", tilted by {tilt:.4g} µm along x" if tilt else ""
        rows.append(("periodic cell", f"{_edges(edges[axes])}{along}{tilted}"))
    elif "period" in info:
        rows.append(("repeats itself after", _edges(1e6 * np.array(info["period"]))))
    rows.append(("contacts", samples.format_counts(network)))
    if "percolating" in network:
        which = f"{network['percolating']:,} of {network['fragments']:,} fragments: "
        which = which if network["fragments"] > 1 else ""
        text = f"{which}connected to its own images along {', '.join(network['along'].split())}"
        rows.append(("percolates", text))
    # a body in open space counts as one, whether or not it is connected
    of = " of the largest fragment" if axes and network["fragments"] > 1 else ""
    gyration = info.get("radius_of_gyration")
    gyration = "none, since it percolates" if gyration is None else f"{gyration * 1e6:.4g} µm"
    rows += [
        (f"extent{of}", _edges(1e6 * np.array(info["extent"]))),
        ("coordination number", f"{info['coordination']:.3g}"),
        (f"filling factor of the {info['filling_factor_in']}", f"{info['filling_factor']:.4g}"),
    ]
    if domain.bounded and len(axes) < 3:
        behind = ", with the space behind surfaces" if has_surfaces else ""
        rows.append(
            ("filling factor of the box", f"{domain.clock().filling_factor_at(0):.4g}{behind}")
        )
    return [*rows, (f"radius of gyration{of}", gyration)]


def _edges(lengths):
    """Lengths [um] for the user."""
    return " x ".join(f"{edge:.4g}" for edge in lengths) + " µm"
