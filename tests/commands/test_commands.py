"""The command line: exit codes, interruptions, file names with brackets. Nothing is simulated."""

import io
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import synthetic
from program import dust, python
from rich.console import Console
from scenes import CONFIGS

from dusttaichi import running as run_package
from dusttaichi.commands import app as cli
from dusttaichi.commands import completion, console, options
from dusttaichi.commands.progress import progress_bar
from dusttaichi.commands.study_command import StudyRun
from dusttaichi.compute import compiler
from dusttaichi.errors import DustError, GuardStop, Interrupted
from dusttaichi.running.progress import ProgressBar
from dusttaichi.scene import shipped
from dusttaichi.studies import extremes_map, trade_report
from dusttaichi.studies.scene_settings import apply_common_settings
from dusttaichi.studies.sweep_study import sweep

SMOKE = CONFIGS / "smoke.yaml"


@pytest.fixture
def run_failing(monkeypatch, capsys):
    """A function that ends `dust` with an error; returns the exit code and what was printed."""
    handlers = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}

    def main(error):
        def fail(*_, **__):
            raise error

        monkeypatch.setattr(cli, "app", fail)
        with pytest.raises(SystemExit) as end:
            cli.main()
        return end.value.code, capsys.readouterr().err

    yield main
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (DustError("bad [red]value[/red]"), 2, "dust: bad [red]value[/red]"),
        (GuardStop("too fast"), 3, "dust: too fast"),
        (Interrupted("whatever the words"), 130, "dust: whatever the words"),
        (DustError("interrupted by its wording only"), 2, "dust: interrupted by"),
        (KeyboardInterrupt(), 130, "dust: interrupted"),
        (
            RuntimeError(
                "[cuda_driver.h:operator()@92] CUDA Error CUDA_ERROR_OUT_OF_MEMORY: out of memory "
                "while calling mem_alloc (cuMemAlloc_v2)"
            ),
            2,
            "the GPU refuses: CUDA_ERROR_OUT_OF_MEMORY: out of memory. Try fewer grains",
        ),
    ],
)
def test_exit_codes_are_those_of_the_errors(run_failing, error, code, text):
    exit_code, printed = run_failing(error)
    assert exit_code == code and text in printed


def test_an_interrupt_that_an_import_turned_into_its_own_error(run_failing):
    """As pybind11's modules do, and Taichi's `raise ... from None` after them."""
    error = ImportError("initialization failed")
    error.__context__ = KeyboardInterrupt()
    error.__suppress_context__ = True
    exit_code, printed = run_failing(error)
    assert exit_code == 130 and "dust: interrupted" in printed


def test_bad_options_have_the_exit_code_of_bad_input():
    process = python("-m", "dusttaichi", "run", "--no-such-option")
    assert process.returncode == 2 and "Traceback" not in process.stderr


# -- interruptions -------------------------------------------------------------------------------


@pytest.fixture
def run_interrupted(monkeypatch, tmp_path):
    """Runs `dust run` whose `execute` is interrupted with an error."""

    def run(error, *words):
        def execute(scene, directory, **_):
            raise error

        monkeypatch.setattr(run_package, "execute", execute)
        words = list(map(str, ("run", SMOKE, "-q", "-o", tmp_path, *words)))
        monkeypatch.setattr("sys.argv", ["dust", *words])
        with pytest.raises(Interrupted) as caught:
            dust(*words)
        return str(caught.value)

    return run


def test_an_interruption_says_how_to_go_on_where_anything_was_computed(run_interrupted, tmp_path):
    text = run_interrupted(Interrupted("nothing was computed", resumable=False))
    assert text == "nothing was computed"
    text = run_interrupted(
        Interrupted("interrupted; all is there"), "--set", "stop.steps=9", "--force"
    )
    onward = f"dust run {SMOKE} -q -o {tmp_path} --set stop.steps=9 --resume"
    assert text == f"interrupted; all is there. Continue with: {onward}"


def test_an_interruption_of_the_figures_says_that_all_is_computed(monkeypatch, tmp_path):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_package, "execute", lambda scene, directory, **_: None)
    monkeypatch.setattr("dusttaichi.commands.run._show_result", interrupt)
    with pytest.raises(Interrupted) as stop:
        dust("run", SMOKE, "-q", "-o", tmp_path)
    assert str(stop.value) == f"interrupted; all is computed. Figures: dust plot {tmp_path}"
    monkeypatch.setattr("sys.argv", ["dust", "sweep", "a.yaml", "--force"])
    with pytest.raises(Interrupted, match="Dataset and figures: dust sweep a.yaml --resume$"):
        with StudyRun("runs").gathering():
            interrupt()


def test_of_a_part_all_parts_are_gathered(monkeypatch):
    for option in (["--part", "1/3"], ["--part=1/3"]):
        monkeypatch.setattr("sys.argv", ["dust", "sweep", "a.yaml", *option, "--set", "a.b=2 cm/s"])
        onward = options.resume_command("--resume", without="--part")
        assert onward == "dust sweep a.yaml --set 'a.b=2 cm/s' --resume"


@pytest.mark.parametrize("delay", [0.3, 1.0])
def test_two_interrupts_while_it_starts_give_no_traceback(tmp_path, delay):
    """The delays are after the package begins to be imported: in its imports, and in the build."""
    code = "import dusttaichi; print(1, flush=True); import dusttaichi.__main__"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "run", str(SMOKE), "-o", str(tmp_path / "run")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, compiler.variable(compiler.KERNEL_FOLDER): str(tmp_path / "kernels")},
    )
    process.stdout.readline()
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in out + err


# -- keys on the command line --------------------------------------------------------------------


def test_keys_on_the_command_line(capsys):
    dust("check", SMOKE, "--set", "sample.grains=20", "--set", "numerics.time_step=0.1 ns")
    output = capsys.readouterr().out
    assert (
        re.search(r"grains +20\n", output) and "time step    " in output and " 0.1 ns = " in output
    )


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("sample.grain=20", r"sample\.grain"),
        ("sample.grains=-1", r"sample\.grains = -1"),
        ("sample.grains=20,30", r"must be one value here.*dust sweep"),
        ("sample.grains", r"must be a key and its values"),
        ("replicas=2,3", r"replicas: must be one value here$"),
        ("output.directory=a", r"use --output instead"),
    ],
)
def test_a_key_that_cannot_be_set(setting, message):
    with pytest.raises(DustError, match=message):
        dust("check", SMOKE, "--set", setting)


def test_name_and_replicas_on_the_command_line(tmp_path):
    one = options.load_scene(SMOKE, settings=["name=other", "replicas=3"])
    assert one.name == "other" and one.replicas == 3
    assert one.output.directory == Path("runs/other")
    scene, swept = apply_common_settings(one, ["replicas=2", "stop.steps=5,6"])
    plan = sweep(scene, swept, tmp_path)
    assert len(plan.members) == 4
    assert {key: [v.value for v in values] for key, values in swept.items()} == {
        "stop.steps": [5, 6]
    }


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("dust run omni", "omni_static"),
        ("dust new seizinger2012/static", "seizinger2012/static_modified"),
        ("dust check smoke --set boundary.wall_sp", "boundary.wall_speed="),
        ("dust ren", "render"),
    ],
)
def test_the_shell_completes(words, offered, monkeypatch, capsys):
    """What bash asks the program for after Tab, and is told."""
    monkeypatch.setenv("_DUST_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    with pytest.raises(SystemExit):
        cli.app(prog_name="dust")
    assert offered in capsys.readouterr().out.split()


def test_run_directories_are_completed(tmp_path):
    (tmp_path / "runs/one").mkdir(parents=True)
    (tmp_path / "runs/result.nc").touch()
    (tmp_path / "runs/other.txt").touch()
    completions = completion.complete_runs(f"{tmp_path}/runs/")
    assert [Path(path).name for path in completions] == ["one", "result.nc"]
    assert completion.complete_runs(f"{tmp_path}/nowhere/") == []


def test_names_of_scenes_are_not_cut(capsys, monkeypatch):
    monkeypatch.setattr(console.console, "_width", 60)
    dust("new")
    output = " ".join(capsys.readouterr().out.split())
    assert "…" not in output
    for name in shipped.list_names()[:8]:
        assert name in output


# -- printing ------------------------------------------------------------------------------------


def test_brackets_in_file_names_are_no_markup(tmp_path, capsys, monkeypatch):
    """And long paths stay in one line."""
    folder = tmp_path / "[red]a[/b][link=x]"
    synthetic.compression_run(folder / "result.nc")
    dust("plot", folder, "-o", tmp_path / "[/]" / ("x" * 120))
    lines = capsys.readouterr().out.splitlines()
    assert lines and all(line.startswith(f"wrote {tmp_path / '[/]'}") for line in lines)
    monkeypatch.chdir(folder)
    dust("compare", folder, "-o", "[bold].csv")
    assert "wrote [bold].csv" in capsys.readouterr().out
    with pytest.raises(DustError, match=r"\[/missing\]"):
        dust("plot", tmp_path / "[/missing]")


@pytest.mark.parametrize("width", [40, 80, 300])
def test_a_table_too_wide_goes_on_below(width, capsys, monkeypatch):
    """No number and no word is cut: where the line is too short, what is left stands below, after
    its keys."""
    monkeypatch.setattr(console.console, "_width", width)
    keys = [("seed", ["1", "2"]), ("name", ["short", "a" * 50])]
    numbers = [(f"strength number {n} (kPa)", [f"{n}.12345", f"{n}e-07"]) for n in range(12)]
    console.say_abreast(keys if width > 60 else keys[:1], numbers, "title")
    printed = capsys.readouterr().out
    lines, words = printed.splitlines(), printed.split()
    assert max(map(len, lines)) <= width
    assert [words.count(text) for _, texts in numbers for text in texts] == [1] * 24
    assert words.count("strength") == words.count("number") == words.count("(kPa)") == 12
    tables = [line for line in lines if line.startswith("seed")]
    assert (len(tables) == 1) == (width == 300) and len(tables) < 12
    assert sum(line.startswith("2") for line in lines) == len(tables)


@pytest.mark.parametrize("headings", [extremes_map.HEADINGS, trade_report.HEADINGS])
def test_numbers_of_a_study_are_not_cut_in_a_narrow_terminal(headings, capsys, monkeypatch):
    monkeypatch.setattr(console.console, "_width", 60)
    rows = [(f"point {n}", *[str(n) * 9] * (len(headings) - 1)) for n in (7, 8)]
    console.say_table(rows, *headings)
    printed = capsys.readouterr().out
    digits = 9 * (len(headings) - 1) + 1  # a number may go on in the next line
    assert [printed.count("7"), printed.count("8")] == [digits, digits]


def terminal(width):
    return Console(
        file=io.StringIO(), force_terminal=True, width=width, markup=False, highlight=False
    )


def test_the_bar_shows_brackets_and_is_silent_where_asked():
    screen = terminal(120)
    with ProgressBar(console=screen) as bar:
        bar.show("[/red] 1 of 2", 1, 2, "[red]size=[1,2] 50%")
        bar.log("kept in [dir]")
    printed = screen.file.getvalue()
    assert "[/red] 1 of 2" in printed and "size=[1,2]" in printed and "kept in [dir]" in printed
    screen = terminal(120)
    with ProgressBar(quiet=True, console=screen) as bar:
        bar.show("1 of 2", 1, 2)
    assert "1 of 2" not in screen.file.getvalue()


@pytest.mark.parametrize("width", [40, 60, 100])
def test_the_bar_is_one_line_on_any_terminal(width):
    screen = terminal(width)
    with ProgressBar(console=screen) as bar:
        bar.show("step 1,234,567", 1, 2, "phi 0.312  P 12.3 kPa  12,345 steps/s")
    lines = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]|\r", "", screen.file.getvalue()).split("\n")
    assert max(map(len, lines)) <= width and "phi" in lines[-2] and " 50.0 %" in lines[-2]


def test_a_log_has_no_bar_but_a_line_now_and_then(capsys):
    with progress_bar() as bar:
        bar.show("step 1", 1, 2, "phi 0.3")
        bar.log("stage one finished")
    with progress_bar(every=0.0) as bar:
        bar.show("step 2", 2, 4, "phi 0.4")
    assert capsys.readouterr().err == "stage one finished\nstep 2  50%  phi 0.4\n"
