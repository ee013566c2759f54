"""Preview of a continuum for `dust check`: particles, material, step and memory."""

from math import pi

import numpy as np

from dusttaichi.compute.memory import TYPES, capacity_for
from dusttaichi.continuum import dust_time_step
from dusttaichi.continuum.dust_advice import advice
from dusttaichi.continuum.dust_build import layout_of
from dusttaichi.continuum.dust_placement import domain_of, stiff_faces
from dusttaichi.continuum.kernels.rates import DAMPED
from dusttaichi.continuum.kernels.store import declare
from dusttaichi.continuum.physics import dust_laws, elasticity, strength
from dusttaichi.continuum.samples import make, numbers_of
from dusttaichi.method import Preview
from dusttaichi.results.roles import ELASTIC, ROLES
from dusttaichi.scene import quantities


def preview(scene):
    """The Preview of a scene (dusttaichi.method): its particles are made, nothing is compiled."""
    sample = make(scene)
    dust = sample.is_dust
    m = numbers_of(scene, sample)
    if scene.materials:
        m = m.take(dust)
    sound = elasticity.sound_speed(sample.density[dust], sample.reference[dust], m)
    elastic = sample.role == ELASTIC
    stiff = sample.modulus[elastic] * (1.0 + 4.0 / 3.0 * sample.shear_ratio[elastic])
    of_elastic = np.sqrt(stiff / sample.density[elastic])
    fastest = max(sound.max(initial=0.0), of_elastic.max(initial=0.0))
    speed = np.linalg.norm(sample.velocity, axis=1).max()
    fastest = max(float(fastest) * _find_signal_factor(scene.numerics.viscosity), float(speed))
    output_step = dust_time_step.output_step(scene, fastest)
    sections = [
        ("Sample", _sample(scene, sample)),
        *(
            [("Dust at the start", _dust(sample, dust, sound, m) + _laws(scene))]
            if dust.any()
            else []
        ),
        ("Particles", [*_particles(scene), *_resolution(sample)]),
        ("Time step", _steps(scene, sample, fastest, output_step)),
        ("Memory", [("state", _memory(scene, len(sample)))]),
    ]
    if texts := advice(scene, sample):
        sections.append(("Defaults to change", [tuple(text.split(": ", 1)) for text in texts]))
    domain = domain_of(scene, sample, output_step)
    cost = _time_steps(scene, fastest, domain.dt) * (1.0 if scene.dimension == 2 else SOLID)
    return Preview(sections, len(sample), domain.dt, domain.plan_stages(scene), cost)


ROUND_OFF = 1e-9
"""Speed of a body over the largest of a particle below which it is that of a spin alone."""
SOLID = 2.7
"""Time of a step in three dimensions over that in two, per particle (docs/speed.md)."""


def _time_steps(scene, fastest, output_step):
    """Time steps in an output step, at the start."""
    return output_step * fastest / (scene.numerics.cfl * scene.numerics.smoothing_length) or 1.0


def _find_signal_factor(viscosity):
    """Factor of a viscosity on the speed of signals."""
    return max(1.0, viscosity.contact, viscosity.bulk, DAMPED * viscosity.grid)


def _sample(scene, sample):
    counts = np.bincount(sample.role, minlength=len(ROLES))
    counts_text = ", ".join(f"{n:,} {role}" for role, n in zip(ROLES, counts, strict=True) if n)
    if np.count_nonzero(counts) > 1:
        counts_text = f"{len(sample):,}: {counts_text}"
    extent = np.ptp(sample.position[:, list(sample.axes)], axis=0) + sample.spacing
    rows = [
        ("particles", counts_text),
        ("extent", " x ".join(f"{e * 1e3:.4g}" for e in extent) + " mm"),
    ]
    fastest = np.linalg.norm(sample.velocity, axis=1).max()
    names = [body.name for body in sample.bodies]
    for number, body in enumerate(sample.bodies):
        name = f"{body.name} {number + 1}" if names.count(body.name) > 1 else body.name
        speed = float(np.linalg.norm(body.velocity))
        if speed > ROUND_OFF * fastest:
            rows.append((f"speed of {name}", quantities.format(speed, "speed", digits=4)))
    carried = sample.info.get("gravity_carried")
    if carried is not None:
        rows.append(("weight that the dust carries", f"{100.0 * carried:.3g} %"))
    return rows + [("note", text) for text in sample.info.get("remarks", ())]


def _dust(sample, dust, sound, m):
    """Filling factor, modulus and strengths, from the loosest to the densest particle."""
    density, reference = sample.density[dust], sample.reference[dust]
    phi = density / m.rho_s

    def ends(values, dimension):
        low, high = (quantities.format(float(v), dimension, digits=4) for v in
                     (values.min(), values.max()))  # fmt: skip
        return low if low == high else f"{low} to {high}"

    low, high = phi.min(), phi.max()
    return [
        ("filling factor", f"{low:.4g}" if high - low < 1e-6 else f"{low:.4g} to {high:.4g}"),
        ("bulk modulus", ends(elasticity.bulk_modulus(reference, m), "pressure")),
        ("longitudinal speed of sound", ends(sound, "speed")),
        ("compressive strength Sigma", ends(strength.compressive(phi, m), "pressure")),
        ("tensile strength -T", ends(-strength.tensile(phi, m), "pressure")),
        ("shear strength Y", ends(strength.shear(phi, m), "pressure")),
    ]


def _laws(scene):
    """Row of the laws of the dust that are not the default ones; none where all are."""
    law_names = dict.fromkeys(
        f"{law_kind} {name}"
        for material in scene.all_materials
        for law_kind, default in dust_laws.DEFAULT.items()
        if (name := dust_laws.law_name(material, law_kind)) != default
    )
    return [("laws", ", ".join(law_names))] if law_names else []


def _particles(scene):
    numerics, d = scene.numerics, scene.dimension
    reach = numerics.support / numerics.spacing
    # of the densest lattice: a particle has sqrt(3)/2 of a spacing squared, or 1/sqrt(2) cubed
    neighbours = pi * reach**2 * 2.0 / 3.0**0.5 if d == 2 else 4.0 / 3.0 * pi * reach**3 * 2.0**0.5
    return [
        ("spacing", quantities.format(numerics.spacing, "length", digits=4)),
        ("smoothing length h", quantities.format(numerics.smoothing_length, "length", digits=4)),
        ("neighbours within the kernel's support", f"about {neighbours - 1.0:.0f}"),
    ]


ACROSS = 12
"""Spacings across a body that moves, with which numerical dissipation takes 4 % of the energy of a
bead (docs/continuum.md)."""


def _resolution(sample):
    """Rows of the bodies that are resolved by fewer than ACROSS spacings.

    That makes numerical dissipation large.
    """
    rows, axes = [], list(sample.axes)
    for number, body in enumerate(sample.bodies):
        points = sample.position[sample.body == number][:, axes]
        flies = np.any(body.velocity) or np.any(body.spin)
        if not flies or not len(points) or body.size == 0.0:
            continue
        across = (np.ptp(points, axis=0).min() + sample.spacing) / sample.spacing
        if across < ACROSS - 0.5:
            least = quantities.format(across / ACROSS * sample.spacing, "length", digits=2)
            text = f"{across:.0f} spacings, fewer than the {ACROSS} that keep numerical dissipation"
            rows.append((f"across {body.name}", f"{text} low; numerics.spacing: {least} has them"))
    return rows


def _whole_steps(scene, output_step, exact):
    """Rows of the requested times that output steps do not meet; exact: they may not be shorter."""
    rows, prefix, near = [], "" if exact else "at most ", "" if exact else "about "
    for plan in scene.stage_plans:
        of = f" of {plan.name}" if plan.name else ""
        for name in ("series", "snapshots"):
            every = getattr(getattr(plan, name), "time", None)
            if every is not None and every < (1.0 - 1e-9) * output_step:
                rows.append((f"{name}{of}", prefix + _instead(every, output_step, every)))
        end = plan.stop.time
        if end is not None:
            rounded = max(1, round(end / output_step)) * output_step
            if abs(rounded - end) > NEAR * end:
                step = end / round(end / output_step + 0.5)
                rows.append((f"end{of}", near + _instead(end, rounded, step)))
    return rows


NEAR = 1e-3
"""Share of the time of the end up to which whole steps meet it."""


def _instead(requested, met, step):
    requested, met, step = (quantities.format(t, "time", digits=6) for t in (requested, met, step))
    exact = f"numerics.time_step: {step} matches it exactly"
    return f"{met} in place of {requested}, in whole output steps; {exact}"


def _steps(scene, sample, fastest, output_step):
    """Rows of both steps; dust that is strained at the start, as kernels find, shortens them."""
    cfl_step = output_step / _time_steps(scene, fastest, output_step)
    still = not np.ptp(sample.velocity, axis=0).any()
    if stiff_faces(scene.boundary):
        still = still and not sample.velocity.any()
    exact = still or scene.numerics.time_step != "auto"
    length = f"{output_step * 1e6:.4g} µs, {output_step / cfl_step:.3g} time steps at the start"
    if not exact:
        length = f"at most {length}; less where bodies or walls are in contact"
    return [
        (
            "time step at the start",
            f"{cfl_step * 1e6:.4g} µs, shorter where dust gets denser",
        ),
        ("output step", length),
        *_whole_steps(scene, output_step, exact),
    ]


def _memory(scene, particles):
    """Memory of the state, without neighbour lists."""
    room = capacity_for(particles)
    bytes_per_particle = sum(
        max(v.element[1], 1) * np.dtype(TYPES[v.element[0]]).itemsize
        for v in declare(layout_of(scene))
    )
    size = bytes_per_particle * room / 2**20
    return f"{size:.3g} MiB for a capacity of {room:,} particles, plus the neighbour lists"
