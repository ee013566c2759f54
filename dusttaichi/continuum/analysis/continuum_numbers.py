"""The numbers of a run of the continuum: rows of the registry, which its Method names."""

import numpy as np

from dusttaichi.analysis.ledger import compute_ledger
from dusttaichi.analysis.numbers import Family, Observable
from dusttaichi.analysis.numbers.number_registry import quiet
from dusttaichi.analysis.settings import look_up
from dusttaichi.continuum.analysis import laboratory
from dusttaichi.continuum.analysis.dust_fragments import (
    bounce,
    collide,
    is_pushed,
    pieces,
    velocities_at_start,
)
from dusttaichi.continuum.analysis.filling import (
    axis_profile,
    cumulated_volume,
    measure_compacted_mass,
)
from dusttaichi.continuum.analysis.intrusion import intrusion
from dusttaichi.continuum.analysis.particle_snapshot import read_particles
from dusttaichi.errors import DustError

NUMERICAL = ("viscosity", "grid", "artificial")
"""Channels of the ledger that are of the method, not of the material."""
LEAST_LOST = 0.01  # of the energy: of less a share says nothing about the run
LEAST_NET = 0.1  # of losses and gains together: else gains are nearly as large as losses


def _measure(run):
    numbers = {"particles": int(run.attrs["particles"])} | numerical_dissipation(
        compute_ledger(run)
    )
    if len(run.series.time) and "substeps" in run.series:
        numbers["time_steps"] = int(run.series.substeps.values[-1])
    if len(run.series.time) and "largest_filling_factor" in run.series:
        largest = float(np.fmax.reduce(run.series.largest_filling_factor.values))
        numbers["largest_filling_factor"] = largest or None  # 0 without dust
    if run.snapshots is None:
        return numbers
    first, last = read_particles(run, 0), read_particles(run, -1)
    if first.is_dust.any():
        numbers["compacted_mass"] = measure_compacted_mass(last, first)
    return numbers | (_impact(run) if run.intrudes else _flight(run))


def numerical_dissipation(energies):
    """Share of the method in the energy lost, or why there is none: numbers by name.

    energies: a Ledger. There is no share where next to nothing of the energy is lost, or where
    gains of some channels make up for most of the losses of others.
    """
    if not any(energies.shares.values()):
        return {}
    ends = {channel: values[-1] for channel, values in energies.losses.items()}
    lost, size = sum(ends.values()), sum(map(abs, ends.values()))
    energy = energies.reference[-1]
    if lost >= LEAST_LOST * energy and lost >= LEAST_NET * size:
        fraction = sum(energies.shares.get(channel, 0.0) for channel in NUMERICAL)
        return {"numerical_dissipation": fraction}
    numerical = sum(ends.get(channel, 0.0) for channel in NUMERICAL)
    return {
        "numerical_dissipation_problem": f"{100 * numerical / energy:.2g} % of the energy; all "
        f"losses, {100 * lost / energy:.2g} % of it, are too small for a share"
    }


def _impact(run):
    try:
        way = intrusion(run)
    except DustError as error:  # nothing has happened to the dust
        return {"stop_problem": f"none: {error}"}
    numbers = {
        "impact_speed": way.speed,
        "momentum_per_area": way.momentum,
        "rebound": way.rebound if way.stop else None,
        "bead_filling_factor": _number(axis_profile(run).nearest),
        "compacted_volume": cumulated_volume(run).above(laboratory.LEAST_COMPARED),
    }
    for name, stop in (("", way.stop), ("_weightless", way.without_gravity)):
        if stop is None:
            numbers |= {} if name else {"stop_problem": "not reached: the run ended before"}
        else:
            numbers |= {f"stopping_time{name}": stop.time, f"depth{name}": stop.depth}
    if way.stop is not None:
        numbers["sine_rms"] = (way.without_gravity or way.stop).rms
    density = way.mass / (np.pi / 4.0 * way.diameter**2)
    mass = way.mass
    if way.dimension == 2:
        mass = laboratory.sphere_mass(way.diameter, density)
    if way.speed > 0.0:
        numbers["depth_law"] = laboratory.depth(mass, way.speed)
        numbers["stopping_time_law"] = laboratory.stopping_time(mass, way.speed)
    return numbers


def _flight(run):
    """Numbers of bodies of dust that fly at a wall or at each other."""
    start = velocities_at_start(run)
    if not any(np.linalg.norm(velocity) > 0.0 for velocity in start.values()):
        return {}
    end_pieces = pieces(run)
    numbers = {
        "pieces": len(end_pieces.mass),
        "largest_piece": end_pieces.largest_share,
        "sticking_mass": end_pieces.sticking_share
        if end_pieces.walled and is_pushed(run)
        else None,
    }
    if len(start) == 1:
        try:
            back = bounce(run)
        except DustError as error:
            return numbers | {"restitution_problem": f"none: {error}"}
        numbers |= {"dust_restitution": back.coefficient, "largest_rebound": back.rebound}
    elif len(start) == 2:
        back = collide(run)
        numbers |= {"dust_restitution": back.coefficient, "restitution_problem": back.problem}
    return numbers


def _number(value):
    return value if np.isfinite(value) else None


def _scale_text(scale, text, unit):
    return lambda value, n: f"{value * scale:{text}} {unit}"


def _law(key, scale, unit, equation):
    """Text of the laws of G09 beside the numbers of a sphere."""

    def write_law(n):
        law = n[key]
        return "" if law is None else f"{law * scale:.3g} {unit} (G09 eq {equation})"

    return write_law


def _pieces(value, n):
    largest_text = f"{100.0 * n['largest_piece']:.1f} % of the mass in the largest"
    return f"{value}, {largest_text}" if value > 1 else "1"


LOW, HIGH = laboratory.COMPACTED
DUST = Family(
    name="continuum",
    title="the continuum",
    order=90,
    measure=_measure,
    numbers=(
        Observable(name="impact_speed", title="impact speed", unit="m/s", text="{:.4g} m/s"),
        Observable(name="momentum_per_area", title="momentum over cross-section of a sphere",
                   unit="kg/(m s)", text="{:.3g} kg/(m s)", column=None),
        Observable(name="stop_problem", title="stopping time", unit="", column=None,
                   about="why there is no stopping time"),
        Observable(name="stopping_time", title="stopping time", unit="s", reason_row="stop_problem",
                   text=_scale_text(1e3, ".3f", "ms"), column=None, figure="deceleration"),
        Observable(name="stopping_time_weightless", title="… with g t^2/2 taken away", unit="s",
                   text=_scale_text(1e3, ".3f", "ms"),
                   literature=_law("stopping_time_law", 1e3, "ms", 13),
                   column=("stopping time ms", "{:.2f}", 1e-3), trade_rank=7,
                   trade_name="stopping_time", about="stopping time of a bead, g t^2/2 taken away",
                   figure="deceleration"),
        Observable(name="depth_problem", title="depth", unit="", column=None,
                   about="why there is no depth",
                   value=lambda numbers: numbers.get("stop_problem")),
        Observable(name="depth", title="depth", unit="m", text=_scale_text(1e3, ".3f", "mm"),
                   reason_row="stop_problem", column=None, figure="deceleration"),
        Observable(name="depth_weightless", title="… with g t^2/2 taken away", unit="m",
                   text=_scale_text(1e3, ".3f", "mm"), literature=_law("depth_law", 1e3, "mm", 12),
                   column=("depth mm", "{:.3f}", 1e-3), trade_rank=6, trade_name="depth",
                   about="depth of a bead, g t^2/2 taken away", figure="deceleration"),
        Observable(name="sine_rms", title="rms from the sine", unit="m", column=None,
                   text=_scale_text(1e6, ".1f", "µm"), literature="2.5-28 µm (G09)"),
        Observable(name="rebound", title="fastest rebound", unit="m/s", text="{:.4f} m/s",
                   column=None),
        quiet("stopping_time_law", "stopping time by G09 eq 13", "s"),
        quiet("depth_law", "depth by G09 eq 12", "m"),
        Observable(name="bead_filling_factor", title="filling factor within 0.3 mm below",
                   text="{:.3f}", literature=f"{laboratory.MOST_FREQUENT} (G09 Fig 11)",
                   column=("phi below bead", "{:.3f}", 1), figure="bead_profile"),
        Observable(name="compacted_volume", title="volume denser than 0.22, in bead volumes",
                   text="{:.2f}", literature=f"{LOW}-{HIGH} compacted (G09)",
                   column=("bead volumes denser than 0.22", "{:.2f}", 1),
                   figure="compacted_volume"),
        Observable(name="largest_filling_factor", title="largest filling factor", text="{:.3f}",
                   column=None, figure="filling_factors"),
        Observable(name="compacted_mass", title="mass whose filling factor rose by at least 5 %",
                   text=_scale_text(100.0, ".1f", "%"), column=None, figure="filling_factors"),
        Observable(name="pieces", title="pieces", text=_pieces, column=None),
        quiet("largest_piece", "share of the largest piece"),
        Observable(name="sticking_mass", title="mass that sticks to a wall",
                   text=_scale_text(100.0, ".1f", "%"), column=("share that sticks", "{:.2f}", 1)),
        Observable(name="restitution_problem", title="coefficient of restitution", unit="",
                   column=None, about="why there is no restitution"),
        Observable(name="dust_restitution", title="coefficient of restitution", text="{:.4f}",
                   reason_row="restitution_problem", column=("restitution of dust", "{:.3f}", 1),
                   trade_rank=8, about="restitution of dust"),
        Observable(name="largest_rebound", title="largest rebound of the centre of mass",
                   text="{:.3f} v0", column=("rebound", "{:.3f}", 1)),
        Observable(name="numerical_dissipation_problem", title="numerical dissipation", unit="",
                   column=None, about="why there is no share of numerical dissipation"),
        Observable(name="numerical_dissipation", title="numerical dissipation",
                   text=_scale_text(100.0, ".1f", "% of the energy lost"),
                   reason_row="numerical_dissipation_problem",
                   column=("numerical dissipation", "{:.1%}", 1), figure="ledger"),
        Observable(name="time_steps", title="time steps (substeps)", text="{:,}", column=None),
        Observable(name="particles", title="particles", text="{:,}",
                   column=("particles", "{:,}", 1)),
    ),
)  # fmt: skip
_SETTINGS = {
    "material_p_m": ("material.compressive.p_m", "p_m"),
    "shear_exponent": ("material.shear.exponent", "a of Y"),
    "bulk_modulus": ("material.bulk_modulus", "K_0"),
    "spacing": ("numerics.spacing", "spacing"),
    "viscosity_contact": ("numerics.viscosity.contact", "viscosity alpha"),
    "contact": ("numerics.contact", None),
}  # name -> (key of the scene, heading)
SETTINGS = Family(
    name="continuum scene",
    title="the scene of a continuum",
    order=89,
    compared=True,
    measure=lambda run: {
        name: str(look_up(run.scene, key)) for name, (key, _) in _SETTINGS.items()
    },
    numbers=tuple(
        Observable(name=name, title=key, unit="", column=heading and (heading, "{}", 1))
        for name, (key, heading) in _SETTINGS.items()
    ),
)
FAMILIES = (DUST, SETTINGS)
