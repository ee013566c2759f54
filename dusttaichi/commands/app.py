"""The command `dust`, from families of commands with a file each."""

EXIT_CODES = (
    (0, "success"),
    (1, "a cell of the map of `dust extremes` failed"),
    (2, "invalid input, a missing file or a full disk: something that you can correct"),
    (3, "a guard stopped a run because its numbers are no longer valid"),
    (130, "Ctrl-C, SIGTERM or SIGHUP; results so far are saved"),
)

CUDA_ERROR = r"CUDA_ERROR_\w+(: [^\n]*?)?(?= while calling|$)"  # in the messages of Taichi
NO_MEMORY = (
    "there is not enough memory: use fewer grains or snapshots, or raise the limit of memory "
    "(ulimit -v, or the memory requested of a queue)"
)
NO_GPU = "Try fewer grains, no other program on the GPU, or numerics.backend: cpu."


def is_interrupt(error):
    """True where Ctrl-C caused it: a compiled module that is being imported raises ImportError."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


try:
    import re
    import signal
    import sys
    from typing import Annotated

    from dusttaichi.commands.bytecode import keep_bytecode, mend_bytecode

    keep_bytecode()  # before what takes time to compile

    import typer

    from dusttaichi.commands.bench import bench
    from dusttaichi.commands.check import check, schema
    from dusttaichi.commands.collide import collide
    from dusttaichi.commands.console import err, say
    from dusttaichi.commands.environment import guard_streams
    from dusttaichi.commands.extremes import extremes
    from dusttaichi.commands.fit import fit
    from dusttaichi.commands.new import new
    from dusttaichi.commands.options import with_user_paths
    from dusttaichi.commands.report import report, watch
    from dusttaichi.commands.results import compare, export, plot, render
    from dusttaichi.commands.run import run
    from dusttaichi.commands.sticking import sticking
    from dusttaichi.commands.study import study
    from dusttaichi.commands.sweep import sweep
    from dusttaichi.commands.trade import trade
    from dusttaichi.compute.collector import collect_seldom
    from dusttaichi.compute.version import __version__
    from dusttaichi.errors import DustError, Interrupted

    app = typer.Typer(
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        help="Grain-by-grain and continuum simulation of porous dust.",
        epilog=f"Exit codes: {'; '.join(f'{code} {meaning}' for code, meaning in EXIT_CODES)}.",
    )
    COMMANDS = (new, run, sweep, study, collide, trade, sticking, extremes, check, schema)
    COMMANDS += (report, watch, plot, compare, fit, bench, export, render)
    for command in COMMANDS:
        app.command()(with_user_paths(command))
except (KeyboardInterrupt, ImportError) as error:  # Ctrl-C meanwhile would print a traceback
    if not is_interrupt(error):
        mend_bytecode(error)
        raise
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise SystemExit(130) from None
except (EOFError, ValueError, TypeError) as error:
    mend_bytecode(error)
    raise


def _version(value: bool):
    if value:
        say(f"dusttaichi {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version")
    ] = False,
):
    pass


def main(commands=None):
    """Entry point: user errors are one clear message, not a traceback; exit codes: EXIT_CODES.

    commands: a typer app, by default `app`.
    """
    try:
        with guard_streams():
            _run(app if commands is None else commands)
    except DustError as error:
        _end(error)
    except KeyboardInterrupt:  # a second one, while the first was being reported
        _end(Interrupted("interrupted"))


def _run(commands):
    collect_seldom()
    for number in _deadly_signals():
        signal.signal(number, signal.default_int_handler)
    try:
        if commands(standalone_mode=False) == Interrupted.exit_code:  # of typer after Ctrl-C
            raise Interrupted("interrupted")
    except DustError as error:
        _end(error)
    except (KeyboardInterrupt, typer.Abort):
        _end(Interrupted("interrupted"))
    except OSError as error:  # of the system, where no caller has a better message
        _end(DustError(f"the system refuses: {error}"))
    except MemoryError:
        _end(DustError(NO_MEMORY))
    except Exception as error:
        mend_bytecode(error)
        if is_interrupt(error):
            _end(Interrupted("interrupted"))
        if isinstance(error, RuntimeError) and (cuda_error := re.search(CUDA_ERROR, str(error))):
            _end(DustError(f"numerics.backend = cuda: the GPU refuses: {cuda_error[0]}. {NO_GPU}"))
        if type(error).__module__.startswith(("click", "typer")):
            error.show()
            sys.exit(error.exit_code)
        raise


def _deadly_signals():
    """Signals other than Ctrl-C that would end this process silently: a kill, a closed terminal.

    Signals that are ignored, as under nohup, stay ignored.
    """
    numbers = (getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP"))
    return [n for n in numbers if n is not None and signal.getsignal(n) is signal.SIG_DFL]


def _end(error):
    """Print the message and exit; running threads end by themselves."""
    if isinstance(error, Interrupted):
        # another Ctrl-C would only print a traceback
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    err.print(f"dust: {error}", style="red", soft_wrap=True)
    sys.exit(error.exit_code)
