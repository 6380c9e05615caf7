"""Simulates the scheduling of a map over parameters on a large cluster: 10^6 cells on 1,000 threads.

The client and the scheduler are one server, which spends a fixed time on each task. Every thread has up to two tasks. When it ends one,
the server takes the answer, forms the next group and sends it. Group sizes are those of the package, `foldline._engines.group_size`.
Times of cells follow a gamma distribution. No cell is computed.

    python benches/cluster/simulate.py
"""

import argparse
import heapq

import numpy as np

from foldline._engines import EVEN, FIRST, WAIT, group_size

LATENCY = 1e-3


def simulated(cells, threads, task, cell, variation, seed=1, single=False):
    """Returns the total time, the number of tasks and the largest group."""
    random = np.random.default_rng(seed)
    shape = 1.0 / variation**2

    def duration(size):
        # Sum of `size` gamma-distributed times; the worker spends `task` besides.
        return task + random.gamma(size * shape, cell / shape)

    left, free, tasks, largest = cells, 0.0, 0, 0
    spent, count = 0.0, 0
    queued = [[] for _ in range(threads)]
    busy = [False] * threads
    events = []

    def send(worker, now):
        """Forms a group and sends it; the server is busy for the time of a task."""
        nonlocal left, free, tasks, largest
        if left == 0:
            return
        size = 1 if single or not count else group_size(task, spent / count, threads, left)
        left -= size
        tasks += 1
        largest = max(largest, size)
        free = max(free, now) + task
        heapq.heappush(events, (free + LATENCY, 0, worker, size, 0.0))

    def begin(worker, size, now):
        took = duration(size)
        busy[worker] = True
        heapq.heappush(events, (now + took, 1, worker, size, took - task))

    # Few tasks until the time of a cell is known, or for a second.
    first = min(FIRST, threads)
    for worker in range(first):
        send(worker, 0.0)
    waiting, last = True, 0.0
    while events:
        if waiting and (count or events[0][0] > WAIT):
            waiting = False
            now = last if count else WAIT
            for number in range(2 * threads - first):
                send((first + number) % threads, now)
        now, kind, worker, size, took = heapq.heappop(events)
        if kind == 0:
            if busy[worker]:
                queued[worker].append(size)
            else:
                begin(worker, size, now)
            continue
        last, busy[worker] = now, False
        spent, count = spent + took, count + size
        if queued[worker]:
            begin(worker, queued[worker].pop(), now)
        send(worker, now)
    return last, tasks, largest


def main():
    """Prints a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--threads", type=int, default=1_000)
    parser.add_argument("--variation", type=float, default=1.0, help="standard deviation of the time of a cell, relative to its mean")
    own = parser.parse_args()
    print(f"{own.cells} cells on {own.threads} threads; time of a cell with a variation of {own.variation:g}")
    print(f"every thread has {EVEN} groups at the end")
    print()
    print("task [ms]  cell [s]   ideal [s]  total [s]  efficiency    tasks  largest group  one cell a task")
    for task in (0.3e-3, 1e-3, 3e-3):
        for cell in (1e-3, 1e-2, 1e-1, 1.0, 10.0):
            ideal = own.cells * cell / own.threads
            total, tasks, largest = simulated(own.cells, own.threads, task, cell, own.variation)
            # Without groups the scheduler alone needs the time of all tasks.
            single = ideal / max(ideal * (1 + task / cell), own.cells * task)
            print(
                f"{1e3 * task:9.1f}  {cell:8g}  {ideal:10.4g} {total:10.4g}  {ideal / total:10.3f} "
                f"{tasks:8d}  {largest:13d}  {single:15.3f}"
            )


if __name__ == "__main__":
    main()
