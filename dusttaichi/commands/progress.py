"""Times of the phases of a command, and its progress bar."""

import os
import time as real_time
from contextlib import contextmanager
from pathlib import Path

from dusttaichi.commands.console import err, remark

AFTER = 1.0  # s: shorter waits need no bar
REFRESH = 0.1  # s


def progress_bar(quiet=False, description=None, **bar_options):
    """The ProgressBar of a command, on the console of its remarks."""
    from dusttaichi.running.progress import ProgressBar  # with all that a run needs

    return ProgressBar(quiet, description, console=err, **bar_options)


@contextmanager
def show_sample(bar, delay=AFTER):
    """Context in which a bar shows the progress of samples that take longer than `delay` s."""
    from dusttaichi.scene.making import listening

    next_time = real_time.monotonic() + delay

    def show(finished, total):
        nonlocal next_time
        if (current_time := real_time.monotonic()) > next_time:  # generators call it for each grain
            next_time = current_time + REFRESH
            bar.show("sample", finished, total)

    with listening(show):
        yield


class Phases:
    """Times of the phases of a command, printed where `on` (--verbose); they add up to its time.

    The first phase begins with the process.
    """

    def __init__(self, on):
        self._on = on
        self._began = self._start = real_time.monotonic() - _age()

    def end(self, phase, seconds=None):
        """End a phase and print its time.

        seconds: its duration, by default the time since the last phase.
        """
        seconds = real_time.monotonic() - self._began if seconds is None else seconds
        if self._on:
            remark(f"{seconds:8.2f} s  {phase}")
        self._began += seconds

    def total(self):
        """Print the sum of all phases."""
        if self._on:
            remark(f"{self._began - self._start:8.2f} s  total")


def _age():
    """Time since this process began [s]; its processor time where the system does not give it."""
    try:
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        began = int(fields[19]) / os.sysconf("SC_CLK_TCK")
        return real_time.clock_gettime(real_time.CLOCK_BOOTTIME) - began
    except (OSError, AttributeError):
        return real_time.process_time()
