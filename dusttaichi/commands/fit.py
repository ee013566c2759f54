"""`dust fit`: numbers of the model from measurements."""

from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import say, say_table
from dusttaichi.commands.study_command import study_command
from dusttaichi.errors import DustError

TARGETS = ("continuum",)


@study_command(
    omit="resume part output threads jobs scheduler extensions figures quiet",
    force=(options.Overwrite, False),
)
def fit(
    target: Annotated[str, typer.Argument(help=" or ".join(TARGETS), metavar="WHAT")],
    runs: Annotated[
        list[Path] | None, typer.Argument(help="grain runs, or folders of them")
    ] = None,
    *,
    output: Annotated[Path, typer.Option("--output", "-o", help="file of the material")] = Path(
        "dust.yaml"
    ),
    phi_2: Annotated[
        float, typer.Option("--phi-2", help="filling factor of infinite strength")
    ] = 0.58,
    rate: Annotated[
        float | None,
        typer.Option(help="strain rate of the fitted compression [1/s]", metavar="RATE"),
    ] = None,
    run,
):
    """Fit numbers of the model.

    `continuum`: a material of the continuum, to grain runs with compression, partial unloading and
    tension; configs/continuum_calibration has scenes.
    """
    if target not in TARGETS:
        raise DustError(
            f"fit {target}: there is no fit of that name; allowed: {', '.join(TARGETS)}"
        )
    with run.writing(*(runs or [])):
        _continuum(runs or [], output, phi_2, rate, run)


def _continuum(runs, output, phi_2, rate, run):
    from dusttaichi.continuum.analysis import fit_tables as tables

    if output.suffix not in (".yaml", ".yml"):
        raise DustError(f"--output = {output}: a file name that ends in .yaml is needed")
    if not 0.2 < phi_2 < 0.75:
        raise DustError(f"--phi-2 = {phi_2:g}: a number above 0.2 and below 0.75 is needed")
    material_fit = tables.fit_runs(runs, phi_2, rate)
    paths = write(material_fit, output)
    run.say_result(tables.numbers(material_fit), lambda: _show(material_fit), paths)


def write(fit, path):
    """Write material, figures and tables of a continuum_fit.Fit; returns the paths.

    Raises DustError.
    """
    from dusttaichi.continuum.analysis import fit_tables as tables
    from dusttaichi.continuum.analysis.observations import curves
    from dusttaichi.continuum.plots.fitted_material import continuum_fit, pressing_speeds
    from dusttaichi.plots import save
    from dusttaichi.results import outputs

    speeds_path = path.with_name(f"{path.stem}_speeds")
    texts = {path: tables.material_text(fit, path.stem)}
    texts[path.with_suffix(".csv")] = tables.observations_csv(fit)
    texts[speeds_path.with_suffix(".csv")] = tables.curves_csv(fit)
    for file, text in texts.items():
        outputs.write(file, text, text.partition("\n")[0])
    figures = {path: continuum_fit(fit), speeds_path: pressing_speeds(curves(fit.tests))}
    return [*texts, *(save(figure, file.with_suffix(".png")) for file, figure in figures.items())]


def _show(fit):
    from dusttaichi.continuum.analysis import fit_tables as tables

    headings, title = ("number", "value", "spread of the seeds", "unit"), "Material, fitted in 3-D"
    say_table(tables.numbers_table(fit), *headings, title=title)
    headings = ("measured", "points", "deviation")
    say_table(tables.deviations_table(fit), *headings, title="\nMaterial against grains")
    headings = ("rate [1/s]", "grains", "runs", "axial [kPa]", "pressure [kPa]")
    title = "\np_m of G09's law (laboratory 13 kPa, bead 1.3 kPa)"
    say_table(tables.speeds_table(fit), *headings, title=title)
    say()
