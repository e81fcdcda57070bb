# SPDX-License-Identifier: GPL-3.0-or-later
"""Who does the work: threads, or forked processes that stay for the next work.

A task is a plain record, and what it is about lies in memory that all share: so a process that was forked for the first
pass over a picture does tasks of the later ones, too. To fork takes some milliseconds for each process.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from functools import partial
from struct import Struct
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ...scene import Settings
from ..core.stats import Stats
from .forks import AVAILABLE, ForkKilled, ForkPool, shared_zeros

POLL_SECONDS = 0.1
"""How often the caller hears of progress, and may cancel."""

MOST_THREADS = 4
"""At once, where there are no processes: more wait for the interpreter lock. On 16 cores 16 threads take 1.3 to 1.7
times as long as four, in a deep scene as long as one."""

FEWEST = 2
"""Processes: two are up to twice as fast as one thread, two threads at most one and a half times."""

SLOW_START = 10.0
"""Seconds after which a forked process that has not begun its task never will: it may wait for something that another
thread held when it was forked."""

SLOTS = 1 << 12
"""Tasks, of all that were begun and not finished, whose progress is told apart: far more than there are processes."""

Zeros = Callable[[tuple[int, ...], DTypeLike], NDArray[Any]]
"""Makes arrays of zeros: `zeros_for` those that all who work write to as one."""

Finished = Callable[[Stats], None]
Watch = Callable[[], None]


class Task(NamedTuple):
    """What to do with numbers `start` to `stop` on the board: see `Passes`. number: its own, in one piece of work."""

    number: int
    start: int
    stop: int
    kind: int
    first: int = 0
    samples: int = 0
    spread: bool = False
    signed: bool = False
    deadline: float = 0.0


RECORD = Struct("<qqqiii??d")

Do = Callable[[Task], tuple[Stats, bool]]
"""Does a task: what was counted, and whether it came to its end in time."""


def wanted_workers(settings: Settings) -> int:
    """How many are to work at once."""
    return settings.threads or os.cpu_count() or 1


def workers(settings: Settings) -> int:
    """How many threads work at once."""
    return min(wanted_workers(settings), MOST_THREADS)


def has_forks(settings: Settings) -> bool:
    """Whether there may be processes."""
    return settings.processes and AVAILABLE


def zeros_for(settings: Settings) -> Zeros:
    """What makes arrays of zeros that all who work write to as one."""
    return shared_zeros if has_forks(settings) else np.zeros


class WorkerPool:
    """Does tasks, those of one piece of work after those of another.

    forks : there may be processes.   begun : (SLOTS,) how far tasks have come, for `slot`.
    stop  : is set when the work is given up.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.forks = has_forks(settings)
        self.stop = threading.Event()
        self.begun = zeros_for(settings)((SLOTS,), np.int64)
        self._processes: ForkPool | None = None

    def slot(self, task: Task) -> NDArray[np.int64]:
        """(1,) where to note how far it has come."""
        place = task.number % SLOTS
        return self.begun[place : place + 1]

    def so_far(self) -> int:
        """How far all tasks of the work have come."""
        return int(self.begun.sum())

    @property
    def has_processes(self) -> bool:
        """Whether some were started."""
        return self._processes is not None

    def many(self) -> int:
        """How many work at once on what needs no new process."""
        return workers(self._settings) if self._processes is None else self._processes.number

    def run(
        self, do: Do, tasks: Sequence[Task], forked: bool, finished: Finished, watch: Watch, threads: int = 0
    ) -> bool:
        """Do them all; whether all came to their end in time.

        threads : that work where no process does; 0: as many as are worth it where each waits for the interpreter.

        do     : always the same. Processes know what it did when they were started: for the first work for some.
        forked : by processes, started now if need be; else by those that are there, or by threads.
        """
        self.begun[:] = 0
        left, in_time = list(tasks), True
        wanted = min(wanted_workers(self._settings), len(tasks)) if forked else 0
        if wanted or self._processes is not None:
            try:
                left, in_time = self._over_processes(wanted, do, left, finished, watch)
            except BaseException:
                self.end(kill=True)
                raise
        return self._over_threads(do, left, finished, watch, threads or workers(self._settings)) and in_time

    def end(self, kill: bool = False) -> None:
        """Let the processes go."""
        if self._processes is not None:
            self._processes.end(kill)
            self._processes = None

    def _over_threads(self, do: Do, tasks: list[Task], finished: Finished, watch: Watch, threads: int) -> bool:
        """Do tasks; whether all came to their end in time."""
        in_time, waiting = True, iter(tasks)
        pending: set[Future[tuple[Stats, bool]]] = set()
        with ThreadPoolExecutor(threads, thread_name_prefix="hybrid-tracer") as pool:
            try:
                # A short queue: cancelling must not wait for tasks that nobody has begun.
                while True:
                    while in_time and len(pending) < 2 * threads and (task := next(waiting, None)) is not None:
                        pending.add(pool.submit(do, task))
                    if not pending:
                        return in_time
                    complete, pending = wait(pending, POLL_SECONDS, FIRST_COMPLETED)
                    for future in complete:
                        stats, ended = future.result()
                        finished(stats)
                        in_time &= ended
                    watch()
            except BaseException:
                self.stop.set()
                raise

    def _over_processes(
        self, wanted: int, do: Do, tasks: list[Task], finished: Finished, watch: Watch
    ) -> tuple[list[Task], bool]:
        """Do tasks; which are left, because they failed, and whether the others were in time.

        wanted : processes at least; 0: those that are there.
        """
        # Start as many as are wanted, with some tasks to begin with, or give these to those that are there.
        processes = self._processes
        number = wanted if processes is None else max(wanted, processes.number)
        ahead, waiting = tasks[: 2 * number], iter(tasks[2 * number :])
        if processes is None or processes.number < wanted:
            self.end()
            processes = ForkPool(wanted, RECORD.size, partial(_do_record, do), (RECORD.pack(*task) for task in ahead))
            self._processes = processes
        else:
            for task in ahead:
                processes.give(RECORD.pack(*task))
        asked, in_time = {task.number: task for task in ahead}, True
        # For each answer give one more.
        failed: list[Task] = []
        seen, since = 0, time.perf_counter()
        while asked:
            answers = processes.answers(POLL_SECONDS)
            if answers is None:  # there are none
                self.end()
                return [*failed, *asked.values(), *waiting], in_time
            for number, stats, done in answers:
                task = asked.pop(number)
                if done is None:
                    failed.append(task)
                else:
                    finished(stats)
                    in_time &= done
                following = next(waiting, None) if in_time else None
                if following is not None:
                    asked[following.number] = following
                    processes.give(RECORD.pack(*following))
            # Whether somebody has ended one of them, or none of them begins.
            watch()
            if not answers:
                killed = [ended_by for number, ended_by in processes.lost().items() if number in asked]
                if killed:
                    raise ForkKilled(killed[0])
            so_far = self.so_far()
            if answers or so_far != seen:
                seen, since = so_far, time.perf_counter()
            elif time.perf_counter() - since > SLOW_START and not any(self.slot(task)[0] for task in asked.values()):
                self.end(kill=True)  # none of them has added anything yet
                return [*failed, *asked.values(), *waiting], in_time
        return failed if in_time else [], in_time


def _do_record(do: Do, record: bytes) -> tuple[Stats, bool]:
    return do(Task(*RECORD.unpack(record)))
