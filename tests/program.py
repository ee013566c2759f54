"""The command in this process, and Python in a process of its own."""

import subprocess
import sys
import time

from typer.testing import CliRunner

from dusttaichi.commands.app import app


def dust(*words):
    """`dust` with these words; its errors are raised."""
    app([str(word) for word in words], standalone_mode=False)


def invoke(*words):
    """The outcome of `dust` with these words: exit_code, output, stdout, exception."""
    return CliRunner().invoke(app, [str(word) for word in words])


def python(*words, **options):
    """A process of this Python that has ended: returncode, stdout, stderr."""
    return subprocess.run([sys.executable, *words], capture_output=True, text=True, **options)


def wait_for(path, process):
    """Until a process has made a file or has ended, 300 s at most."""
    for _ in range(6000):
        if path.exists() or process.poll() is not None:
            return
        time.sleep(0.05)
