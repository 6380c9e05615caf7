"""Engines that compute the cells of a map over parameters: threads of this machine, or the workers of a cluster.

An engine hands over answers as they come; nothing depends on their order.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any

from ._cells import Cell, Done, Job, computed, failed, ready, sentence
from ._errors import ArgumentError, Error
from ._studies import _depth

#: Called with each answer, and whether it may be stored.
Deliver = Callable[[Done, bool], None]

#: Largest fraction of the time of a worker that a task may cost beside the cells in it.
COST = 0.05
#: Largest fraction of the time of the scheduler that a map may take.
LOAD = 0.5
#: Longest time of a group, in seconds: what is lost with a worker.
LONGEST = 60.0
#: Groups that each thread has at the end of a map, at least, so that none waits long for the last one.
EVEN = 4
#: Number of times that a group is submitted again after its result was lost.
TRIES = 3
#: Seconds between looks for answers, and without any before the workers are counted.
PAUSE, ALONE = 0.002, 30.0
#: Number of parts in which a group is tried again whose workers died.
PARTS = 8
#: Number of tasks before the time of a cell is known, and seconds for which that is waited for.
FIRST, WAIT = 32, 1.0
#: Reason why a cell has no value whose workers died several times, each time while nothing else was computed.
KILLED = "every worker that computed this cell died"


def group_size(task: float, cell: float, threads: int, left: int) -> int:
    """Returns how many cells to compute in one task.

    A task costs the scheduler the time `task`, one after the other for all threads, and each thread no more than that. With g cells that
    take the time `cell` each, the cost to a thread is task/(g cell), and the scheduler is busy for threads task/(g cell) of the time.
    """
    cell = max(cell, 1e-6)
    least = task / cell * max(1.0 / COST, threads / LOAD)
    most = max(min(LONGEST / cell, left / (EVEN * threads)), least / EVEN)
    return max(1, min(math.ceil(least), math.floor(most), left))


class Threads:
    """Threads of this process. The compiled half releases the interpreter's lock."""

    def __init__(self, job: Job, jobs: int) -> None:
        self.job = job
        self.threads = jobs
        self.tasks = 0
        # A thread costs nothing that could be measured.
        self.task, self.prepared = 0.0, 0.0

    def compute(self, cells: Sequence[Cell], deliver: Deliver) -> None:
        """Computes cells."""
        self.tasks += len(cells)
        if self.threads == 1 or len(cells) == 1:
            for cell in cells:
                deliver(self.job.at(cell), True)
            return
        pool = ThreadPoolExecutor(self.threads, thread_name_prefix="foldline-map")
        rest = list(reversed(cells))
        running: set[Future[Done]] = set()
        try:
            while True:
                while rest and len(running) < 2 * self.threads:
                    running.add(pool.submit(self.job.at, rest.pop()))
                if not running:
                    break
                ended, running = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in ended:
                    deliver(future.result(), True)
        finally:
            # After Ctrl-C the cells in progress are abandoned.
            pool.shutdown(wait=False, cancel_futures=True)


class Cluster:
    """Workers of `dask.distributed`. The size of groups follows from the times of the first cells."""

    def __init__(self, job: Job, client: Any) -> None:
        import cloudpickle

        self.client = client
        try:
            self.payload: bytes = cloudpickle.dumps(job)
        except Exception as error:
            cure = "a function that refers to no files, locks, solutions of `settle` or open connections"
            raise ArgumentError(f"the map cannot be sent to workers: {sentence(error)}\n  help: {cure}") from error
        self.tasks = 0
        self.task, self.prepared = 0.0, 0.0
        self._spent, self._count = 0.0, 0
        self._counted, self._threads = -math.inf, 1
        self._heard = time.monotonic()

    @property
    def threads(self) -> int:
        """Number of threads of all workers at present; at least 1."""
        now = time.monotonic()
        if now - self._counted > 2.0:
            self._threads = max(sum(self.client.nthreads().values()), 1)
            self._counted = now
        return self._threads

    def _prepare(self) -> None:
        """Checks the workers, and measures what a task costs."""
        begun = time.perf_counter()
        for _ in range(2):
            start = time.perf_counter()
            tried = [self.client.submit(ready, self.payload, pure=False) for _ in range(min(4 * self.threads, 64))]
            try:
                self.client.gather(tried)
            except Error as error:
                raise ArgumentError(str(error)) from error
            except Exception as error:
                cure = "the same environment on all machines; modules of your own with client.upload_file('module.py')"
                raise ArgumentError(f"the workers cannot compute this map: {sentence(error)}\n  help: {cure}") from error
            self.task = (time.perf_counter() - start) / len(tried)
        self.prepared = time.perf_counter() - begun

    def compute(self, cells: Sequence[Cell], deliver: Deliver) -> None:
        """Computes cells."""
        if not self.task:
            self._prepare()
        suspects: list[Cell] = []
        self._all(list(reversed(cells)), 2, deliver, suspects.append)
        # Workers that died had several tasks each. A cell that still ends workers when nothing else is computed is guilty.
        for cell in suspects:
            self._all([cell], 0, deliver, lambda cell: deliver((cell, failed(KILLED), 0.0), False))

    def _all(self, queue: list[Cell], ahead: int, deliver: Deliver, killed: Callable[[Cell], None]) -> None:
        """Computes the cells of a queue, with so many tasks ahead for each thread; hands over those whose workers died."""
        import distributed

        dask: Any = distributed
        groups: dict[Any, tuple[list[Cell], int]] = {}
        again: list[tuple[list[Cell], int]] = []
        answers = dask.as_completed(with_results=True, raise_errors=False)
        begun = time.monotonic()
        try:
            while queue or again or groups:
                while (queue or again) and len(groups) < self._ahead(ahead, time.monotonic() - begun):
                    group, tries = again.pop() if again else (self._taken(queue), 0)
                    future = self.client.submit(computed, self.payload, group, pure=False)
                    groups[future.key] = group, tries
                    self.tasks += 1
                    answers.add(future)
                for future, found in self._ended(answers):
                    group, tries = groups.pop(future.key)
                    error = found[1] if isinstance(found, tuple) and len(found) == 3 else found
                    if future.status == "finished":
                        self._hand_over(found, deliver)
                    elif future.status != "error" and tries < TRIES:
                        again.append((group, tries + 1))
                    elif future.status != "error":
                        for cell in group:
                            deliver((cell, failed(f"the result was lost {tries + 1} times, together with its worker"), 0.0), False)
                    elif not isinstance(error, dask.KilledWorker):
                        message = sentence(error) if isinstance(error, BaseException) else str(error)
                        raise Error(f"a worker failed outside the cells: {message}\n  help: client.get_worker_logs() shows the logs")
                    elif len(group) == 1:
                        killed(group[0])
                    else:
                        size = math.ceil(len(group) / PARTS)
                        again += [(group[k : k + size], 0) for k in range(0, len(group), size)]
                    future.release()
        finally:
            if groups:
                self.client.cancel([own for own in list(answers.futures) if own.key in groups])

    def _ahead(self, each: int, since: float) -> int:
        """Number of tasks to have out. Few at first, so that the time of a cell is known before the others are grouped."""
        most = max(each * self.threads, 1)
        return most if self._count or since > WAIT else min(most, FIRST)

    def _ended(self, answers: Any) -> list[tuple[Any, Any]]:
        """Waits for answers, or a second for the first one; warns if there are no workers that could give any."""
        begun = time.monotonic()
        while True:
            batch: list[tuple[Any, Any]] = answers.next_batch(block=False)
            now = time.monotonic()
            if batch:
                self._heard = now
                return batch
            if not self._count and now - begun > WAIT:
                return []
            if self.client.status != "running":
                cure = "with out= the answers so far are kept; repeat the call with a new client"
                raise Error(f"the client is {self.client.status}\n  help: {cure}")
            if now - self._heard > ALONE:
                self._heard = now
                if not self.client.nthreads():
                    warnings.warn("the cluster has no workers; the map waits for new ones, and Ctrl-C ends it", stacklevel=_depth())
            time.sleep(PAUSE)

    def _taken(self, queue: list[Cell]) -> list[Cell]:
        size = group_size(self.task, self._spent / self._count, self.threads, len(queue)) if self._count else 1
        return [queue.pop() for _ in range(size)]

    def _hand_over(self, found: Sequence[Done], deliver: Deliver) -> None:
        for done in found:
            self._spent += done[2]
            self._count += 1
            deliver((tuple(done[0]), done[1], done[2]), True)


def engine_of(job: Job, client: Any, jobs: int) -> Threads | Cluster:
    """Returns the engine for a client of dask, or for threads if there is none."""
    if client is None:
        return Threads(job, jobs)
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError('a map on a cluster needs dask.distributed: pip install "foldline[cluster]"') from error
    call = "client=Client(cluster), where Client is that of dask.distributed"
    if not isinstance(client, Client):
        raise ArgumentError(f"client must be a client of dask.distributed, but got a value of type {type(client).__name__}\n  help: {call}")
    if client.asynchronous:
        raise ArgumentError("the client is asynchronous\n  help: Client(cluster) without asynchronous=True")
    if client.status != "running":
        raise ArgumentError(f"the client is {client.status}\n  help: {call}")
    return Cluster(job, client)
