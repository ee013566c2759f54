"""Pools for the jobs of a study: threads of this process, or a Dask cluster.

Each thread only waits for the worker process of its job. Here a process makes one job after the
other, so that those of the same structure share its start and its kernels. Both pools have
submit(job, inputs) -> Future and stop(), are context managers, and `share` inputs of many jobs.
"""

import importlib.util
import threading
import uuid
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager

from dusttaichi.errors import DustError

CONNECT = "10 s"  # timeout of a scheduler


def open_pool(scheduler, workers, report, idle):
    """The pool for `workers` simultaneous runs on this machine, or the cluster of a scheduler.

    scheduler: address such as tcp://host:8786, or None. report: called from any thread with (label
    of the point, share that is done, keywords of its Answer or None). idle: list of `idle_workers`,
    for several pools one after the other. Raises DustError where no scheduler answers.
    """
    if scheduler is None:
        return Threads(workers, report, idle)
    if importlib.util.find_spec("distributed") is None:
        raise DustError("--scheduler needs dask.distributed: pip install 'dusttaichi[cluster]'")
    return Dask(scheduler, report)


class Threads(AbstractContextManager):
    """A pool of threads of this process."""

    def __init__(self, workers, report, idle):
        self._executor = ThreadPoolExecutor(workers)
        self._stop = threading.Event()
        self.stop, self.stopped, self.report = self._stop.set, self._stop.is_set, report
        self.idle = idle

    def share(self, inputs):
        """The inputs, as an argument of `submit`."""
        return inputs

    def submit(self, job, inputs):
        """A Future of the Answers, see Job.do."""
        return self._executor.submit(job.do, self, inputs)

    def __exit__(self, *_):
        self.stop()
        self._executor.shutdown()


class Link:
    """Link of a Dask task to the client: an event to stop, and a topic to report progress on."""

    def __init__(self, name):
        self.name = name

    def stopped(self):
        """True once the client has stopped all runs."""
        from distributed import Event

        return Event(self.name).is_set()

    def report(self, *news):
        """Report to the client, see `open_pool`."""
        from distributed import get_worker

        get_worker().log_event(self.name, news)


class Dask(AbstractContextManager):
    """A cluster of dask.distributed. scheduler: its address."""

    def __init__(self, scheduler, report):
        from distributed import Client, Event
        from distributed.comm import resolve_address

        try:
            # a client would refuse an invalid address only after its timeout
            self._client = Client(resolve_address(scheduler), timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise DustError(
                f"--scheduler {scheduler}: no scheduler answers ({error}); use an address such as "
                "tcp://host:8786"
            ) from error
        self._executor = self._client.get_executor(pure=False)
        self._link = Link(f"dusttaichi-{uuid.uuid4().hex}")
        self._event = Event(self._link.name, client=self._client)
        self._client.subscribe_topic(self._link.name, lambda event: report(*event[1]))

    def share(self, inputs):
        """Input files of many jobs, sent to the cluster once.

        They are the result of a task; scattered data would need an existing worker and end with it.
        """
        if not inputs:
            return inputs
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._client.submit(dict, inputs, pure=False)

    def submit(self, job, inputs):
        """A Future of the Answers, see Job.do."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._executor.submit(job.do, self._link, inputs)

    def stop(self):
        """Stop all runs, each with its checkpoint."""
        self._event.set()

    def __exit__(self, *_):
        self._client.close()
