"""Pools for the jobs of a study: threads of this process, or a Dask cluster.

Each thread only waits for the worker process of its job. On this machine a process runs one job
after the other, so that jobs of the same structure share its start and its kernels.
"""

from __future__ import annotations

import importlib.util
import threading
import uuid
import warnings
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import Any, Protocol

from dusttaichi.errors import DustError
from dusttaichi.studies.jobs import Job, Report
from dusttaichi.studies.workers import Answer, Worker

CONNECT_TIMEOUT = "10 s"  # timeout of a scheduler


class Pool(Protocol):
    """A pool of jobs, a context manager."""

    def send_inputs(self, inputs: Mapping[str, bytes]) -> Any:
        """Input files of many jobs, as an argument of `submit`."""

    def submit(self, job: Job, inputs: Any) -> Future[dict[str, Answer]]:
        """A Future of the Answers, see Job.run."""

    def stop(self) -> None:
        """Stop all runs, each with its checkpoint."""


def open_pool(
    scheduler: str | None, workers: int, report: Report, idle: list[Worker]
) -> ThreadPool | DaskPool:
    """The pool for `workers` simultaneous runs on this machine, or the cluster of a scheduler.

    scheduler: address such as tcp://host:8786, or None. report: called from any thread. idle: list
    of `idle_workers`, for several pools one after the other. Raises DustError where no scheduler
    answers.
    """
    if scheduler is None:
        return ThreadPool(workers, report, idle)
    if importlib.util.find_spec("distributed") is None:
        raise DustError("--scheduler needs dask.distributed: pip install 'dusttaichi[cluster]'")
    return DaskPool(scheduler, report)


class ThreadPool(AbstractContextManager["ThreadPool"]):
    """A pool of threads of this process, and the Channel of its jobs."""

    def __init__(self, workers: int, report: Report, idle: list[Worker]) -> None:
        self._executor = ThreadPoolExecutor(workers)
        self._stop = threading.Event()
        self.stop, self.is_stopped, self.report = self._stop.set, self._stop.is_set, report
        self.idle = idle

    def send_inputs(self, inputs: Mapping[str, bytes]) -> Any:
        """The inputs, as an argument of `submit`."""
        return inputs

    def submit(self, job: Job, inputs: Any) -> Future[dict[str, Answer]]:
        """A Future of the Answers, see Job.run."""
        return self._executor.submit(job.run, self, inputs, self.idle)

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._executor.shutdown()


class ClientChannel:
    """Channel from a Dask task to the client: an event to stop, and a topic for reports."""

    def __init__(self, name: str) -> None:
        self.name = name

    def is_stopped(self) -> bool:
        """True once the client has stopped all runs."""
        from distributed import Event

        return bool(Event(self.name).is_set())

    def report(self, *message: Any) -> None:
        """Report to the client, see `open_pool`."""
        from distributed import get_worker

        get_worker().log_event(self.name, message)


class DaskPool(AbstractContextManager["DaskPool"]):
    """A cluster of dask.distributed. scheduler: its address."""

    def __init__(self, scheduler: str, report: Report) -> None:
        from distributed import Client, Event
        from distributed.comm.addressing import resolve_address

        try:
            # a client would refuse an invalid address only after its timeout
            self._client = Client(
                resolve_address(scheduler), timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except (OSError, ValueError, TimeoutError) as error:
            raise DustError(
                f"--scheduler {scheduler}: no scheduler answers ({error}); use an address such as "
                "tcp://host:8786"
            ) from error
        self._executor = self._client.get_executor(pure=False)
        self._channel = ClientChannel(f"dusttaichi-{uuid.uuid4().hex}")
        self._event = Event(self._channel.name, client=self._client)
        self._client.subscribe_topic(self._channel.name, lambda event: report(*event[1]))

    def send_inputs(self, inputs: Mapping[str, bytes]) -> Any:
        """Input files of many jobs, sent to the cluster once.

        They are the result of a task; scattered data would need an existing worker and end with it.
        """
        if not inputs:
            return inputs
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._client.submit(dict, inputs, pure=False)

    def submit(self, job: Job, inputs: Any) -> Future[dict[str, Answer]]:
        """A Future of the Answers, see Job.run."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            future: Future[dict[str, Answer]]
            future = self._executor.submit(job.run, self._channel, inputs)
            return future

    def stop(self) -> None:
        """Stop all runs, each with its checkpoint."""
        self._event.set()

    def __exit__(self, *_: object) -> None:
        self._client.close()
