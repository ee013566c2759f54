"""One run as a task: its process here, or in a temporary directory of a cluster's worker."""

import json
import os
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import dusttaichi

POLL = 0.5  # s between two looks at whether to stop
INTERRUPTED = 130
KEPT = (".nc", ".bin", ".yaml", ".png")  # files of a run that come back from a temporary directory


@dataclass(frozen=True)
class Job:
    """What a task is told.

    mode: "new", "force" (start anew) or "resume". directory: where the run goes, or None: a
    temporary one, whose files come back with the outcome. files: what lies there at first.
    error_bar: estimate the error of the time step at the end.
    """

    number: int
    scene: str
    mode: str
    directory: str | None
    files: dict[str, bytes] = field(default_factory=dict)
    error_bar: bool = False


@dataclass(frozen=True)
class Outcome:
    """How a run ended: exit code, message, and the files of a run in a temporary directory."""

    number: int
    code: int
    text: str
    files: dict[str, bytes] = field(default_factory=dict)


def perform(job, link, inputs):
    """Do a Job; returns its Outcome.

    link: has stopped(), true once all runs are to stop, and tell(number, share).
    inputs: relative path -> bytes of files that the scene reads, for a temporary directory.
    """
    if link.stopped():
        return Outcome(job.number, INTERRUPTED, "not started")
    if job.directory is not None:
        return Outcome(job.number, *_process(job, job.directory, None, link))
    with tempfile.TemporaryDirectory(prefix="dusttaichi-") as folder:
        directory = Path(folder) / "result"
        _lay_out(job.files, directory)
        here = _lay_out_inputs(inputs, Path(folder) / "inputs")
        code, text = _process(job, directory, here, link)
        files = {
            path.name: path.read_bytes()
            for path in directory.iterdir()
            if path.suffix in KEPT and not path.name.startswith(".")
        }
    return Outcome(job.number, code, text, files)


def _lay_out(files, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)


def _lay_out_inputs(inputs, folder):
    """Write the files; returns the directory that their paths, also ../../a.csv, start at."""
    up = max((Path(name).parts.count("..") for name in inputs), default=0)
    here = folder.joinpath(*["d"] * up)
    _lay_out(inputs, here)
    return here


def _process(job, directory, here, link):
    """Run in a process; returns (exit code, message)."""
    with tempfile.TemporaryFile("w+", errors="replace") as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "dusttaichi.studies.ensemble.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            cwd=here,
            env=environment(),
            # Ctrl-C in a terminal reaches only the process that asked, which passes it on once
            start_new_session=True,
        )
        said = {}
        listener = threading.Thread(target=_listen, args=(process.stdout, said), daemon=True)
        listener.start()
        try:
            request = {
                "scene": job.scene,
                "directory": str(directory),
                "mode": job.mode,
                "error_bar": job.error_bar,
            }
            with suppress(BrokenPipeError):
                process.stdin.write(json.dumps(request) + "\n")
                process.stdin.flush()
            while not _ended(process):
                if "share" in said:
                    link.tell(job.number, said["share"])
                if link.stopped():
                    process.stdin.close()
        finally:
            with suppress(BrokenPipeError):
                process.stdin.close()
            process.wait()
            listener.join()
            process.stdout.close()
        if "code" in said:
            return said["code"], said["text"]
        errors.seek(0)
        last = errors.read().strip().splitlines() or ["it said nothing"]
        return 1, f"the process ended (status {process.returncode}): {last[-1]}"


def _ended(process):
    try:
        process.wait(POLL)
        return True
    except subprocess.TimeoutExpired:
        return False


def _listen(stream, said):
    for line in stream:
        said.update(json.loads(line))


def environment():
    """That of this process, and the process imports the same package."""
    package = str(Path(dusttaichi.__file__).parent.parent)
    paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
