"""Benchmarks of the continuum: `python docs/benchmarks.py [NAME ...]` runs them at two resolutions.

Each is a scene of configs/continuum/benchmarks with a closed form. What is found beside what is
expected goes to docs/validation/benchmarks_continuum.csv, the curves of the finer run to
docs/figures/benchmark_NAME.png.
"""

from pathlib import Path
from typing import NamedTuple

import closed_forms
import numpy as np
from scipy.optimize import curve_fit
from tables import update

from dusttaichi import analysis, plots
from dusttaichi.analysis.ledger import compute_ledger
from dusttaichi.continuum.analysis import read_particles
from dusttaichi.continuum.physics import strength
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.physics.point import MaterialPoint
from dusttaichi.continuum.scene.material import ContinuumMaterial
from dusttaichi.plots import style
from dusttaichi.running import execute
from dusttaichi.scene import load

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "configs/continuum/benchmarks"


class Row(NamedTuple):
    """A quantity of a benchmark: its expected value, and that of a run."""

    quantity: str
    unit: str
    expected: float
    measured: float


class Curves(NamedTuple):
    """Curves of the figure of a benchmark: (x, y) of a run as points, and of the closed form."""

    measured: tuple
    exact: tuple
    x: str
    y: str
    decades: bool = False


# -- planar compaction -----------------------------------------------------------------------------


WAVES = "first precursor", "second precursor", "front"
LEAST = 0.01  # share of the final stress above which a jump of the solution counts as a wave
SINCE = 0.45  # share of the run after which the waves are apart


def planar_compaction(run):
    """Speed of each wave, stress behind each, filling factor behind the front, and the profile.

    A speed is the slope of the position of half the jump over time, since the waves are apart: how
    far a wave has come also depends on how long it was part of another one. The stress behind a
    wave is the mean over the middle of its plateau, where neither end is smeared.
    """
    m, speed = numbers_of(run), 1.0
    flux, stress, density = closed_forms.riemann(m, speed)
    below = np.append(0.0, stress[:-1])
    waves = np.flatnonzero(stress - below > LEAST * stress[-1])
    frames = [read_particles(run, k) for k in range(run.snapshots.sizes["snapshot"])]
    first, last = frames[0], frames[-1]
    late = [frame for frame in frames if frame.time > SINCE * last.time]
    profiles = [rows_of_dust(first, f, f.pressure - f.deviator[:, 2]) for f in late]
    depth, axial = profiles[-1]
    _, phi = rows_of_dust(first, last, last.density / m.rho_s)
    reach = flux * last.time / m.rho_i

    def exact(x):
        """Axial stress at depths x; waves are in falling order of their reach."""
        return np.append(0.0, stress)[np.searchsorted(-reach, -x, side="right")]

    rows, ends = [], np.append(reach[waves], 0.0)
    for name, wave in zip(WAVES, waves, strict=True):
        level = 0.5 * (below[wave] + stress[wave])
        at = [crossing(*measured, level) for measured in profiles]
        slope = np.polyfit([frame.time for frame in late], at, 1)[0]
        rows.append(Row(f"speed of the {name}", "m/s", flux[wave] / m.rho_i, slope))
    for name, high, low in zip(WAVES, ends, ends[1:], strict=False):
        clear = (depth > low + 0.3 * (high - low)) & (depth < high - 0.3 * (high - low))
        rows.append(Row(f"axial stress behind the {name}", "Pa", exact(depth[clear]).mean(),
                        axial[clear].mean()))  # fmt: skip
    rows.append(Row("filling factor behind the front", "1", density[-1] / m.rho_s,
                    phi[clear].mean()))  # fmt: skip
    x = np.linspace(0.0, 1.2 * reach[0], 2000)
    seen, loaded = axial > 1e-2 * stress[0], x < reach[0]
    measured = 1e3 * depth[seen], axial[seen]
    expected = 1e3 * x[loaded], exact(x)[loaded]
    return rows, Curves(measured, expected, "initial depth (mm)", "axial stress (Pa)", decades=True)


def rows_of_dust(first, frame, values):
    """(initial depths [m], means of values) of the rows in which the particles are at first."""
    depth, rows = np.unique(np.round(-first.position[:, 2] / first.spacing, 6), return_inverse=True)
    return depth * first.spacing, np.bincount(rows, values) / np.bincount(rows)


def crossing(depth, values, level):
    """The largest depth [m] at which values exceed a level, linearly between rows."""
    k = int(np.flatnonzero(values > level).max())
    fraction = (values[k] - level) / (values[k] - values[k + 1])
    return depth[k] + fraction * (depth[k + 1] - depth[k])


# -- one point of dust -----------------------------------------------------------------------------


def single_point(run):
    """Axial stress on the way of one point, modulus of unloading, what is left, tension."""
    m, series = numbers_of(run), run.whole.series
    phi = m.rho_i / m.rho_s * series.height.values[0] / series.height.values
    axial = series.pressure.sel(wall=["bottom", "top"]).mean("wall").values
    stage = series.stage.values
    pressed, slowly, released, _, on, slowly_on, pulled = (stage == k for k in range(7))

    def mean_stress_near(phi_wanted, inside):
        near = inside & (np.abs(phi - phi_wanted) < 0.006)
        return strength.compute_confined(phi[near], m).mean(), axial[near].mean()

    start, end = (float(phi[inside][-1]) for inside in (slowly, slowly_on))
    form = closed_forms.unload_confined(start, m)
    # over the elastic part, from four fifths to a fifth of the stress at its start
    top = strength.compute_confined(start, m)
    slope = released & (axial < 0.8 * top) & (axial > 0.2 * top)
    modulus = np.polyfit(np.log(phi[slope]), axial[slope], 1)[0]
    zero = np.interp(0.0, -axial[released], phi[released])
    rows = [
        Row("axial stress at 0.20", "Pa", *mean_stress_near(0.20, pressed)),
        Row("axial stress at 0.25", "Pa", *mean_stress_near(0.25, pressed)),
        Row("modulus of unloading at 0.30", "MPa", 1e-6 * form.modulus, 1e-6 * modulus),
        Row("filling factor less that without axial stress", "1e-5", 1e5 * (start - form.released),
            1e5 * (start - zero)),
        Row("axial stress at 0.33, after reloading", "Pa", *mean_stress_near(0.33, on)),
        Row("largest tension when pulled", "Pa", closed_forms.unload_confined(end, m).tension,
            -axial[pulled].min()),
    ]  # fmt: skip
    point = [MaterialPoint.make_unstressed(m)]
    for previous_phi, next_phi in zip(phi, phi[1:], strict=False):
        point.append(point[-1].apply_strain((0.0, 0.0, np.log(previous_phi / next_phi))))
    exact = phi, np.array([-float(state.stress[2]) for state in point])
    return rows, Curves((phi, axial), exact, "filling factor", "axial stress (Pa)")


# -- Verney's shell --------------------------------------------------------------------------------


def verney_shell(run):
    """Inner radius at which the shell stops, and the way to it."""
    m, body = numbers_of(run), load(CONFIGS / "verney_shell.yaml").sample
    inner, outer, speed = 0.5 * body.hole, 0.5 * body.diameter, -body.radial_velocity
    Y = float(strength.shear(m.rho_i / m.rho_s, m))
    frames = [read_particles(run, k) for k in range(run.snapshots.sizes["snapshot"])]
    # no volume changes: the radius of the inner surface follows from the mean square of the radius
    square = np.array([np.average((f.position**2).sum(axis=1), weights=f.mass) for f in frames])
    radius = np.sqrt(inner**2 + square - square[0])
    t = np.array([frame.time for frame in frames])
    stop = closed_forms.verney(inner, outer, speed, m.rho_i, Y)
    first_at_rest = np.argmin(radius)  # then it swings by some elastic strains
    change = frames[-1].density / m.rho_i - 1.0
    losses = compute_ledger(run).shares
    rows = [
        Row("inner radius at rest", "mm", 1e3 * stop, 1e3 * radius[first_at_rest:].mean()),
        Row("way of the inner surface", "mm", 1e3 * (inner - stop),
            1e3 * (inner - radius[first_at_rest:].mean())),
        Row("energy taken by shear", "1", 1.0, losses["shear"]),
        Row("change of density, rms", "1", 0.0, np.sqrt((change**2).mean())),
    ]  # fmt: skip
    way = 1e3 * t, np.array([1e3 * r for r in closed_forms.verney_radii(t, inner, outer, speed,
                                                                      m.rho_i, Y)])  # fmt: skip
    return rows, Curves((1e3 * t, 1e3 * radius), way, "time (ms)", "inner radius (mm)")


# -- oscillating plate -----------------------------------------------------------------------------


def oscillating_plate(run):
    """Period, sag and damping of a plate that is clamped at one end."""
    series, body = run.whole.series, load(CONFIGS / "oscillating_plate.yaml").sample
    t, z = series.time.values, series.body_position.values[:, 0, 2]
    z = z - z[0]
    K, mu = body.bulk_modulus, body.shear_ratio * body.bulk_modulus
    gravity = float(run.attrs["gravity"])
    form = closed_forms.cantilever(*body.size, body.density, K, mu, gravity)

    def swing(time, sag, amplitude, rate, decay, phase):
        return -sag + amplitude * np.exp(-decay * time) * np.cos(rate * time + phase)

    guess = (form.sag, form.sag, 2.0 * np.pi / form.period, 0.0, 0.0)
    (sag, _, rate, decay, _), _ = curve_fit(swing, t, z, guess)
    period = 2.0 * np.pi / rate
    rows = [
        Row("period", "ms", 1e3 * form.period, 1e3 * period),
        Row("sag of its middle of mass", "um", 1e6 * form.sag, 1e6 * sag),
        Row("amplitude after a period", "1", 1.0, np.exp(-decay * period)),
    ]  # fmt: skip
    exact = 1e3 * t, -1e6 * form.sag * (1.0 - np.cos(2.0 * np.pi * t / form.period))
    return rows, Curves((1e3 * t, 1e6 * z), exact, "time (ms)", "middle of mass (µm)")


# -- diametral compression -------------------------------------------------------------------------


def diametral_compression(run):
    """Tension in the middle of a disc, for its load as it is distributed and for Hertz's contact;
    width of that load. Means over the second half of the rest.

    The mean square distance of the load from the axis follows from the stress: in equilibrium the
    integral of sigma_zz x^2 + 2 x z sigma_xz over the disc is that of the traction x^2 z t_z over
    its rim, with z = +-H/2 where the plates are, and that of sigma_zz is -P H.
    """
    series, body = run.whole.series, load(CONFIGS / "diametral_compression.yaml").sample
    K, mu, D = body.bulk_modulus, body.shear_ratio * body.bulk_modulus, body.diameter
    frames = [read_particles(run, k) for k in range(1, run.snapshots.sizes["snapshot"])]
    both = np.abs(series.wall_force.sel(wall=["bottom", "top"], xyz="z")).mean("wall").values
    P = np.interp([frame.time for frame in frames], series.time.values, both)
    tension, squares = np.array([disc_state(frame, D) for frame in frames]).T
    is_at_rest = np.array([frame.time for frame in frames]) > series.time.values[-1] - RESTS
    force, mean_tension, square = (values[is_at_rest].mean() for values in (P, tension, squares))
    hertz = closed_forms.hertz_half_width(P, 0.5 * D, K, mu)
    width = closed_forms.hertz_half_width(force, 0.5 * D, K, mu)
    of_load, of_hertz = (closed_forms.brazilian(force, D, s) for s in (square, 0.25 * width**2))
    rows = [
        Row(
            "tension in the middle, load as distributed", "kPa", 1e-3 * of_load, 1e-3 * mean_tension
        ),
        Row("tension in the middle, contact of Hertz", "kPa", 1e-3 * of_hertz, 1e-3 * mean_tension),
        Row("half width of the contact", "mm", 1e3 * width, 2e3 * np.sqrt(square)),
    ]
    exact = P, 1e-3 * closed_forms.brazilian(P, D, 0.25 * hertz**2)
    order = np.argsort(P)
    return rows, Curves((P, 1e-3 * tension), tuple(values[order] for values in exact),
                        "force (N/m)", "tension in the middle (kPa)")  # fmt: skip


def disc_state(frame, diameter):
    """(tension [Pa] in the middle of a disc, mean square distance of its load from the axis [m^2]).

    The tension is that of an even polynomial of fourth order, fitted within MIDDLE of the diameter.
    """
    position = frame.position - np.average(frame.position, axis=0, weights=frame.mass)
    x, z, volume = position[:, 0], position[:, 2], frame.mass / frame.density
    xx, zz = frame.deviator[:, 0] - frame.pressure, frame.deviator[:, 2] - frame.pressure
    near = np.hypot(x, z) < MIDDLE * diameter
    a, b = (x[near] / diameter) ** 2, (z[near] / diameter) ** 2
    terms = np.stack([np.ones(len(a)), a, b, a * a, a * b, b * b], axis=1)
    moment = volume @ (zz * x**2 + 2.0 * x * z * frame.deviator[:, 4])
    return np.linalg.lstsq(terms, xx[near], rcond=None)[0][0], moment / (volume @ zz)


RESTS = 3e-3  # [s] at the end of the run over which the means are taken
MIDDLE = 0.15


# -- rotating block --------------------------------------------------------------------------------


def rotating_block(run):
    """Angular momentum, energy and angle after five turns."""
    series = run.whole.series
    t, L = series.time.values, series.angular_momentum.values[:, 1]
    energy = (series.kinetic + series.elastic_energy).values
    first, last = read_particles(run, 0), read_particles(run, -1)
    a, b = (frame.position[:, [0, 2]] for frame in (first, last))
    # best rotation between both, in the plane
    turned = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    # the block is larger while it turns: its moment of inertia over that of the start
    spin = series.body_spin.values[:, 0, 1]
    angle = -np.sum(0.5 * (spin[1:] + spin[:-1]) * np.diff(t))
    expected = (angle + np.pi) % (2.0 * np.pi) - np.pi
    rows = [
        Row("angular momentum over that of the start", "1", 1.0, L[-1] / L[0]),
        Row("energy likewise", "1", 1.0, energy[-1] / energy[0]),
        Row("turns", "1", angle / (2.0 * np.pi),
            (angle + (turned - expected + np.pi) % (2.0 * np.pi) - np.pi) / (2.0 * np.pi)),
        Row("scatter of the density", "1", 0.0, last.density.std() / last.density.mean()),
    ]  # fmt: skip
    return rows, Curves((1e3 * t, energy / energy[0]), (1e3 * t, 0.0 * t + 1.0), "time (ms)",
                        "energy over that of the start")  # fmt: skip


# -- all of them -----------------------------------------------------------------------------------

BENCHMARKS = {
    "planar_compaction": (planar_compaction, ({}, {"numerics.spacing": "50 um"})),
    "single_point": (single_point, ({"numerics.spacing": "133 um"}, {})),
    "verney_shell": (verney_shell, ({"numerics.spacing": "0.333 mm"}, {})),
    "oscillating_plate": (oscillating_plate, ({"numerics.spacing": "0.143 mm"}, {})),
    "diametral_compression": (diametral_compression, ({"numerics.spacing": "0.333 mm"}, {})),
    "rotating_block": (rotating_block, ({}, {"numerics.spacing": "0.05 mm"})),
}
"""Name of the config: the function that reads its run, and what is changed for each resolution."""


def numbers_of(run):
    """MaterialNumbers of the material of a Run."""
    return MaterialNumbers.from_material(
        ContinuumMaterial.model_validate(dict(run.scene["material"]))
    )


def scene_of(name, resolution):
    """The Scene of a benchmark at a resolution, 0 or 1."""
    return load(CONFIGS / f"{name}.yaml").with_values(BENCHMARKS[name][1][resolution])


def run_benchmark(name, resolution, folder):
    """(rows, Curves, worst residual of the ledger) of a benchmark at a resolution, 0 or 1."""
    scene = scene_of(name, resolution)
    run = analysis.open_run(execute(scene, Path(folder) / f"{name}_{resolution}", force=True))
    rows, curves = BENCHMARKS[name][0](run)
    return rows, curves, float(np.abs(run.series.energy_residual_relative).max())


@style.apply_style
def figure_of(curves):
    """The curves of a benchmark."""
    figure, (axes,) = style.create_figure(height=2.8)
    axes.plot(*curves.exact, color=style.BLACK, linewidth=1.0, label="closed form")
    axes.plot(*curves.measured, linestyle="none", marker=".", markersize=2.5, label="run")
    if curves.decades:
        axes.set_yscale("log")
    axes.set_xlabel(curves.x)
    axes.set_ylabel(curves.y)
    style.draw_legend(axes)
    return figure


def rows_of(name, folder):
    """Lines of the table of a benchmark at both resolutions; its figure is saved."""
    (coarse, _, open_1), (fine, curves, open_2) = (
        run_benchmark(name, resolution, folder) for resolution in (0, 1)
    )
    plots.save(figure_of(curves), HERE / f"figures/benchmark_{name}.png")
    pairs = [*zip(coarse, fine, strict=True)]
    pairs.append((Row("ledger open by", "1", 0.0, open_1), Row("", "", 0.0, open_2)))
    ratio = np.divide(*(scene_of(name, k).numerics.spacing for k in (0, 1)))
    return [
        [name, coarse_row.quantity, coarse_row.unit]
        + [
            f"{v:.5g}"
            for v in (
                coarse_row.expected,
                coarse_row.measured,
                fine_row.expected,
                fine_row.measured,
            )
        ]
        + [verdict(deviation(coarse_row), deviation(fine_row), ratio)]
        for coarse_row, fine_row in pairs
    ]


NEAR = 0.02
"""Deviation from the closed form below which a row agrees."""


def deviation(row):
    """Relative to the expected value; absolute where that is 0."""
    return (row.measured - row.expected) / (abs(row.expected) or 1.0)


def verdict(coarse, fine, ratio):
    """Verdict on a row from its deviations at two spacings of that ratio.

    "agrees": within NEAR at the finer one. "converges": not so, but at least of first order.
    "differs": neither.
    """
    if abs(fine) <= NEAR:
        return "agrees"
    return "converges" if abs(coarse) >= ratio * abs(fine) else "differs"


if __name__ == "__main__":
    update("benchmarks_continuum.csv", BENCHMARKS, rows_of)
