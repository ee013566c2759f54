"""`dust trade`: run time and error of each numerical parameter."""

from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import say, say_table
from dusttaichi.commands.study_command import study_command


@study_command(
    "points",
    omit="resume part figures",
    threads=(options.Threads, 1),
    force=(options.flag("--force", "run finished points again"), False),
)
def trade(
    file: options.SceneFile,
    *,
    parameters: Annotated[
        str | None,
        typer.Option("--parameters", help="only these parameters, by commas", metavar="NAME,NAME"),
    ] = None,
    observable: Annotated[
        str | None, typer.Option(help="the number with the decisive error", metavar="NAME")
    ] = None,
    tolerance: Annotated[str, typer.Option(help="largest error", metavar="SHARE")] = "5%",
    seeds: Annotated[
        int | None, typer.Option(min=1, help="seeds for the scatter: 4, with --quick 2")
    ] = None,
    quick: options.flag("--quick", "three levels of each parameter, two seeds") = False,
    suggest: options.flag("--suggest", "no runs: cheapest settings for such scenes") = False,
    run,
):
    """Measure run time and error of each numerical parameter.

    A table, a figure, and the cheapest setting.
    """
    from dusttaichi.analysis.ensemble import save_ensemble
    from dusttaichi.plots import save
    from dusttaichi.plots import trade as draw
    from dusttaichi.studies import trade_plan
    from dusttaichi.studies.trade_study import TradeStudy

    scene = options.load_scene(file, extensions=run.extensions)
    if suggest:
        _suggest(scene)
        return
    names, error_limit = trade_plan.parse_names(parameters), trade_plan.parse_tolerance(tolerance)
    plan = trade_plan.TradePlan(names, quick, seeds, error_limit, observable)
    with run.writing(file):
        folder = run.find_folder(scene, "trade")
        study = TradeStudy(scene, folder, plan, threads=run.threads, log=run.log)
        fraction = trade_plan.find_parameters(study.scene).fraction(study.scene)
        if fraction is not None:
            run.log(f"the time step is {fraction:.3g} of the period of the stiffest contact")
        data = study.dataset(run.run_again(study, log=run.log))
        data.attrs |= {} if run.jobs is None else {"jobs": run.jobs}
        save_ensemble(data, study.file)
        paths = [study.file, save(draw(data), study.file.with_suffix(".png"))]
    run.say_result(data, lambda: _show(study.trade, scene), paths)


def _show(measured_trade, scene):
    """Print table and advice of a Trade."""
    from dusttaichi.studies import trade_report as report

    title, rows = report.build_table(measured_trade)
    say_table(rows, *report.HEADINGS, title=title)
    for line in report.list_remarks(measured_trade):
        say(line)
    for heading, text in report.list_advice(measured_trade, scene):
        say(f"\n{heading}")
        if text:
            say(text)
    say()


def _suggest(scene):
    """Print the output of `--suggest`."""
    from dusttaichi.studies.suggest import classify_scene, list_suggestions

    cheapest_settings, scene_class = list_suggestions(scene), classify_scene(scene)
    say(f"cheapest settings measured for {scene_class}, costs in steps of accuracy: balanced:")
    for settings, text in cheapest_settings:
        say(f"  {settings}: {text}")
    if not cheapest_settings:
        say("  none within 5 % or the scatter of seeds: the unchanged scene")
