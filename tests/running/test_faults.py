"""What a run leaves on disk fits or is refused: frames, steps, code, files.

The method of spring.py stands for any: nothing is compiled but for the files of a sample.
"""

import os
import shutil
import signal
from dataclasses import replace

import netCDF4
import pytest
import spring
import toy
import xarray as xr
from bits import assert_same_bits

import dusttaichi as dt
from dusttaichi import method
from dusttaichi.errors import DustError, Interrupted
from dusttaichi.results.files import CHECKPOINT, RESULT
from dusttaichi.results.run_lock import RunLock
from dusttaichi.running import execute, identity, loop
from dusttaichi.scene import from_yaml, load

PLAIN, STAGED = toy.plain(), toy.make_staged()


def frames(directory):
    with xr.open_datatree(directory / RESULT) as tree:
        return tree["snapshots"].step.values.tolist()


# -- the last frame ------------------------------------------------------------------------------


@pytest.mark.parametrize("steps, written", [(1000, [0, 250, 500, 750]), (600, [0, 250, 500])])
def test_a_last_frame_is_one_of_a_longer_run_where_it_was_due_anyway(tmp_path, steps, written):
    """However often the run is finished again."""
    uninterrupted = execute(from_yaml(PLAIN), tmp_path / "whole")
    short = from_yaml(PLAIN.replace("2000", str(steps)))
    resumed = execute(short, tmp_path / "parts")
    for _ in range(2):
        assert frames(resumed) == [*written, steps]
        execute(short, resumed, resume=True)
    assert frames(resumed) == [*written, steps]
    execute(from_yaml(PLAIN), resumed, resume=True)
    assert_same_bits(uninterrupted / RESULT, resumed / RESULT)


def test_a_stage_has_its_last_frame_once(tmp_path):
    assert frames(execute(from_yaml(STAGED), tmp_path / "run")) == list(range(0, 1701, 100))


# -- step and code -------------------------------------------------------------------------------


def test_a_checkpoint_of_other_code_is_refused_with_what_to_do(tmp_path, monkeypatch):
    scene = from_yaml(PLAIN)
    directory = execute(scene, tmp_path / "run")
    monkeypatch.setattr(identity, "code_hash", lambda scene: "another")
    with pytest.raises(DustError, match=r"another version of dusttaichi.*--force"):
        execute(scene, directory, resume=True)


def test_the_hash_of_the_code_is_that_of_all_files(tmp_path):
    path = tmp_path / "law.py"
    path.write_text("k = 1")
    scene = from_yaml(PLAIN)
    plain = identity.code_hash(scene)
    method.register(replace(spring.METHOD, code=lambda scene: [path]))
    first = identity.code_hash(scene)
    path.write_text("k = 2")
    assert len({plain, first, identity.code_hash(scene)}) == 3


def test_a_checkpoint_of_another_step_is_refused(tmp_path):
    """As where another version chooses another step for `auto`."""
    scene = from_yaml(PLAIN)
    directory = execute(scene, tmp_path / "run")

    def reopen(scene, state):
        second_spring = spring.Spring(scene, scene.start)
        step = second_spring.dt / 2
        second_spring.restore(state)
        second_spring.dt = step
        return second_spring

    method.register(replace(spring.METHOD, reopen=reopen))
    with pytest.raises(DustError, match=r"time step of 10 ns.* one of 5 ns.*--force"):
        execute(scene, directory, resume=True)


# -- nothing to go on from -----------------------------------------------------------------------


def test_resume_with_nothing_there_begins_and_says_so(tmp_path):
    scene, log = from_yaml(PLAIN), []
    directory = execute(scene, tmp_path / "run", resume=True, log=log.append)
    assert len(log) == 1 and "starting from the beginning" in log[0]
    uninterrupted = execute(scene, tmp_path / "whole")
    assert_same_bits(uninterrupted / RESULT, directory / RESULT)
    for file in uninterrupted.glob(f"{CHECKPOINT}*"):
        file.unlink()
    with pytest.raises(DustError, match="is finished, and its checkpoint is missing"):
        execute(scene, uninterrupted, resume=True)


def test_resume_without_a_checkpoint_does_not_replace_the_result_of_another_scene(tmp_path):
    directory = execute(from_yaml(PLAIN), tmp_path / "run")
    for file in directory.glob(f"{CHECKPOINT}*"):
        file.unlink()
    with netCDF4.Dataset(directory / RESULT, "a") as file:
        file.status = "stopped by a guard"
        file.delncattr("digest")  # changed on purpose
    result_bytes = (directory / RESULT).read_bytes()
    other_scene = from_yaml(PLAIN).with_value("output.series", {"steps": 50})
    with pytest.raises(DustError, match=r"another scene.*output\.series.*no checkpoint.*--force"):
        execute(other_scene, directory, resume=True)
    assert (directory / RESULT).read_bytes() == result_bytes
    execute(from_yaml(PLAIN.replace("2000", "600")), directory, resume=True)  # stop may change


@pytest.mark.parametrize("moment", ["before", "in"])
def test_resume_of_a_run_that_was_killed_around_its_first_checkpoint(tmp_path, moment):
    scene = from_yaml(PLAIN)
    uninterrupted, killed = execute(scene, tmp_path / "whole"), tmp_path / "killed"
    killed.mkdir()
    if moment == "before":
        shutil.copy(uninterrupted / RESULT, killed / RESULT)
        with netCDF4.Dataset(killed / RESULT, "a") as file:
            file.status = "running"
            file.delncattr("digest")  # changed on purpose
    else:
        half = (uninterrupted / CHECKPOINT).read_bytes()[:100]
        (killed / f"{CHECKPOINT}.tmp").write_bytes(half)
    execute(scene, killed, resume=True)
    assert_same_bits(uninterrupted / RESULT, killed / RESULT)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_an_interrupt_during_the_build_says_that_nothing_was_computed(tmp_path, name):
    handler_before = signal.getsignal(getattr(signal, name))

    def build(scene, sample):
        os.kill(os.getpid(), getattr(signal, name))
        return spring.Spring(scene, sample)

    method.register(replace(spring.METHOD, build=build))
    with pytest.raises(Interrupted, match="nothing was computed") as stop:
        execute(from_yaml(PLAIN), tmp_path / "run")
    assert not stop.value.resumable and stop.value.exit_code == 130
    assert signal.getsignal(getattr(signal, name)) is handler_before
    method.register(spring.METHOD)
    execute(from_yaml(PLAIN), tmp_path / "run", resume=True)
    assert frames(tmp_path / "run")[-1] == 2000


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_that_python_loses_during_the_build_ends_the_run(tmp_path):
    class Gone:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGTERM)

    def build(scene, sample):
        Gone()
        return spring.Spring(scene, sample)

    method.register(replace(spring.METHOD, build=build))
    with pytest.raises(Interrupted) as stop:
        execute(from_yaml(PLAIN), tmp_path / "run")
    assert stop.value.resumable


@pytest.mark.parametrize("start", [execute, dt.simulate])
def test_an_interrupt_during_the_first_records_leaves_a_result_that_says_so(
    tmp_path, monkeypatch, start
):
    def begin(run):
        os.kill(os.getpid(), signal.SIGTERM)
        begin_undisturbed(run)

    begin_undisturbed = loop.Run.begin
    monkeypatch.setattr(loop.Run, "begin", begin)
    with pytest.raises(Interrupted) as stop:
        start(from_yaml(PLAIN), directory=tmp_path / "run")
    assert stop.value.resumable
    with xr.open_dataset(tmp_path / "run" / RESULT) as series:
        assert series.attrs["status"] == "interrupted"
    monkeypatch.setattr(loop.Run, "begin", begin_undisturbed)
    resumed = execute(from_yaml(PLAIN), tmp_path / "run", resume=True)
    uninterrupted = execute(from_yaml(PLAIN), tmp_path / "whole")
    assert_same_bits(uninterrupted / RESULT, resumed / RESULT)


# -- two at once ---------------------------------------------------------------------------------


@pytest.mark.parametrize("deleted", [False, True])
@pytest.mark.parametrize("options", [{}, {"force": True}, {"resume": True}])
def test_a_second_run_is_refused(tmp_path, options, deleted):
    """Also where somebody has deleted the lock file."""
    with RunLock(tmp_path):
        if deleted:
            (tmp_path / ".lock").unlink()
        with pytest.raises(DustError, match="Another run is writing"):
            execute(from_yaml(PLAIN), tmp_path, **options)


# -- files that a scene names --------------------------------------------------------------------

FILE = """
name: of_a_file
material: silicate_s12
sample: {kind: explicit, file: grains.csv, units: um}
boundary: {kind: open}
stop: {steps: STEPS}
numerics: {time_step: 0.3 ns, threads: 1}
output: {series: {steps: 10}, snapshots: off, directory: run}
"""


def test_scenes_with_a_file_run_again_and_go_on_from_anywhere(tmp_path, monkeypatch):
    folder = tmp_path / "place"
    folder.mkdir()
    (folder / "grains.csv").write_text("x,y,z\n0,0,0\n1.1999,0,0\n")
    for steps in (20, 40):
        (folder / f"{steps}.yaml").write_text(FILE.replace("STEPS", str(steps)))
    monkeypatch.chdir(folder)
    execute(load("20.yaml"), "run")
    monkeypatch.chdir(tmp_path)
    # the resolved scene beside the result, from another directory
    moved_run = execute(load("place/run/scene.yaml"), tmp_path / "again")
    assert_same_bits(folder / "run" / RESULT, moved_run / RESULT)
    execute(load("place/40.yaml"), "place/run", resume=True)
    uninterrupted = execute(load(folder / "40.yaml"), tmp_path / "whole")
    assert_same_bits(uninterrupted / RESULT, folder / "run" / RESULT)
    # another file in its place is another sample
    (folder / "grains.csv").write_text("x,y,z\n0,0,0\n1.1998,0,0\n")
    with pytest.raises(DustError, match="contents of its files"):
        execute(load("place/40.yaml"), "place/run", resume=True)


def test_guards_between_records_have_a_small_share_of_the_time(tmp_path, monkeypatch):
    """Those of a fixed step and of records stay."""
    monkeypatch.setattr(loop, "BURST_SECONDS", 0.0)
    monkeypatch.setattr(loop, "LONGEST_UNGUARDED", 1e9)
    guarded_steps = []
    monkeypatch.setattr(loop.Run, "guard", lambda run, m: guarded_steps.append(run.sim.step))
    counts = []
    for number, guarded_share in enumerate((float("inf"), 1e-12)):
        monkeypatch.setattr(loop, "GUARDED", guarded_share)
        execute(from_yaml(PLAIN), tmp_path / str(number))
        counts.append(len(guarded_steps))
        guarded_steps.clear()
    assert counts[0] > counts[1] + 10 and counts[1] > 5


@pytest.mark.parametrize("text", [PLAIN, STAGED], ids=["plain", "staged"])
def test_what_is_interrupted_between_two_records_goes_on_with_the_same_bits(
    text, tmp_path, monkeypatch
):
    """Many times, at whatever step the machine has come to."""
    monkeypatch.setattr(loop, "BURST_SECONDS", 0.0)
    scene = from_yaml(text)
    uninterrupted, resumed_folder = execute(scene, tmp_path / "whole"), tmp_path / "parts"
    count, options, steps = 0, {}, [0]
    while True:
        messages = []

        def interrupt(report, messages=messages, last_report=3 + count % 5):
            messages.append(report.step)
            steps.append(report.step)
            if len(messages) == last_report:
                os.kill(os.getpid(), signal.SIGINT)

        try:
            execute(scene, resumed_folder, report=interrupt, **options)
            break
        except Interrupted as stop:
            assert stop.resumable
            count, options = count + 1, {"resume": True}
    assert count > 10 and steps == sorted(steps) and steps[-1] < 2001
    assert_same_bits(uninterrupted / RESULT, resumed_folder / RESULT)
