"""What is done with results: `dust plot`, `compare`, `export` and `render`."""

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from dusttaichi.commands.console import plain_table, remark, say, say_abreast, say_written
from dusttaichi.commands.options import Overwrite, RunPath, RunPaths, writing
from dusttaichi.errors import DustError

ABREAST = 11  # columns of numbers that a terminal has room for
FORMATS = ("png", "pdf", "svg")
COLUMNS = (  # heading, key of analysis.compare, shown as, unit; only what the runs have
    ("run", "name", "{}", 1),
    ("grains", "grains", "{:,}", 1),
    ("p_m kPa", "p_m", "{:.1f}", 1e3),
    ("± kPa", "p_m_sigma", "{:.1f}", 1e3),
    ("Delta", "delta", "{:.2f}", 1),
    ("±", "delta_sigma", "{:.2f}", 1),
    ("rms in phi", "rms", "{:.3f}", 1),
    ("mean in phi", "rms_mean", "{:+.3f}", 1),
    ("law covered", "rms_covered", "{:.2f}", 1),
    ("contacts/grain at 0.3", "contacts_per_grain_at_0.3", "{:.2f}", 1),
    ("contacts/grain at 0.45", "contacts_per_grain_at_0.45", "{:.2f}", 1),
    ("phi_init", "phi_init", "{:.3g}", 1),
    ("strength kPa", "strength", "{:.3g}", 1e3),
    ("± kPa", "strength_sigma", "{:.2g}", 1e3),
    ("strength at phi", "strength_phi", "{:.3g}", 1),
    ("T19 eq 33 kPa", "strength_law", "{:.3g}", 1e3),
    ("maximum passed", "strength_passed", "{!s}", 1),
    ("no strength", "strength_problem", "{}", 1),
    ("P/(E_roll/r^3 phi^3)", "ratio", "{:.2f}", 1),
    ("speed m/s", "speed", "{:.3g}", 1),
    ("outcome", "outcome", "{}", 1),
    ("fragments", "fragments", "{}", 1),
    ("largest fragment", "largest_share", "{:.3f}", 1),
    ("growth efficiency", "growth_efficiency", "{:.3f}", 1),
    ("restitution", "restitution", "{:.3f}", 1),
    ("sound m/s", "sound_speed", "{:.4g}", 1),
    ("± m/s", "sound_speed_sigma", "{:.1g}", 1),
    ("sphere depth um", "sphere_depth", "{:.4g}", 1e-6),
    ("sphere so far um", "sphere_largest_depth", "{:.4g}", 1e-6),
    ("force on it uN", "sphere_force", "{:.4g}", 1e-6),
    ("particles", "particles", "{:,}", 1),
    ("p_m", "material_p_m", "{}", 1),
    ("a of Y", "shear_exponent", "{}", 1),
    ("K_0", "bulk_modulus", "{}", 1),
    ("spacing", "spacing", "{}", 1),
    ("viscosity alpha", "viscosity_contact", "{}", 1),
    ("stopping time ms", "stopping_time_weightless", "{:.2f}", 1e-3),
    ("depth mm", "depth_weightless", "{:.3f}", 1e-3),
    ("phi below bead", "bead_filling_factor", "{:.3f}", 1),
    ("bead volumes denser than 0.22", "compacted_volume", "{:.2f}", 1),
    ("restitution of dust", "dust_restitution", "{:.3f}", 1),
    ("rebound", "largest_rebound", "{:.3f}", 1),
    ("share that sticks", "sticking_mass", "{:.2f}", 1),
    ("numerical dissipation", "numerical_dissipation", "{:.1%}", 1),
    ("time us", "time", "{:.4g}", 1e-6),
    ("ledger", "ledger_worst", "{:.0e}", 1),
)


def _cell(value, text, unit):
    if not _known(value):
        return "-"
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    return text.format(value if unit == 1 else value / unit)


def _say_side_by_side(rows):
    """The table of `compare`: a line for each run, or for each number where these are many."""
    shown = [c for c in COLUMNS if any(_known(row.get(c[1])) for row in rows)]
    columns = [
        (heading, [_cell(row[key], text, unit) for row in rows])
        for heading, key, text, unit in shown
    ]
    if not len(shown) > ABREAST >= len(rows):
        say_abreast(columns[:1], columns[1:])
        return
    (heading, names), *numbers = columns
    table = plain_table(heading, *names)
    for number, texts in numbers:
        table.add_row(number, *texts)
    say(table)


def _known(value):
    return value is not None and value == value and value != ""  # not a number is not known


def plot(
    runs: RunPaths,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the figures")
    ] = None,
    style: Annotated[str, typer.Option(help="page, column (of a journal, 88 mm) or talk")] = "page",
    file_format: Annotated[str, typer.Option("--format", help="png, pdf or svg")] = "png",
    force: Overwrite = False,
):
    """Figures of a run: curves, stress, profile, energy. Several runs: their curves in one."""
    from dusttaichi.plots.style import using

    if file_format not in FORMATS:
        raise DustError(f"--format {file_format}; allowed: {', '.join(FORMATS)}.")
    with using(style), writing(force=force, inputs=runs):
        _plot(runs, output, f".{file_format}")


def _plot(runs, output, suffix):
    from dusttaichi import analysis, plots

    if len(runs) == 1 and analysis.is_trade(runs[0]):
        data, file = analysis.open_trade(runs[0])
        folder = output or file.parent
        say_written([plots.save(plots.trade(data), folder / f"trade{suffix}")])
        return
    if len(runs) == 1 and analysis.is_ensemble(runs[0]):
        data, file = analysis.open_ensemble(runs[0])
        say_written(plots.save_ensemble(data, output or file.parent, suffix))
        return
    with ExitStack() as opened:
        results = [opened.enter_context(analysis.open_run(path)) for path in runs]
        if len(results) == 1:
            folder = output or (runs[0] if runs[0].is_dir() else runs[0].parent)
            paths = plots.save_all(results[0], folder, suffix)
        else:
            paths = plots.save_together(results, output or Path("."), suffix)
    say_written(paths)


def compare(
    runs: RunPaths,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="CSV file of all numbers")
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="directory for figures of them together", metavar="DIR")
    ] = None,
    force: Overwrite = False,
):
    """Runs side by side: fit and distance from the law, tensile strength, contacts, ledger."""
    from dusttaichi import analysis, plots
    from dusttaichi.analysis.draft import mixture

    with ExitStack() as opened:
        opened.enter_context(writing(force=force, inputs=runs))
        results = [opened.enter_context(analysis.open_run(path)) for path in runs]
        rows = analysis.compare(results)
        if text := mixture(results):
            remark(f"warning: {text}")
        drawn = [] if figures is None else plots.save_together(results, figures)
        _say_side_by_side(rows)
        if any(_known(row.get(key)) for row in rows for key in analysis.FIT_ERRORS):
            say("±: one sample each, fit error only; replicas show the scatter between samples")
        if output is not None:
            analysis.to_csv(rows, output)
            say_written([output])
    say_written(drawn)


def export(
    run: RunPath,
    to: Annotated[str, typer.Option(help="vtk, extxyz or lammps")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="directory of the files")
    ] = None,
    snapshot: Annotated[str, typer.Option(help="number, from the end if negative, or all")] = "all",
    force: Overwrite = False,
):
    """Snapshots for other programs: ParaView (vtk), ASE and OVITO (extxyz), OVITO (lammps)."""
    from dusttaichi import analysis
    from dusttaichi.export import export as write

    number = snapshot if snapshot == "all" else _whole("--snapshot", snapshot, " or all")
    with writing(force=force, inputs=[run]), analysis.open_run(run) as result:
        paths = write(result, to, output, number)
    say(f"wrote {paths[0]}{f' and {len(paths) - 1} more' if len(paths) > 1 else ''}")


def _whole(option, text, otherwise=""):
    try:
        return int(text)
    except ValueError:
        raise DustError(f"{option}: {text}; allowed: a whole number{otherwise}.") from None


def render(
    run: RunPath,
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
        str, typer.Option(help="oblique, front, side, top, bottom or x,y,z to look from")
    ] = "oblique",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="file: .png, .pdf; .gif, .mp4")
    ] = None,
    animate: Annotated[bool, typer.Option("--animate", help="a film of all snapshots")] = False,
    rate: Annotated[
        float | None, typer.Option(min=0.5, max=60.0, help="frames a second of a film")
    ] = None,
    dpi: Annotated[
        int | None, typer.Option(min=30, max=1200, help="pixels an inch of some six inches")
    ] = None,
    force: Overwrite = False,
):
    """Picture of the grains or the dust of a snapshot, or a film of all snapshots."""
    from dusttaichi import analysis, plots

    folder = run if run.is_dir() else run.parent
    with writing(force=force, inputs=[run]), analysis.open_run(run) as result:
        name = "dust" if result.is_continuum else "grains"
        path = output or folder / f"{name}.{'gif' if animate else 'png'}"
        sharp = {} if dpi is None else {"dpi": dpi}
        if animate:
            plots.animation(result, path, color, view, rate=rate, **sharp)
        else:
            if result.is_continuum:
                figure = plots.dust(result, snapshot, color or "filling_factor", **sharp)
            else:
                figure = plots.grains(result, snapshot, color or "coordination", view, **sharp)
            plots.save(figure, path)
    say_written([path])
