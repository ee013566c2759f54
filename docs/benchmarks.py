"""Benchmarks of the continuum: `python docs/benchmarks.py [NAME ...]` runs them at two resolutions.

Each is a scene of configs/continuum/benchmarks with a closed form. What is found beside what is
expected goes to docs/validation/benchmarks_continuum.csv, the curves of the finer run to
docs/figures/benchmark_NAME.png.
"""

import csv
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dusttaichi import analysis, plots
from dusttaichi.analysis.continuum import read_particles
from dusttaichi.physics.continuum.numbers import MaterialNumbers
from dusttaichi.physics.continuum.point import MaterialPoint
from dusttaichi.plots import style
from dusttaichi.run import execute
from dusttaichi.scene import load
from dusttaichi.scene.continuum_material import ContinuumMaterial

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "configs/continuum/benchmarks"
TABLE, FIGURES = "validation/benchmarks_continuum.csv", "figures"


class Row(NamedTuple):
    """A quantity of a benchmark: what is expected, and what a run has."""

    what: str
    unit: str
    expected: float
    found: float


class Curves(NamedTuple):
    """What the figure of a benchmark shows: (x, y) of a run as points, and of the closed form."""

    found: tuple
    exact: tuple
    x: str
    y: str
    decades: bool = False


# -- planar compaction -----------------------------------------------------------------------------


def riemann(m, speed, states=4000):
    """Waves ahead of a piston at a speed [m/s] in dust at rest of the MaterialNumbers m.

    (mass per area and time [kg/(m^2 s)], axial stress [Pa], density [kg/m^3]): of each wave, the
    fastest first, and of the dust behind it. Stress over specific volume is the path of a point
    that is pressed along one axis; where it is concave a wave spreads, where it is convex there is
    a shock, whose chord takes the place of the path: so the waves are the upper concave hull.
    """
    rest = MaterialPoint.at(m)
    path = [rest, *rest.to_density(1.01 * m.rho_i, states)]  # dust yields at strains of 1e-4
    path += path[-1].to_density(0.99 * m.phi_cap * m.rho_s, states)
    volume = np.array([1.0 / float(state.density) for state in path])
    stress = np.array([-float(state.stress[2]) for state in path])

    def hull(end):
        out = [0]
        for k in range(1, end + 1):
            while len(out) > 1 and slope(out[-2], out[-1]) < slope(out[-1], k):
                out.pop()
            out.append(k)
        return np.array(out)

    def slope(a, b):
        return (stress[b] - stress[a]) / (volume[a] - volume[b])

    def moved(end):
        at = hull(end)
        return np.sqrt(np.diff(stress[at]) * -np.diff(volume[at])).sum()

    low, high = 1, 2 * states
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if moved(middle) < speed else (low, middle)
    at = hull(high)
    flux = np.sqrt(np.diff(stress[at]) / -np.diff(volume[at]))
    return flux, stress[at[1:]], 1.0 / volume[at[1:]]


def planar_compaction(run):
    """Depth of the precursor and of the front, stress and density behind it, and the profile."""
    m, speed = numbers_of(run), 1.0
    flux, stress, density = riemann(m, speed)
    first, last = read_particles(run, 0), read_particles(run, -1)
    depth = -first.position[:, 2]
    order = np.argsort(depth, kind="stable")
    # rows of one height are one point of the profile
    depth, rows = np.unique(np.round(depth[order] / first.spacing, 6), return_inverse=True)
    depth = depth * first.spacing
    count = np.bincount(rows)

    def profile(values):
        return np.bincount(rows, values[order]) / count

    axial = profile(last.pressure - last.deviator[:, 2])
    phi = profile(last.density) / m.rho_s
    reach = flux * last.time / m.rho_i

    def exact(x, values, ahead):
        """Values behind the waves at depths x; waves are in order of their reach, falling."""
        behind = np.searchsorted(-reach, -x, side="right")
        return np.append(ahead, values)[behind]

    jump = int(np.argmax(np.diff(np.append(m.rho_i, density))))
    middle = 0.5 * (density[-1] + np.append(m.rho_i, density)[jump]) / m.rho_s
    near = reach[jump]
    behind = (depth > 4 * first.spacing) & (depth < 0.7 * near)
    rows = [
        Row("depth of the precursor", "mm", 1e3 * reach[0],
            1e3 * crossing(depth, axial, 0.5 * stress[0])),
        Row("depth of the front", "mm", 1e3 * near, 1e3 * crossing(depth, phi, middle)),
        Row("axial stress behind it", "Pa", stress[-1], axial[behind].mean()),
        Row("filling factor behind it", "1", density[-1] / m.rho_s, phi[behind].mean()),
        Row("stress between both", "Pa",
            *between(depth, axial, lambda x: exact(x, stress, 0.0), (near, reach[0]))),
    ]  # fmt: skip
    x = np.linspace(0.0, 1.2 * reach[0], 2000)
    seen, loaded = axial > 1e-2 * stress[0], x < reach[0]
    found = 1e3 * depth[seen], axial[seen]
    known = 1e3 * x[loaded], exact(x, stress, 0.0)[loaded]
    curves = Curves(found, known, "initial depth (mm)", "axial stress (Pa)", decades=True)
    return rows, curves


def between(depth, values, exact, ends):
    """Mean of the closed form and of the run between front and precursor, where both are clear."""
    low, high = ends
    inside = (depth > low + 0.25 * (high - low)) & (depth < high - 0.25 * (high - low))
    return exact(depth[inside]).mean(), values[inside].mean()


def crossing(depth, values, level):
    """The largest depth [m] at which values exceed a level, linearly between rows."""
    k = int(np.flatnonzero(values > level).max())
    share = (values[k] - level) / (values[k] - values[k + 1])
    return depth[k] + share * (depth[k + 1] - depth[k])


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
    "rotating_block": (rotating_block, ({}, {"numerics.spacing": "0.05 mm"})),
}
"""Name of the config: the function that reads its run, and what is changed for each resolution."""


def numbers_of(run):
    """MaterialNumbers of the material of a Run."""
    return MaterialNumbers.of(ContinuumMaterial.model_validate(dict(run.scene["material"])))


def carried_out(name, resolution, folder):
    """(rows, Curves, worst residual of the ledger) of a benchmark at a resolution, 0 or 1."""
    read, changes = BENCHMARKS[name]
    scene = load(CONFIGS / f"{name}.yaml")
    for key, value in changes[resolution].items():
        scene = scene.with_value(key, value)
    run = analysis.open_run(execute(scene, Path(folder) / f"{name}_{resolution}", force=True))
    rows, curves = read(run)
    return rows, curves, float(np.abs(run.series.energy_residual_relative).max())


@style.styled
def figure_of(own):
    """The curves of a benchmark."""
    figure, (axes,) = style.new_figure(height=2.8)
    axes.plot(*own.exact, color=style.BLACK, linewidth=1.0, label="closed form")
    axes.plot(*own.found, linestyle="none", marker=".", markersize=2.5, label="run")
    if own.decades:
        axes.set_yscale("log")
    axes.set_xlabel(own.x)
    axes.set_ylabel(own.y)
    style.legend(axes)
    return figure


def rows_of(name, folder):
    """Lines of the table of a benchmark at both resolutions; its figure is saved."""
    (coarse, _, open_1), (fine, curves, open_2) = (
        carried_out(name, resolution, folder) for resolution in (0, 1)
    )
    plots.save(figure_of(curves), HERE / FIGURES / f"benchmark_{name}.png")
    pairs = [*zip(coarse, fine, strict=True)]
    pairs.append((Row("ledger open by", "1", 0.0, open_1), Row("", "", 0.0, open_2)))
    return [
        [name, one.what, one.unit]
        + [f"{v:.5g}" for v in (one.expected, one.found, other.expected, other.found)]
        for one, other in pairs
    ]


HEAD = ["benchmark", "quantity", "unit", "expected", "coarse", "expected, fine", "fine"]


def main(names):
    """Entry point: rows of other benchmarks stay in the table as they are."""
    path, table = HERE / TABLE, {}
    if path.exists():
        with open(path, newline="", encoding="utf-8") as file:
            for row in list(csv.reader(file))[1:]:
                table.setdefault(row[0], []).append(row)
    with tempfile.TemporaryDirectory() as folder:
        for name in names or BENCHMARKS:
            table[name] = rows_of(name, folder)
            print(*(" | ".join(row) for row in table[name]), sep="\n", flush=True)
            with open(path, "w", newline="", encoding="utf-8") as file:
                rows = [row for key in BENCHMARKS if key in table for row in table[key]]
                csv.writer(file, lineterminator="\n").writerows([HEAD, *rows])


if __name__ == "__main__":
    main(sys.argv[1:])
