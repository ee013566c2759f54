"""Options and arguments of several commands, and the scene that they name."""

import re
import shlex
import sys
from contextlib import ExitStack, contextmanager
from functools import wraps
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import completion
from dusttaichi.commands.console import remark
from dusttaichi.errors import DustError
from dusttaichi.scene.paths import user_path


def flag(name, help_text):
    """Type of an option without a value."""
    return Annotated[bool, typer.Option(name, help=help_text)]


def output_option(help_text):
    """Type of the option --output."""
    return Annotated[Path | None, typer.Option("--output", "-o", help=help_text)]


SceneFile = Annotated[
    Path,
    typer.Argument(
        help="YAML file of the scene, or the name of a bundled one",
        metavar="FILE",
        autocompletion=completion.complete_scenes,
    ),
]
RunPath = Annotated[
    Path,
    typer.Argument(
        help="run directory or result file", metavar="RUN", autocompletion=completion.complete_runs
    ),
]
RunPaths = Annotated[
    list[Path],
    typer.Argument(help="run directories or result files", autocompletion=completion.complete_runs),
]
Output = output_option("directory of the results")
MapOutput = output_option("directory of the map")
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="value of a key, instead of that in the file",
        metavar="KEY=VALUE",
        autocompletion=completion.complete_keys,
    ),
]
Threads = Annotated[int | None, typer.Option(min=1, help="CPU threads of each run")]
Jobs = Annotated[int | None, typer.Option(min=1, help="runs at a time, default as many as fit")]
Scheduler = Annotated[
    str | None, typer.Option(help="address of a Dask scheduler", metavar="ADDRESS")
]
Part = Annotated[
    str | None, typer.Option(help="only every N-th run, starting from the K-th", metavar="K/N")
]
Batch = Annotated[
    str,
    typer.Option(
        help="collisions side by side in a simulation: auto, a number, or off", metavar="N"
    ),
]
Overwrite = flag("--force", "overwrite files that dusttaichi did not make")
ForceResults = flag("--force", "overwrite existing results")
ResumeMissing = flag("--resume", "compute the missing runs")
Extensions = Annotated[
    bool | None,
    typer.Option(
        "--extensions/--no-extensions",
        help="import all Python files of the scene, also those outside of its folder; or none",
        show_default=False,
    ),
]
Json = flag("--json", "print the numbers as JSON instead of the table")
ExtensionFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--extension",
        help="a Python file with numbers, figures or a method of your own, imported first",
        metavar="FILE",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="no progress bar, no hints")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="print size, time step and the time of each phase")
]
Figures = Annotated[
    bool, typer.Option("--figures/--no-figures", help="draw figures at the end", show_default=False)
]


def with_user_paths(command):
    """The function of a command whose paths, alone or in lists, may begin with ~.

    A shell replaces it in `-o ~/runs`, but not in `--output=~/runs`.
    """

    def expand_paths(value):
        if isinstance(value, list):
            return [expand_paths(entry) for entry in value]
        return user_path(value) if isinstance(value, Path) else value

    @wraps(command)
    def call_with_expanded_paths(*arguments, **options):
        return command(
            *map(expand_paths, arguments), **{k: expand_paths(v) for k, v in options.items()}
        )

    return call_with_expanded_paths


def writing(**rules):
    """The context of `analysis.foreign.writing`, imported late for the sake of --help."""
    from dusttaichi.analysis import foreign

    return foreign.writing(**rules)


@contextmanager
def importing(allowed):
    """Context in which a scene may import its extensions.

    All (True), none (False), or (None) those in its folder, and others if the user at a terminal
    agrees.
    """
    from dusttaichi.scene import extensions

    def decide(path, folder):
        if allowed is False:
            return f"--no-extensions was given, and the scene would run the code of {path}"
        if allowed or not extensions.is_outside(path, folder):
            return None
        text = f"{path} is outside of the folder of the scene, and its code would run"
        if sys.stdin.isatty() and sys.stderr.isatty():
            return None if typer.confirm(f"{text}. Continue?", err=True) else "not to be imported"
        return f"{text}; allow it with --extensions, or put the file beside the scene"

    with extensions.restrict_imports(decide):
        yield


def load_scene(file, threads=None, settings=None, extensions=None):
    """The scene of a YAML file, with keys and the number of threads from options.

    extensions: see `importing`. Raises DustError.
    """
    from dusttaichi.scene import load

    with importing(extensions):
        scene = load(file)
    if settings:
        from dusttaichi.studies.scene_settings import apply_settings

        scene = apply_settings(scene, settings)
    return scene if threads is None else scene.with_value("numerics.threads", threads)


def import_files(files):
    """Import the extensions that --extension names. Raises DustError."""
    from dusttaichi.scene import extensions

    extensions.load({extensions.KEY: list(files or [])}, None, lines={}, title="--extension")


def part_of(text):
    """(k, n) of the text "k/n" of --part, (1, 1) of None. Raises DustError."""
    numbers = re.fullmatch(r"(\d+)/(\d+)", text or "1/1")
    k, n = (int(number) for number in numbers.groups()) if numbers else (0, 0)
    if not 1 <= k <= n:
        raise DustError(f"--part {text}: allowed: K/N with K from 1 to N, for example 2/8")
    return k, n


def folder_of(run):
    """The directory of a run, from its result file or itself."""
    return run if run.is_dir() else run.parent


@contextmanager
def open_runs(paths):
    """Context with the Runs of result files; names their missing extensions."""
    from dusttaichi import analysis

    with ExitStack() as stack:
        runs = [stack.enter_context(analysis.open_run(path)) for path in paths]
        remark_missing(run.attrs for run in runs)
        yield runs


def remark_missing(attributes):
    """Name the extensions of results that are not imported; attributes: a mapping for each."""
    from dusttaichi.scene import extensions

    missing_names = {
        n
        for attrs in attributes
        for n in extensions.list_missing(str(attrs.get(extensions.KEY, "")))
    }
    if missing_names:
        names = ", ".join(sorted(missing_names))
        remark(f"without numbers and figures of {names}; --extension FILE adds them")


def resume_command(*further, without=None):
    """The command that continues after an interruption: this command, with `further` words.

    without: an option that is omitted, with its value.
    """
    words = [word for word in sys.argv[1:] if word != "--force"]
    for number, word in enumerate(words):
        if without and word.partition("=")[0] == without:
            del words[number : number + (1 if "=" in word else 2)]
    return shlex.join(["dust", *(word for word in words if word not in further), *further])
