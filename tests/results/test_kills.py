"""Writers that are killed at any moment, and that find no room: what is on disk is whole."""

import multiprocessing
import os
import random
import time

import pytest
import synthetic
from records import GRAINS, check, fill

from dusttaichi.errors import DustError
from dusttaichi.results import Writer
from dusttaichi.results import writer as writing
from dusttaichi.run import checkpoint


@pytest.fixture(scope="module")
def processes():
    """Processes that fork from one which has imported what they need."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["dusttaichi.results", "dusttaichi.run.checkpoint", "records"])
    return context


def write_for_ever(path, saved, piece, ready):
    """Do nothing but write, from the last checkpoint on."""
    writing.PIECE = piece
    if os.path.exists(saved):
        state = checkpoint.load(saved)
        step, writer = int(state.arrays["step"]), Writer.resume(path, state.meta["counts"])
    else:
        # killed before its first checkpoint: the run starts anew
        step, writer = 0, synthetic.writer(path, GRAINS, force=True)
    ready.send(step)
    while True:
        fill(writer, step, step + 7)
        step += 7
        writer.flush()
        checkpoint.save(saved, {"step": step}, {"counts": writer.counts()})
        fill(writer, step, step + 4)  # past the checkpoint
        step += 4
        writer.flush()


@pytest.mark.parametrize("piece", [10**9, pytest.param(100_000, marks=pytest.mark.long)])
def test_kill_at_any_moment(tmp_path, processes, piece):
    """kill -9 of a process that does nothing but write; what it left opens, and goes on."""
    path, saved = tmp_path / "run" / "result.nc", tmp_path / "run" / "checkpoint"
    least, count = 0, 0
    delays = random.sample(range(20, 400), 3)  # ms; a flush takes some 10 ms
    while delays or count <= 20:  # until the runs got somewhere
        delay = delays.pop() if delays else 500
        heard, ready = processes.Pipe(duplex=False)
        child = processes.Process(target=write_for_ever, args=(path, saved, piece, ready))
        child.start()
        ready.close()
        heard.recv()
        time.sleep(delay / 1e3)
        child.kill()
        child.join()
        if checkpoint.exists(saved):  # else killed before the first one
            least = int(checkpoint.load(saved).arrays["step"])
        count = check(path, least)
    state = checkpoint.load(saved)
    with Writer.resume(path, state.meta["counts"]) as writer:  # the lock died with its holder
        fill(writer, least, least + 30)
    assert check(path) == least + 30


def find_no_room(path, piece, said):
    """Write until a limit is reached, look at what is there, and go on without it."""
    import resource  # not everywhere

    writing.PIECE = piece
    writer = synthetic.writer(path, GRAINS)
    fill(writer, 0, 30)
    writer.flush()
    limit = os.path.getsize(path) + 300_000
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    fill(writer, 30, LAST)
    messages = []
    for _ in range(2):
        try:
            writer.flush()
        except DustError as error:
            messages.append(str(error))
    kept = check(path)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    writer.close()
    said.send((messages, kept, check(path)))


LAST = 1000  # steps, of 10 MB


@pytest.mark.parametrize("piece", [10**9, 200_000])
def test_no_room_left(tmp_path, processes, piece):
    """A file size limit stands for a full disk: the same calls fail at the same places."""
    heard, said = processes.Pipe(duplex=False)
    child = processes.Process(target=find_no_room, args=(tmp_path / "result.nc", piece, said))
    child.start()
    said.close()
    messages, kept, finally_there = heard.recv()
    child.join()
    assert len(messages) == 2 and all("is readable (up to t = 29 s)" in m for m in messages)
    assert kept == 30 and finally_there == LAST
