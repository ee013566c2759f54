"""Figures of results, for screen and paper. They compute nothing: see dusttaichi.analysis.

Each function returns a matplotlib Figure of its own, without pyplot and without a display.
"""

from functools import partial
from pathlib import Path

from dusttaichi.analysis import arrival, held_loads, is_triaxial
from dusttaichi.analysis import sound_speed as fit_speed
from dusttaichi.analysis.continuum import has_dust
from dusttaichi.analysis.drive import is_dynamic
from dusttaichi.analysis.ensemble_tables import axes_of
from dusttaichi.errors import DustError
from dusttaichi.names import WALLS
from dusttaichi.plots.animation import animation
from dusttaichi.plots.bodies import bodies_figure as bodies
from dusttaichi.plots.collision import collision, collision_spectrum
from dusttaichi.plots.compression import compression
from dusttaichi.plots.continuum import (
    bead_profile,
    compacted_volume,
    deceleration,
    filling_factors,
    impact,
    wall_forces,
)
from dusttaichi.plots.coordination import coordination
from dusttaichi.plots.cycles import cycles
from dusttaichi.plots.draft import marked
from dusttaichi.plots.drops import drops
from dusttaichi.plots.dust import dust
from dusttaichi.plots.dynamic import dynamic_speeds
from dusttaichi.plots.ensemble import ensemble, points
from dusttaichi.plots.extremes import extremes
from dusttaichi.plots.fractal import fractal
from dusttaichi.plots.fragments import (
    fragment_dimension,
    mass_spectrum,
    restitution,
    sound_speed,
)
from dusttaichi.plots.grains import grains
from dusttaichi.plots.isotropic import isotropic
from dusttaichi.plots.ledger import ledger
from dusttaichi.plots.loads import loads, shear, triaxial
from dusttaichi.plots.losses import losses
from dusttaichi.plots.numbers import numbers
from dusttaichi.plots.penetration import sphere, sphere_column
from dusttaichi.plots.pores import pores
from dusttaichi.plots.profile import profile
from dusttaichi.plots.resolution import resolution
from dusttaichi.plots.stress import stress
from dusttaichi.plots.structure import structure
from dusttaichi.plots.style import bands, save, styled
from dusttaichi.plots.tensile import strength, tensile
from dusttaichi.plots.together import kinetic, sound_speeds
from dusttaichi.plots.trade import trade

__all__ = [
    "animation",
    "bead_profile",
    "bands",
    "bodies",
    "collision",
    "collision_spectrum",
    "compacted_volume",
    "compression",
    "coordination",
    "cycles",
    "deceleration",
    "drops",
    "dynamic_speeds",
    "dust",
    "ensemble",
    "drawings",
    "figures_of",
    "figures_of_ensemble",
    "figures_together",
    "extremes",
    "filling_factors",
    "fractal",
    "fragment_dimension",
    "grains",
    "impact",
    "isotropic",
    "kinetic",
    "ledger",
    "loads",
    "losses",
    "mass_spectrum",
    "numbers",
    "points",
    "pores",
    "profile",
    "resolution",
    "restitution",
    "save",
    "save_all",
    "save_ensemble",
    "save_together",
    "shear",
    "sound_speed",
    "sound_speeds",
    "sphere",
    "sphere_column",
    "strength",
    "stress",
    "structure",
    "tensile",
    "trade",
    "triaxial",
    "wall_forces",
]


def save_all(run, directory, suffix=".png"):
    """Write every figure of `figures_of`. Returns the paths.

    suffix: what matplotlib knows, .png, .pdf, .svg. Raises DustError where the directory cannot
    be written.
    """
    return _save(figures_of(run), directory, suffix)


FEW = 10  # grains: fewer have no structure to show


@styled
def figures_of(run):
    """Every figure that a Run has something for, by name: those of `drawings`."""
    drawn = {name: draw() for name, draw in drawings(run).items()}
    return {name: figure for name, figure in drawn.items() if figure is not None}


def drawings(run):
    """Functions that draw what a Run has something for, by the names of the figures; each returns
    None where the run turns out to lack it.

    ledger; compression and coordination (compressed under a wall); isotropic and coordination
    (pressed from all sides); cycles (let go again); loads (pressures that are held); shear (stages
    that shear); triaxial (that hold a stress along two axes); tensile and losses (stretched), and
    with two snapshots of the stretching fractal; bodies, collision and fragments (two bodies that
    fly at each other); sound_speed (after a push that snapshots show to arrive); stress (where it
    was written); structure (of the last snapshot, with the forces of its contacts), pores of a room
    or fragment_dimension of a body in the open; profile (where profiles were written); sphere and
    sphere_column (of a sphere that goes into grains).
    Of a run of the continuum: wall_forces, dust (a map), filling_factors; where a bead falls on
    dust impact, bead_profile, deceleration and compacted_volume.
    """
    several, found = len(run.series.time) > 1, {}
    if several and "loss" in run.series:
        found["ledger"] = partial(ledger, run)
    if several and "body_angular_momentum" in run.series:
        found["bodies"] = partial(bodies, run)
    if run.collides:
        found |= {
            "collision": partial(collision, run),
            "fragments": partial(collision_spectrum, run),
        }
    if run.compresses:
        found["compression"] = partial(compression, [run])
    if run.shrinks:
        found["isotropic"] = partial(isotropic, [run])
    if run.compresses or run.shrinks:
        found["coordination"] = partial(coordination, [run])
    if run.unloads:
        found["cycles"] = partial(cycles, run)
    if held_loads(run):
        found["loads"] = partial(loads, run)
    if run.sheared:
        found["shear"] = partial(shear, run)
    if is_triaxial(run):
        found["triaxial"] = partial(triaxial, run)
    if run.stretches:
        found |= _stretched(run)
    if several and "stress" in run.series:
        found["stress"] = partial(stress, run)
    if run.has_forces and run.grains >= FEW:
        found["structure"] = partial(structure, run)
        # pores in a room, the dimension of a body in the open: neither in a room that is open
        space = ("pores", pores) if "box" in run.tree["snapshots"] else _FRAGMENT
        found[space[0]] = _if_possible(space[1], run)
    if run.pushes:
        found["sound_speed"] = _if_possible(_sound, run)
    if run.profiles is not None:
        found["profile"] = partial(profile, run)
    if run.has_sphere:  # that may not have reached the grains
        found["sphere"] = _if_possible(sphere, run)
        if run.snapshots is not None:
            found["sphere_column"] = _if_possible(sphere_column, run)
    if run.is_continuum:
        found |= _continuum(run, several)
    return marked(found, run)


def _stretched(run):
    """Drawings of a run that is stretched."""
    found = {"tensile": partial(tensile, [run]), "losses": partial(losses, run)}
    frames = run.part_that("stretches").snapshots
    if frames is not None and frames.sizes["snapshot"] > 1 and "tilt" not in frames:
        found["fractal"] = partial(fractal, run)
    return found


_FRAGMENT = ("fragment_dimension", fragment_dimension)


def _if_possible(draw, run):
    """A function that draws a figure of a Run, or returns None where it has nothing to show."""

    def drawn():
        try:
            return draw(run)
        except DustError:
            return None

    return drawn


def _continuum(run, several):
    """Of a run of the continuum: drawings of an impact of a bead, of faces, of filling factors."""
    found = {}
    if several and "pressure" in run.series and set(WALLS) & set(run.scene["boundary"]):
        found["wall_forces"] = partial(wall_forces, run)
    if run.snapshots is None:
        return found
    found["dust"] = partial(dust, run)
    if has_dust(run):
        found["filling_factors"] = partial(filling_factors, run)
    if run.intrudes:
        found |= {
            "impact": partial(impact, run),
            "bead_profile": partial(bead_profile, [run]),
            "deceleration": partial(deceleration, [run]),
            "compacted_volume": partial(compacted_volume, [run]),
        }
    return found


def _sound(run):
    """The speed of sound of a run with a push."""
    arrivals = arrival(run)
    return sound_speed(arrivals, fit_speed(arrivals))


def save_ensemble(data, directory, suffix=".png"):
    """Write the figures of `figures_of_ensemble`. Returns the paths."""
    return _save(figures_of_ensemble(data), directory, suffix)


def figures_of_ensemble(data):
    """The figures of a dataset of `analysis.gather`, an ensemble or a sweep, by name.

    sweep or ensemble: its curves in one; points: each of them by itself; numbers: the numbers of
    the runs against the swept keys, or the replicas.
    """
    figures = {"sweep" if axes_of(data) else "ensemble": ensemble(data)}
    drawn = {"points": points(data), "numbers": numbers(data)}
    return figures | {name: figure for name, figure in drawn.items() if figure is not None}


def save_together(runs, directory, suffix=".png"):
    """Write the figures of `figures_together`. Returns the paths.

    Raises DustError where there are none, or the directory cannot be written.
    """
    figures = figures_together(runs)
    if not figures:
        raise DustError(
            "There is no figure to show these runs together: no two of them are compressed, "
            "stretched, pushed or move."
        )
    return _save(figures, directory, suffix)


@styled
def figures_together(runs):
    """The figures that show several Runs in one, by name.

    compression, isotropic, tensile and strength, of those runs that have them, where two have;
    dynamic_speeds of boxes pressed by a fast wall;
    deceleration, bead_profile, compacted_volume, drops and resolution of beads that fall on dust;
    sphere and sphere_column where one of two is a sphere among grains;
    sound_speeds of pushes; kinetic of collisions, and of runs that have nothing else in common.
    """
    figures = {}
    for does, draw in (
        ("compresses", {"compression": compression}),
        ("shrinks", {"isotropic": isotropic}),
        ("stretches", {"tensile": tensile, "strength": strength}),
        (
            "intrudes",
            {
                "deceleration": deceleration,
                "bead_profile": bead_profile,
                "compacted_volume": compacted_volume,
                "drops": drops,
                "resolution": resolution,
            },
        ),
    ):
        able = [run for run in runs if getattr(run, does)]
        if len(able) > 1:
            figures |= {name: function(able) for name, function in draw.items()}
    fast = [run for run in runs if is_dynamic(run)]
    if len(fast) > 1:
        figures["dynamic_speeds"] = dynamic_speeds(fast)
    with_sphere = [run for run in runs if run.has_sphere or run.intrudes]
    if len(with_sphere) > 1 and any(run.has_sphere for run in with_sphere):
        figures |= {"sphere": sphere(with_sphere), "sphere_column": sphere_column(with_sphere)}
    return figures | _of_any_kind(runs, figures)


def _of_any_kind(runs, figures):
    """Of several runs with a push the speed of sound; of such that collide, or have nothing else
    in common, the kinetic energy."""
    found = {}
    pushed = [run for run in runs if run.pushes]
    if len(pushed) > 1:
        try:
            found["sound_speeds"] = sound_speeds(pushed)
        except DustError:
            pass  # no snapshots that tell
    if len(runs) > 1 and (all(run.collides for run in runs) or not (figures or found)):
        try:
            found["kinetic"] = kinetic(runs)
        except DustError:
            pass  # of a method that has none
    return found


def _save(figures, directory, suffix):
    return [save(figure, Path(directory) / f"{name}{suffix}") for name, figure in figures.items()]
