"""Tables and figures of the tests under load: `python docs/load_tables.py TABLE STUDY...`.

TABLE is `steps`, `direct_shear`, `shear` or `triaxial`; STUDY a directory of `dust sweep` over
`sample.seed` of the scene of that name in configs/loads, for `steps` those of load_steps.yaml and
constant_speed.yaml. It prints the table in Markdown: means and standard deviations between samples;
for shear and triaxial tests also the line of friction and the worst residual of the ledger. The
figure of these samples goes to docs/figures.
"""

import sys
from pathlib import Path

import numpy as np
from tables import markdown

from dusttaichi import analysis, plots
from dusttaichi.analysis.cycles import compute_pressure
from dusttaichi.analysis.loads import LAST

FIGURES = Path(__file__).parent / "figures"
SCENES = {"steps": "load_steps"}


def open_samples(study):
    """Runs of the samples of a sweep, in the order of their seeds."""
    folders = sorted(Path(study).glob("sample.seed=*"), key=lambda path: int(path.name[12:]))
    return [analysis.open_run(folder) for folder in folders]


def format_mean(values, digits=3, scale=1.0):
    """Mean and standard deviation of the values of the samples, as a text."""
    values = np.asarray(values, dtype=float) / scale
    return f"{values.mean():.{digits}f} ± {values.std(ddof=1):.{digits}f}"


def filling_factor_at(run, pressure):
    """Filling factor at which the mean pressure of LAST records first reaches `pressure` [Pa]."""
    window = np.ones(LAST) / LAST
    pressures = np.convolve(compute_pressure(run.series), window, "valid")
    phi = np.convolve(run.series.filling_factor.values, window, "valid")
    return float(phi[np.argmax(pressures >= pressure)])


def tabulate_steps(stepped, constant):
    """Rows of the load steps beside a constant speed."""
    controls = [analysis.measure_load_control(run) for run in stepped]
    for number, loads in enumerate(
        zip(*(analysis.measure_controlled_loads(run) for run in stepped), strict=True)
    ):
        prescribed = loads[0].prescribed
        reached = [run.stage(loads[0].stage).start.filling_factor.item() for run in stepped]
        settled = np.array([load.filling_factor for load in loads])
        at_speed = np.array([filling_factor_at(run, prescribed) for run in constant])
        yield {
            "load": f"{prescribed / 1e3:g} kPa",
            "pressure, mean of ten records": format_mean([v.pressure for v in loads], 2, 1e3),
            "share of time missed by 5 %": ", ".join(
                f"{control[number].missed_share:.0%}".replace("%", " %") for control in controls
            ),
            "filling factor when reached": format_mean(reached),
            "after 12 µs": format_mean(settled),
            "at constant speed": format_mean(at_speed),
            "difference": format_mean(settled - at_speed, 4),
        }


def tabulate_tests(samples, load, strength):
    """Rows of shear or triaxial tests; load, strength: names of these columns."""
    for tests in zip(*samples, strict=True):
        yield {
            "prescribed": f"{tests[0].prescribed / 1e3:g} kPa",
            load: format_mean([test.load for test in tests], 3, 1e3) + " kPa",
            "filling factor": format_mean([test.density for test in tests]),
            strength: format_mean([test.strength for test in tests], 2, 1e3) + " kPa",
        }


def print_friction(samples, is_triaxial=False):
    """Print the line of friction of all samples, and the angle of each."""
    for number, tests in enumerate([[test for sample in samples for test in sample], *samples]):
        fit = analysis.fit_friction(tests)
        name = f"sample {number}" if number else "all samples"
        angle, sigma = fit.angle, fit.angle_sigma
        if is_triaxial:
            name += f", cohesion {fit.triaxial_cohesion / 1e3:.2f} kPa"
            angle, sigma = fit.triaxial_angle, fit.triaxial_angle_sigma
        print(
            f"{name}: friction angle {angle:.1f}° ± {sigma:.1f}°; slope {fit.slope:.3f} ± "
            f"{fit.slope_sigma:.3f}, intercept {fit.cohesion / 1e3:.2f} ± "
            f"{fit.cohesion_sigma / 1e3:.2f} kPa"
        )


def main(table, *studies):
    """Entry point: the table, the lines below it and the figure of these studies."""
    runs, *references = [open_samples(study) for study in studies]
    if table == "steps":
        rows = tabulate_steps(runs, references[0])
        figure = plots.loads(runs[0], [references[0][0]], repeats=runs[1:])
    elif table == "triaxial":
        samples = [analysis.measure_triaxial_tests(run) for run in runs]
        rows = tabulate_tests(samples, "confining stress, mean", "deviator")
        figure = plots.triaxial(runs[0], runs[1:])
    else:
        samples = [analysis.measure_shear_tests(run) for run in runs]
        rows = tabulate_tests(samples, "normal stress, mean", "shear strength")
        figure = plots.shear(runs[0], runs[1:])
    print(markdown(rows), end="")
    if table != "steps":
        print_friction(samples, table == "triaxial")
    residual = max(
        float(np.abs(run.series.energy_residual_relative).max())
        for run in [*runs, *sum(references, [])]
    )
    print(f"worst residual of a ledger {residual:.1e}")
    plots.save(figure, FIGURES / f"{SCENES.get(table, table)}.png")


if __name__ == "__main__":
    main(*sys.argv[1:])
