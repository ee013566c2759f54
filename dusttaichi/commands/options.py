"""Options and arguments that several commands have, and the scene that they are about."""

import shlex
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import completion
from dusttaichi.errors import DustError

SceneFile = Annotated[
    Path,
    typer.Argument(
        help="YAML file of the scene, or a name of dust new",
        metavar="FILE",
        autocompletion=completion.scenes,
    ),
]
RunPath = Annotated[
    Path,
    typer.Argument(
        help="run directory or result file", metavar="RUN", autocompletion=completion.runs
    ),
]
RunPaths = Annotated[
    list[Path],
    typer.Argument(help="run directories or result files", autocompletion=completion.runs),
]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="directory of the results")]
MapOutput = Annotated[Path | None, typer.Option("--output", "-o", help="directory of the map")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="a key of the scene in place of the file's",
        metavar="KEY=VALUE",
        autocompletion=completion.keys,
    ),
]
Threads = Annotated[int | None, typer.Option(min=1, help="CPU threads")]
Scheduler = Annotated[
    str | None, typer.Option(help="address of a Dask scheduler", metavar="ADDRESS")
]
Overwrite = Annotated[
    bool, typer.Option("--force", help="overwrite files that dusttaichi has not made")
]
ForceResults = Annotated[bool, typer.Option("--force", help="overwrite existing results")]
ResumeMissing = Annotated[bool, typer.Option("--resume", help="go on with what is missing")]
Extensions = Annotated[
    bool | None,
    typer.Option(
        "--extensions/--no-extensions",
        help="import the Python files that the scene names, also those outside of its folder; or "
        "none",
        show_default=False,
    ),
]
Json = Annotated[
    bool, typer.Option("--json", help="print the numbers as JSON in place of the table")
]
Added = Annotated[
    list[Path] | None,
    typer.Option(
        "--extension",
        help="a Python file with numbers, figures or a method of your own, imported first",
        metavar="FILE",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="no progress bar, no hints")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="tell what the scene says, and what took how long")
]
Figures = Annotated[
    bool, typer.Option("--figures/--no-figures", help="draw figures at the end", show_default=False)
]


@contextmanager
def writing(**how):
    """Writing inside spares the files of others (`results.outputs.writing`), and what is
    wrong in a result of others is a sentence (`analysis.foreign.understood`)."""
    from dusttaichi.analysis import foreign  # which --help does not wait for
    from dusttaichi.results import outputs

    with outputs.writing(**how), foreign.understood(how.get("inputs", ())):
        yield


@contextmanager
def importing(allowed):
    """Inside, a scene may import its extensions: all (True), none (False), or (None) those in its
    folder, and others where the user at a terminal says so."""
    from dusttaichi.scene import extensions

    def decide(path, folder):
        if allowed is False:
            return f"--no-extensions was given, and it would run the code of {path}"
        if allowed or not extensions.outside(path, folder):
            return None
        text = f"{path} is outside of the folder of the scene, and its code would run"
        if sys.stdin.isatty() and sys.stderr.isatty():
            return None if typer.confirm(f"{text}. Go on?", err=True) else "not to be imported"
        return f"{text}; allow it with --extensions, or put the file beside the scene"

    with extensions.allowed_by(decide):
        yield


def load_scene(file, threads=None, settings=None, extensions=None):
    """The scene of a YAML file, with the keys and the number of threads that options give;
    extensions: see `importing`. Raises DustError."""
    from dusttaichi.scene import load

    with importing(extensions):
        scene = load(file)
    if settings:
        from dusttaichi.studies.ensemble import with_settings

        scene = with_settings(scene, settings)
    return scene if threads is None else scene.with_value("numerics.threads", threads)


def import_files(files):
    """Import the extensions that --extension names. Raises DustError."""
    from dusttaichi.scene import extensions

    extensions.load({extensions.KEY: list(files or [])}, None, lines={}, title="--extension")


def refuse_both(force, resume):
    """Refuse --force together with --resume. Raises DustError."""
    if force and resume:
        raise DustError("--force starts anew, --resume goes on: give only one of them")


def again(command, file, output, *, settings=(), scheduler=None, error_bar=False, extensions=None):
    """The command that goes on with what was interrupted."""
    words = ["dust", command, str(file)]
    words += [word for setting in settings for word in ("--set", setting)]
    words += ["--output", str(output)] if output else []
    words += ["--scheduler", scheduler] if scheduler else []
    words += ["--error-bar"] if error_bar else []
    words += ["--extensions"] if extensions else []
    return shlex.join([*words, "--resume"])
