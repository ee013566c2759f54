"""A run of a trade (child.py) seen from outside."""

import json
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress

from dusttaichi.studies.ensemble.jobs import environment

POLL = 0.2  # s between two looks at whether to stop


class Process:
    """A run that is started, begins when told to, and ends with the `with` block at the latest.

    said: what it has told so far.
    """

    def __init__(self, scene, directory, measure=True):
        self.said = {}
        self._news = threading.Condition()
        self._errors = tempfile.TemporaryFile("w+", errors="replace")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "dusttaichi.studies.trade.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=environment(),
            # Ctrl-C in a terminal reaches only the process that asked
            start_new_session=True,
        )
        self._ended = self._begun = False
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        request = {"scene": scene.to_yaml(), "directory": str(directory), "measure": measure}
        self._write(json.dumps(request))

    def _write(self, line):
        with suppress(BrokenPipeError, ValueError):
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()

    def _listen(self):
        for line in self._process.stdout:
            with self._news:
                self.said.update(json.loads(line))
                self._news.notify_all()
        with self._news:
            self._ended = True
            self._news.notify_all()

    def wait(self, key, seconds=POLL):
        """True once it has told `key` or its end; waits no longer than `seconds`."""
        with self._news:
            return self._news.wait_for(lambda: key in self.said or self._ended, seconds)

    def begin(self):
        """Let the steps begin, if they have not."""
        if not self._begun:  # a second line would stop the run
            self._begun = True
            self._write("go")

    def stop(self):
        """Let the run end early."""
        with suppress(BrokenPipeError, ValueError):
            self._process.stdin.close()

    def end(self):
        """What it told: `code`, `text` and more. The last words of one that was lost."""
        while not self.wait("code"):
            pass
        if "code" in self.said:
            return self.said
        status = self._process.wait()
        self._errors.seek(0)
        last = self._errors.read().strip().splitlines() or ["it said nothing"]
        return {"code": 1, "text": f"the process ended (status {status}): {last[-1]}"}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self._process.wait()
        self._listener.join()
        self._process.stdout.close()
        self._errors.close()
