"""Where the runs of an ensemble are done: threads of this process, or dask.distributed.

Either way a worker only waits for the process of its run, so threads are enough. Both pools have
submit(job, inputs) -> Future, stop(), and close; `share` hands out inputs that many jobs read.
"""

import importlib.util
import logging
import os
import threading
import uuid
import warnings
from concurrent.futures import ThreadPoolExecutor

from dusttaichi.errors import DustError
from dusttaichi.studies.ensemble.jobs import perform

CONNECT = "10 s"  # how long a scheduler may take to answer


def usable_cores():
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def open_pool(scheduler, workers, heard):
    """The pool for `workers` runs at a time on this machine, or the cluster of a scheduler.

    scheduler: address such as tcp://host:8786, or None. heard: called with (number of the job,
    share that is done), from any thread. Raises DustError where no scheduler answers.
    """
    if importlib.util.find_spec("distributed") is None:
        if scheduler is not None:
            raise DustError("--scheduler needs dask.distributed: pip install 'dusttaichi[cluster]'")
        return Threads(workers, heard)
    return Dask(scheduler, workers, heard)


class Threads:
    """A pool of threads of this process."""

    def __init__(self, workers, heard):
        self._executor = ThreadPoolExecutor(workers)
        self._stop = threading.Event()
        self.stop, self.stopped, self.tell = self._stop.set, self._stop.is_set, heard

    def share(self, inputs):
        return inputs

    def submit(self, job, inputs):
        return self._executor.submit(perform, job, self, inputs)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self._executor.shutdown()


class Link:
    """What a Dask task knows of the client: an event to stop, and a topic to tell progress on."""

    def __init__(self, name):
        self.name = name

    def stopped(self):
        from distributed import Event

        return Event(self.name).is_set()

    def tell(self, number, share):
        from distributed import get_worker

        get_worker().log_event(self.name, [number, share])


class Dask:
    """A cluster of dask.distributed, given by its scheduler, or one in this process."""

    def __init__(self, scheduler, workers, heard):
        from distributed import Client, Event, LocalCluster
        from distributed.comm import resolve_address

        self._cluster = None
        if scheduler is None:
            self._cluster = LocalCluster(
                n_workers=1,
                threads_per_worker=workers,
                processes=False,
                dashboard_address=":0",  # any free port
                silence_logs=logging.ERROR,
            )
        try:
            # of what is no address, a client would tell only after a while
            at = self._cluster or resolve_address(scheduler)
            self._client = Client(at, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise DustError(
                f"--scheduler {scheduler}: no scheduler answers there ({error}); an address such "
                "as tcp://host:8786 is needed"
            ) from error
        self._executor = self._client.get_executor(pure=False)
        self._link = Link(f"dusttaichi-{uuid.uuid4().hex}")
        self._event = Event(self._link.name, client=self._client)
        self._client.subscribe_topic(self._link.name, lambda event: heard(*event[1]))

    def share(self, inputs):
        return self._client.scatter(inputs, hash=False) if inputs else inputs

    def submit(self, job, inputs):
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._executor.submit(perform, job, self._link, inputs)

    def stop(self):
        self._event.set()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()
