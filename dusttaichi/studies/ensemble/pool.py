"""Where the runs of an ensemble are done: by threads of this process, or by a Dask cluster.

Either way a thread only waits for the worker process of its run. Both pools have
submit(job, inputs) -> Future and stop(), and close as context managers; `share` hands out inputs
that many jobs read.
"""

import importlib.util
import threading
import uuid
import warnings
from concurrent.futures import ThreadPoolExecutor

from dusttaichi.errors import DustError
from dusttaichi.studies.ensemble.jobs import perform

CONNECT = "10 s"  # how long a scheduler may take to answer


def open_pool(scheduler, workers, report):
    """The pool for `workers` runs at a time on this machine, or the cluster of a scheduler.

    scheduler: address such as tcp://host:8786, or None. report: called with (number of the job,
    share that is done), from any thread. Raises DustError where no scheduler answers.
    """
    if scheduler is None:
        return Threads(workers, report)
    if importlib.util.find_spec("distributed") is None:
        raise DustError("--scheduler needs dask.distributed: pip install 'dusttaichi[cluster]'")
    return Dask(scheduler, report)


class Threads:
    """A pool of threads of this process."""

    def __init__(self, workers, report):
        self._executor = ThreadPoolExecutor(workers)
        self._stop = threading.Event()
        self.stop, self.stopped, self.report = self._stop.set, self._stop.is_set, report

    def share(self, inputs):
        """The inputs, in the form that `submit` takes."""
        return inputs

    def submit(self, job, inputs):
        """A Future of the JobResult."""
        return self._executor.submit(perform, job, self, inputs)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self._executor.shutdown()


class Link:
    """Link of a Dask task to the client: an event to stop, and a topic to report progress on."""

    def __init__(self, name):
        self.name = name

    def stopped(self):
        """True once the client wants all runs to end."""
        from distributed import Event

        return Event(self.name).is_set()

    def report(self, number, share):
        """Tell the client what share of a run is done."""
        from distributed import get_worker

        get_worker().log_event(self.name, [number, share])


class Dask:
    """A cluster of dask.distributed, given by the address of its scheduler."""

    def __init__(self, scheduler, report):
        from distributed import Client, Event
        from distributed.comm import resolve_address

        try:
            # of what is no address, a client would tell only after a while
            self._client = Client(resolve_address(scheduler), timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise DustError(
                f"--scheduler {scheduler}: no scheduler answers there ({error}); an address such "
                "as tcp://host:8786 is needed"
            ) from error
        self._executor = self._client.get_executor(pure=False)
        self._link = Link(f"dusttaichi-{uuid.uuid4().hex}")
        self._event = Event(self._link.name, client=self._client)
        self._client.subscribe_topic(self._link.name, lambda event: report(*event[1]))

    def share(self, inputs):
        """Files that are sent to the cluster once, however many jobs read them.

        The result of a task, and not scattered data, which would need a worker that is there
        already, and would be gone with it.
        """
        if not inputs:
            return inputs
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._client.submit(dict, inputs, pure=False)

    def submit(self, job, inputs):
        """A Future of the JobResult."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph")
            return self._executor.submit(perform, job, self._link, inputs)

    def stop(self):
        """Let all runs end early, each with its checkpoint."""
        self._event.set()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._client.close()
