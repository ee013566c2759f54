"""What `dust check` prints: the scene resolved into contact numbers, step, size, cost and parts."""

import time as real_time

import numpy as np

from dusttaichi import samples, units
from dusttaichi.grains import network
from dusttaichi.grains.build import build
from dusttaichi.grains.grain_contacts import contact_constants, grain_properties
from dusttaichi.grains.inventory import compiled_rows, field_rows, preset_rows, tables
from dusttaichi.grains.kernels.store import room_for
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.names import NEVER
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.registry import chosen_laws
from dusttaichi.scene import filling_direction, quantities
from dusttaichi.scene.material import DEFAULT

TRIAL_SECONDS = 1.0


def report(scene):
    """Sections (title, rows of (what, value)) for a scene, and its number of grains. Builds it and
    tries it for a second."""
    sample = samples.make(scene)
    sim = build(scene, sample)
    step = chosen_step(scene, samples.pushed(scene, sample), sim.polydisperse)
    pair, wall = contact_constants(scene)
    sections = [
        ("Contact of two grains", _contact(pair, scene)),
        *(
            [("Contact of a grain and a wall", _contact(wall, scene))]
            if scene.boundary.walls
            else []
        ),
        ("Sample", _sample(scene, sample)),
        ("Time step", network.rows(scene, sim, step)),
        ("Accuracy", preset_rows(scene)),
        ("Compiled in", compiled_rows(scene, sim)),
        ("Fields", field_rows(sim)),
        ("Cost", _cost(scene, sim)),
    ]
    return sections, sim.grains


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
    laws = chosen_laws(scene.interaction)
    for effect, law in laws.on[1:]:
        rows += [(f"{effect}: {n.meaning} {name}", _number(c.numbers[name], n.unit))
                 for name, n in law.NUMBERS.items()]  # fmt: skip
    return rows


def _number(value, unit):
    """A number of a law as people write it."""
    for name, dimension in quantities.DIMENSIONS.items():
        if dimension.unit == unit:
            return quantities.format(value, name, digits=5)
    return f"{value:.5g} {unit}".removesuffix(" 1")


def _sample(scene, sample):
    mass = quantities.format(constants.grain_mass(scene.material), "mass", digits=5)
    rows = [("grains", f"{len(sample.positions):,}")]
    bodies, radii = grain_properties(scene, sample), scene.material.radius
    if bodies is not None:
        names = [DEFAULT, *scene.materials]
        made_of = [names[number] for number in np.unique(bodies.material)]
        radii = bodies.radius * units.LENGTH
        ends = (quantities.format(r, "length", digits=5) for r in (radii.min(), radii.max()))
        rows.append(("radii", " to ".join(ends)))
        rows.append(("materials", ", ".join(made_of)))
        masses = np.array([bodies.mass.min(), bodies.mass.max()]) * units.MASS
        mass = " to ".join(quantities.format(m, "mass", digits=5) for m in masses)
    extent = samples.sample.extent(sample, radii)
    rows += [
        ("mass of a grain", mass),
        ("extent", " x ".join(f"{e * 1e6:.4g}" for e in extent) + " um"),
    ]
    info = sample.info
    if "period" in info:
        edges = " x ".join(f"{edge * 1e6:.5g}" for edge in info["period"])
        rows.append(("repeats itself after", f"{edges} um"))
    rows += [
        ("coordination number", f"{info['coordination']:.3g}"),
        (f"filling factor of the {info['filling_factor_in']}", f"{info['filling_factor']:.4g}"),
        ("radius of gyration", f"{info['radius_of_gyration'] * 1e6:.4g} um"),
    ]
    named = {
        "fractal_dimension": "fractal dimension of the core",
        "bulk_filling_factor": "filling factor of the inner part",
        "pieces": "pieces that hang together",
        "loose_grains": "grains not connected to the floor",
    }
    rows += [(text, f"{info[key]:.4g}") for key, text in named.items() if key in info]
    if info["kind"] == "collision":
        for key, text in (("impact_parameter", "impact parameter"), ("gap", "flight to the touch")):
            rows.append((text, quantities.format(info[key], "length", digits=4)))
        if not info["hit"]:
            rows[-1] = ("flight to the touch", "never: the bodies miss each other")
    return rows


def _cost(scene, sim):
    plan = _plan(scene, sim)
    rate = _trial(sim, plan[0][1])
    rows = [
        (
            "memory of the state",
            f"{state_bytes(sim) / 2**20:.4g} MiB, room for {room_for(sim.grains):,} grains "
            f"({state_bytes(sim) / room_for(sim.grains):.0f} bytes each)",
        ),
        ("speed in a trial now", f"{rate:,.0f} steps/s, {rate * sim.grains:.3g} grain-steps/s"),
    ]
    total = 0
    for name, steps, reason in plan:
        what = f"steps at most, stage {name}" if name else "steps at most"
        if steps == NEVER:
            return [*rows, (what, "not known beforehand: what is measured ends the run")]
        total += steps
        rows.append((what, f"{steps:,} ({steps * sim.dt:.5g} us; {reason})"))
    remark = ""
    if any(filling_direction(scene.boundary, plan.drive) > 0 for plan in scene.stage_plans):
        remark = "; contacts that form in compression make it up to twice that"
    return [
        *rows,
        ("estimated run time at most", f"{_duration(total / rate)} at this speed{remark}"),
    ]


def _plan(scene, sim):
    """(name, steps at most, reason) of every stage, from the edges that each leaves behind."""
    domain, first, out = sim.domain, 0, []
    for plan in scene.stage_plans:
        domain = domain.driven(plan.drive, first)
        end, reason = domain.clock(first).last_step(plan.stop)
        out.append((plan.name, end - first if end < NEVER else NEVER, reason))
        if end == NEVER:
            break
        first = end
    return out


def _trial(sim, end):
    """Steps a second, tried for about TRIAL_SECONDS and not beyond the end of the scene."""
    sim.advance(1)  # compiles
    steps, took, rate = 20, 0.0, float("nan")
    while took < TRIAL_SECONDS and sim.step < end:
        steps = min(steps, end - sim.step)
        began = real_time.perf_counter()
        sim.advance(steps)
        took = real_time.perf_counter() - began
        rate = steps / took
        steps = int(steps * min(10.0, max(2.0, 1.2 * TRIAL_SECONDS / took)))
    return rate


def state_bytes(sim):
    """Bytes of all fields of a simulation, scratch of the search included."""
    return sum(field.nbytes for field in tables(sim).values())


def _duration(seconds):
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
