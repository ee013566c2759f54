"""`dust report` and `dust watch`: a page that shows runs, and one that grows with its run."""

import subprocess
import sys
import threading
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands.console import remark, say, say_written
from dusttaichi.commands.options import Added, Overwrite, RunPath, RunPaths, import_files, writing
from dusttaichi.processes import python_command


def report(
    runs: RunPaths,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="the HTML file, by default in the run")
    ] = None,
    extension: Added = None,
    force: Overwrite = False,
):
    """One HTML file that shows runs, or a sweep: figures to zoom into, grains in 3-D, numbers."""
    from dusttaichi import analysis
    from dusttaichi import report as page

    import_files(extension)
    folder = runs[0] if runs[0].is_dir() else runs[0].parent
    path = output or (folder / "report.html" if len(runs) == 1 else Path("report.html"))
    with writing(force=force, inputs=runs), ExitStack() as opened:
        page.check_output(path)
        if len(runs) == 1 and analysis.is_ensemble(runs[0]):
            data = page.ensemble_data(*analysis.open_ensemble(runs[0]))
        else:
            results = [opened.enter_context(analysis.open_run(run)) for run in runs]
            data = page.report_data(results)
        say_written([page.write(data, path)])
    say(f"{path.stat().st_size / 1e6:.1f} MB; it opens in any browser and needs no network")


Port = Annotated[int, typer.Option(min=0, max=65535, help="0 takes any free one")]
Browse = Annotated[bool, typer.Option("--browse/--no-browse", help="open it in a browser")]


def watch(
    run: RunPath,
    *,
    port: Port = 0,
    browse: Browse = True,
    extension: Added = None,
    until_input_ends: Annotated[bool, typer.Option(hidden=True)] = False,
):
    """The page of dust report, served on this machine while the run goes on, growing by itself."""
    from dusttaichi.report.watch import result_of, serve

    import_files(extension)
    if not result_of(run).exists():
        remark(f"there is no result at {result_of(run)} yet; the page waits for it")
    stop = None
    if until_input_ends:
        stop = threading.Event()

        def wait():
            sys.stdin.read()
            stop.set()

        threading.Thread(target=wait, daemon=True).start()
    serve(run, port, browse=browse, announce=_say_address, stop=stop)


def _say_address(url):
    remark(f"watch it at {url} (Ctrl-C ends it)")


@contextmanager
def watched(directory, on):
    """Serve the page of a run beside it, in a process of its own that ends after the run."""
    if not on:
        yield
        return
    command = python_command("dusttaichi", "watch", directory, "--until-input-ends")
    server = subprocess.Popen(command, stdin=subprocess.PIPE)
    try:
        yield
    finally:
        server.stdin.close()  # it serves the end for some seconds more
