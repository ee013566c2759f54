"""`dust report` and `dust watch`: interactive report of runs, and of a run in progress."""

import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import options
from dusttaichi.commands.console import remark, say, say_written
from dusttaichi.compute.processes import python_command


def report(
    runs: options.RunPaths,
    output: options.output_option("the HTML file, by default in the run directory") = None,
    extension: options.ExtensionFiles = None,
    force: options.Overwrite = False,
):
    """Write an interactive report of runs, one HTML file.

    Figures, grains in 3-D and numbers, of several runs or a sweep as well.
    """
    from dusttaichi import analysis
    from dusttaichi import report as page

    options.import_files(extension)
    folder = options.folder_of(runs[0]) if len(runs) == 1 else Path(".")
    path = output or folder / "report.html"
    with options.writing(force=force, inputs=runs):
        page.check_output(path)
        study = analysis.find_study(runs[0]) if len(runs) == 1 else None
        if study == "ensemble":
            dataset_and_file = analysis.open_ensemble(runs[0])
            options.remark_missing([dataset_and_file[0].attrs])
            data = page.collect_ensemble_data(*dataset_and_file)
        elif study == "collisions":
            collisions = analysis.open_collisions(runs[0])[0]
            options.remark_missing([collisions.attrs])
            data = page.collect_collisions_data(collisions)
        else:
            with options.open_runs(runs) as results:
                data = page.collect_report_data(results)
        say_written([page.write(data, path)])
    say(f"{path.stat().st_size / 1e6:.1f} MB; opens in any browser, without a network")


def watch(
    run: options.RunPath,
    *,
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes any free one")] = 0,
    browse: Annotated[bool, typer.Option(help="open it in a browser")] = True,
    extension: options.ExtensionFiles = None,
    until_input_ends: Annotated[bool, typer.Option(hidden=True)] = False,
):
    """Serve the report of a run in progress.

    On this machine, updated as the run continues.
    """
    from dusttaichi.report.watch import find_result_file, serve

    options.import_files(extension)
    if not find_result_file(run).exists():
        remark(f"there is no result at {find_result_file(run)} yet; the report waits for it")
    stop = None
    if until_input_ends:
        stop = threading.Event()

        def wait():
            sys.stdin.read()
            stop.set()

        threading.Thread(target=wait, daemon=True).start()

    def announce(url):
        remark(f"open {url} to watch it; Ctrl-C ends the server")

    serve(run, port, browse=browse, announce=announce, stop=stop)


@contextmanager
def serve_report(directory, on):
    """Serve the report of a run in a separate process that ends after the run."""
    if not on:
        yield
        return
    command = python_command("dusttaichi", "watch", directory, "--until-input-ends")
    server = subprocess.Popen(command, stdin=subprocess.PIPE)
    try:
        yield
    finally:
        server.stdin.close()  # the server ends some seconds later
