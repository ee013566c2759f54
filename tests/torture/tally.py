"""What the tortures share: how a count is stored, and how it is reported."""

import csv
import os
import subprocess
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path

from dusttaichi.errors import DustError, Interrupted

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "docs" / "validation" / "reliability.csv"
HEAD = ("torture", "tried", "failed", "command", "commit")


@dataclass
class Tally:
    """How many cases were tried, and what went wrong in which."""

    tried: int = 0
    failures: list[str] = field(default_factory=list)
    kinds: dict[str, int] = field(default_factory=dict)  # of what happened, for the reader

    def case(self, kind, problem=None, name=""):
        """One more case. problem: what went wrong in it, or None."""
        self.tried += 1
        self.kinds[kind] = self.kinds.get(kind, 0) + 1
        if problem:
            self.failures.append(f"{name}: {problem}")
            print(f"  FAILED {name}: {problem}", flush=True)

    def text(self, name, began):
        """A line for the terminal."""
        kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(self.kinds.items()))
        took = time.perf_counter() - began
        return f"{name}: {self.tried} tried, {len(self.failures)} failed, {took:.0f} s ({kinds})"


def fork(report, *functions):
    """Number of a process that forks from this one and calls the functions.

    Its status is 1 with a traceback, or the exit code of a DustError or an interrupt. report: file
    for the words.
    """
    report.write_text("")
    if child := os.fork():
        return child
    code = 0
    try:
        for function in functions:
            function()
    except DustError as error:
        report.write_text(str(error))
        code = error.exit_code
    except KeyboardInterrupt:
        code = Interrupted.exit_code
    except BaseException:
        report.write_text(traceback.format_exc())
        code = 1
    os._exit(code)


def run_forked(report, *functions):
    """(exit status, what was said) of a process of `fork`, at its end."""
    status = os.waitstatus_to_exitcode(os.waitpid(fork(report, *functions), 0)[1])
    return status, report.read_text()


def write_row(name, tally, command):
    """Put a row into the table of the docs, in the place of the former one of that name."""
    rows = {}
    if TABLE.exists():
        with TABLE.open(newline="") as file:
            rows = {row[0]: row for row in list(csv.reader(file))[1:]}
    commit = subprocess.run(
        ["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True
    ).stdout.strip()
    rows[name] = [name, tally.tried, len(tally.failures), command, commit]
    with TABLE.open("w", newline="") as file:
        write = csv.writer(file, lineterminator="\n").writerow
        write(HEAD)
        for row in sorted(rows.values(), key=lambda row: row[0]):
            write(row)
