"""Commands on results: `dust plot`, `compare`, `export` and `render`."""

from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import (
    remark,
    say,
    say_abreast,
    say_json,
    say_not_drawn,
    say_table,
    say_written,
)
from dusttaichi.errors import DustError

ABREAST = 11  # largest number of columns of numbers on a terminal
FORMATS = ("png", "pdf", "svg")


def _say_side_by_side(columns):
    """Print the table of `compare`: a line for each run, or for each of many numbers."""
    (heading, names), *numbers = columns
    if len(columns) > ABREAST >= len(names):
        say_table([(number, *texts) for number, texts in numbers], heading, *names)
    else:
        say_abreast(columns[:1], numbers)


def plot(
    runs: options.RunPaths,
    *,
    output: options.output_option("directory of the figures") = None,
    style: Annotated[str, typer.Option(help="page, column (of a journal, 88 mm) or talk")] = "page",
    file_format: Annotated[str, typer.Option("--format", help="png, pdf or svg")] = "png",
    extension: options.ExtensionFiles = None,
    force: options.Overwrite = False,
):
    """Draw figures of a run; several share each figure.

    Curves, stress, profile, energy.
    """
    from dusttaichi.plots.style import use_style

    if file_format not in FORMATS:
        raise DustError(f"--format {file_format}; allowed: {', '.join(FORMATS)}.")
    options.import_files(extension)
    with use_style(style), options.writing(force=force, inputs=runs):
        _plot(runs, output, f".{file_format}")


def _plot(runs, output, suffix):
    from dusttaichi import analysis, plots

    failed = []
    study = analysis.find_study(runs[0]) if len(runs) == 1 else None
    if study is not None:
        data, file = analysis.open_study(runs[0], study)
        options.remark_missing([data.attrs])
        folder = output or file.parent
    if study == "ensemble":
        say_written(plots.save_figures(data, folder, suffix, failed))
        return say_not_drawn(failed)
    if study is not None:
        figures = _draw_study(data, study)
        paths = [plots.save(figure, folder / f"{name}{suffix}") for name, figure in figures.items()]
        return say_written(paths)
    with options.open_runs(runs) as results:
        folder = Path(".")
        if len(results) == 1:
            (results,), folder = results, options.folder_of(runs[0])
        say_written(plots.save_figures(results, output or folder, suffix, failed))
    say_not_drawn(failed)


def _draw_study(data, study):
    """Name -> figure of a dataset of a study without runs of a common table."""
    from dusttaichi import plots

    if study == "collisions":
        return plots.collision_figures(data)
    draw = {"trade": plots.trade, "restitution_map": plots.restitution_map}[study]
    return {study.removesuffix("_map"): draw(data)}


def compare(
    runs: options.RunPaths,
    *,
    output: options.output_option("CSV file of all numbers") = None,
    figures: Annotated[
        Path | None, typer.Option(help="directory of common figures", metavar="DIR")
    ] = None,
    as_json: options.Json = False,
    extension: options.ExtensionFiles = None,
    force: options.Overwrite = False,
):
    """Compare runs: a table of all their numbers, side by side."""
    from dusttaichi import analysis
    from dusttaichi.analysis.kind import warn_of_mixed_drafts
    from dusttaichi.analysis.outcome import format_definition_line
    from dusttaichi.analysis.plain import convert_runs
    from dusttaichi.analysis.summary import format_columns, has_fit_error

    options.import_files(extension)
    with options.writing(force=force, inputs=runs), options.open_runs(runs) as results:
        rows = analysis.compare(results)
        if text := warn_of_mixed_drafts(results):
            remark(f"warning: {text}")
        failed, drawn = [], []
        if figures is not None:
            from dusttaichi import plots  # with matplotlib, which the table does not wait for

            drawn = plots.save_figures(results, figures, failed=failed)
        if as_json:
            say_json(convert_runs(results))
        else:
            table = format_columns(rows)
            _say_side_by_side(table)
            if line := format_definition_line(heading for heading, _ in table):
                say(line)
            if any(map(has_fit_error, rows)):
                say("±: one sample each, fit error only; replicas show the scatter between samples")
        for row in rows:
            for title, reason in row["problems"]:
                remark(f"{row['name']}: not computed: {title}: {reason}")
        if output is not None:
            analysis.to_csv(rows, output)
            drawn = [output, *drawn]
    say_written(drawn, remark if as_json else say)
    say_not_drawn(failed)


def export(
    run: options.RunPath,
    to: Annotated[str, typer.Option(help="vtk, extxyz, lammps, lammps-data or lammps-restart")],
    output: options.output_option("directory of the files") = None,
    snapshot: Annotated[str, typer.Option(help="number, from the end if negative, or all")] = "all",
    force: options.Overwrite = False,
):
    """Export snapshots to ParaView, OVITO, ASE or LAMMPS."""
    from dusttaichi import analysis
    from dusttaichi.export import export as write

    number = snapshot if snapshot == "all" else _whole("--snapshot", snapshot, " or all")
    with options.writing(force=force, inputs=[run]), analysis.open_run(run) as result:
        paths = write(result, to, output, number)
    say(f"wrote {paths[0]}{f' and {len(paths) - 1} more' if len(paths) > 1 else ''}")


def _whole(option, text, otherwise=""):
    try:
        return int(text)
    except ValueError:
        raise DustError(f"{option}: {text}; allowed: a whole number{otherwise}.") from None


def render(
    run: options.RunPath,
    *,
    snapshot: Annotated[int, typer.Option(help="number, from the end if negative")] = -1,
    color: Annotated[
        str | None,
        typer.Option(
            help="coordination, speed, height, fragment, body or uniform; of a continuum "
            "filling_factor, pressure or speed"
        ),
    ] = None,
    view: Annotated[
        str, typer.Option(help="oblique, front, side, top, bottom or direction x,y,z of the camera")
    ] = "oblique",
    output: options.output_option("file: .png, .pdf; .gif, .mp4") = None,
    animate: options.flag("--animate", "a film of all snapshots") = False,
    rate: Annotated[
        float | None, typer.Option(min=0.5, max=60.0, help="frames per second of a film")
    ] = None,
    dpi: Annotated[
        int | None, typer.Option(min=30, max=1200, help="pixels per inch, at a width of six inches")
    ] = None,
    force: options.Overwrite = False,
):
    """Draw a picture or a film of snapshots.

    The grains, or the dust, of one snapshot; --animate makes a film of all.
    """
    from dusttaichi import analysis, plots
    from dusttaichi.plots.figure_registry import picture_of

    with options.writing(force=force, inputs=[run]), analysis.open_run(run) as result:
        picture = picture_of(result)
        path = output or options.folder_of(run) / f"{picture.name}.{'gif' if animate else 'png'}"
        sharp = {} if dpi is None else {"dpi": dpi}
        if animate:
            plots.animation(result, path, color, view, rate=rate, **sharp)
        else:
            plots.save(picture.draw(result, snapshot, color, view, **sharp), path)
    say_written([path])
