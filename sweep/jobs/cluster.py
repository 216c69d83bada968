"""Tasks on a Dask cluster: processes of this machine, or the cluster at a scheduler's address.

A worker learns from the scheduler that it has to stop: a flag while its results are still wanted, the loss of its task
once the program that submitted it is gone.  A task whose worker dies is given to another worker.
"""

from __future__ import annotations

import math
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from sweep.errors import InputError, WorkerDied, extra
from sweep.jobs.signals import Stop, unheard

if TYPE_CHECKING:
    from sweep.jobs.executors import Task

T = TypeVar("T")

GRACE = 2.0  # for workers to return their results after a stop [s]
ASK_SECONDS = 0.25  # between two queries of a task to the scheduler
COUNT_SECONDS = 2.0  # between two counts of the cluster's threads
CONNECT_SECONDS = 20
CLOSE_SECONDS = 10
FIRST_WORKER_SECONDS = 60.0
POLL = 0.05  # between two checks of the flag [s]


class Dask:
    """A Dask cluster; used as a context manager it keeps its workers from one call to the next.

    Parameters
    ----------
    address : of a scheduler, such as ``tcp://10.0.0.1:8786``; None for one worker process per job on this machine
    """

    def __init__(self, address: str | None = None) -> None:
        self.address = address
        self._client: Any = None
        self._cluster: Any = None
        self._counted, self._threads = -math.inf, 0

    def __enter__(self) -> Dask:
        return self

    def __exit__(self, *_: object) -> None:
        client, cluster, self._client, self._cluster = self._client, self._cluster, None, None
        for resource in (client, cluster):
            if resource is not None:
                with suppress(TimeoutError):  # workers of this machine end with this process at the latest
                    resource.close(timeout=CLOSE_SECONDS)

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """Yield results as `Executor.outcomes` does; a cluster at an address gets a task per thread, and one more."""
        client = self._connected(jobs)
        from distributed import Event, KilledWorker

        name = f"linksweep-{uuid.uuid4().hex}"
        flag = Event(name, client)
        stop.tell(lambda: client.loop.add_callback(flag.set))  # a signal handler cannot wait for the scheduler
        pool = client.get_executor(pure=False)
        try:
            yield from _flow(lambda n: pool.submit(_at_worker, task, n, name), numbers, self._jobs(jobs), stop)
        except KilledWorker as error:
            raise WorkerDied(f"several workers died over one task ({error})") from error
        except CancelledError as error:
            raise WorkerDied(f"the Dask scheduler at {client.scheduler.address} is gone") from error
        finally:
            pool.shutdown(wait=False)  # cancels pending tasks

    def _connected(self, jobs: int) -> Any:
        if self._client is not None:
            return self._client
        try:
            from distributed import Client, LocalCluster
        except ImportError as error:
            allowed = f"a backend whose package is installed: {extra('dask')} ({error})"
            raise InputError("backend", "dask", allowed, "run") from None
        with unheard():
            try:
                if self.address is None:
                    self._cluster = LocalCluster(n_workers=jobs, threads_per_worker=1, dashboard_address="127.0.0.1:0")
                self._client = Client(self._cluster or self.address, timeout=CONNECT_SECONDS)
                self._client.wait_for_workers(1, timeout=FIRST_WORKER_SECONDS)
            except RuntimeError as error:
                self.__exit__()
                raise WorkerDied(f"the processes of a Dask cluster did not come up ({error})") from error
            except (OSError, ValueError, TimeoutError) as error:
                self.__exit__()
                where = self.address or "this machine"
                raise InputError("backend", f"dask={where}", f"a scheduler with workers ({error})", "run") from error
        sys.stderr.write(f"linksweep: Dask dashboard at {self._client.dashboard_link}\n")
        return self._client

    def _jobs(self, jobs: int) -> Callable[[], int]:
        """Return a function that gives the present number of workers; those of a cluster may come and go."""

        def now() -> int:
            if time.monotonic() - self._counted > COUNT_SECONDS:
                self._counted, self._threads = time.monotonic(), sum(self._client.nthreads().values())
            return max(self._threads, 1)

        return (lambda: jobs) if self.address is None else now


def _at_worker(task: Task[T], number: int, name: str) -> T:
    from distributed import Event, get_worker

    worker = get_worker()
    key = worker.get_current_task()
    flag = Event(name, worker.client)
    queried, stopped = -math.inf, False

    def should_stop() -> bool:
        nonlocal queried, stopped
        if not stopped and time.monotonic() - queried > ASK_SECONDS:
            state = worker.state.tasks.get(key)
            lost = state is None or state.state == "cancelled"  # nobody waits for the result any more
            stopped = lost or flag.is_set()
            queried = time.monotonic()
        return stopped

    return task(number, should_stop)


def _flow(
    submit: Callable[[int], Future[T]],
    numbers: Iterator[int],
    jobs: Callable[[], int],
    stop: Stop,
) -> Iterator[T]:
    """Yield outcomes as they become ready; one task more than there are workers is queued, so that no worker waits.

    Parameters
    ----------
    submit : submits the task of a number
    numbers, stop : as for `Executor`
    jobs : returns the present number of workers
    """
    waiting: set[Future[T]] = set()
    deadline = math.inf
    while True:
        while not stop and len(waiting) <= jobs() and (number := next(numbers, None)) is not None:
            waiting.add(submit(number))
        if not waiting or time.monotonic() > deadline:
            return
        done, waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()
        if stop and deadline == math.inf:
            deadline = time.monotonic() + GRACE
