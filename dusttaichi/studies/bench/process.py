"""A process that measures one configuration (worker.py), seen from outside."""

import json
import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import dusttaichi
from dusttaichi.errors import DustError


class Process:
    """A worker that is asked and answers; compiled kernels are kept in `kernel_cache`.

    The process ends with the `with` block.
    """

    def __init__(self, kernel_cache: Path):
        package = str(Path(dusttaichi.__file__).parent.parent)
        paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(paths),
            "TI_OFFLINE_CACHE_FILE_PATH": str(kernel_cache),
        }
        self._errors = tempfile.TemporaryFile("w+")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "dusttaichi.studies.bench.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=environment,
        )

    def ask(self, do: str, **arguments) -> dict:
        """The answer to a command. Raises DustError with the worker's error, or its last words."""
        try:
            self._process.stdin.write(json.dumps({"do": do, **arguments}) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            self._errors.seek(0)
            said = self._errors.read().strip().splitlines() or ["it said nothing"]
            status = self._process.wait()
            raise DustError(f"A process of the benchmark ended (status {status}): {said[-1]}")
        answer = json.loads(line)
        if "error" in answer:
            raise DustError(answer["error"])
        return answer

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind is not None:
            self._process.kill()
        # a process that ends by itself writes its compiled kernels to the cache
        with suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()
        self._errors.close()
