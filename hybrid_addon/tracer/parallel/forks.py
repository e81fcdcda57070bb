# SPDX-License-Identifier: GPL-3.0-or-later
"""Forked processes that do tasks: threads would wait for the one interpreter lock.

A numpy call holds the lock only to begin and to end, but a tile makes thousands. Two threads lose a fifth to handing
the lock over, and with more than some four that takes longer than the work. A forked process has an interpreter of its
own and all that the parent had prepared, Embree's trees too, without a copy. What it finds it adds to the buffers,
which lie in shared memory; what it counted it says in one line for each task.

Only for Linux. A fork has one thread, and what the others held stays held in it: glibc and Python mend their own
locks, and a child needs no other (where another library has replaced malloc, there are no forks: `can_fork`). It
imports nothing, prints nothing, builds no tree (Embree would wait for the threads that it builds with), leaves the
graphics driver and the window alone, and ends without cleaning up. Should one wait all the same before it has begun,
its work is done by threads (`pool.SLOW_START`).
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import json
import mmap
import os
import select
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterable
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ...clock import used_elsewhere
from ..core.stats import Stats

UNMENDED = ("tbbmalloc_proxy", "tcmalloc")
"""Libraries that replace malloc, and do not mend its locks in a fork: a child would wait for ever. Some distributions'
Blenders have the first."""


def can_fork(maps: str) -> bool:
    """Whether a process with these mappings (proc_pid_maps(5)) has a malloc whose locks are mended in a fork."""
    return not any(library in maps for library in UNMENDED)


def _own_maps() -> str:
    try:
        with open("/proc/self/maps", encoding="utf-8", errors="replace") as file:
            return file.read()
    except OSError:  # not Linux, or it does not tell
        return ""


AVAILABLE = sys.platform == "linux" and can_fork(_own_maps())

NUMBER = 8
"""Bytes at the head of a task that tell it from the others, lowest first."""

LONGEST_LINE = getattr(select, "PIPE_BUF", 512)  # bytes that are written at once, whoever else writes

KEPT_MEMORY = {-1: 1 << 30, -3: 1 << 25}
"""glibc's M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of a child: what it frees it keeps. To be given memory that it has just
given back would take up to a tenth of its time."""

Work = Callable[[bytes], tuple[Stats, bool]]
"""Does a task: what was counted, and whether it came to its end."""

_libc = ctypes.CDLL(None) if AVAILABLE else None
_mallopt, _prctl = (getattr(_libc, name, None) for name in ("mallopt", "prctl"))  # not every Linux has glibc

PR_SET_PDEATHSIG = 1
"""prctl(2): which signal a process gets when the thread that has forked it ends."""


def shared_zeros(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """An array of zeros that forked processes write to as one."""
    size = prod(shape) * np.dtype(dtype).itemsize
    return np.frombuffer(mmap.mmap(-1, max(size, 1)), dtype, prod(shape)).reshape(shape)


class ForkKilled(RuntimeError):
    """A process was ended from outside."""

    def __init__(self, number: int) -> None:
        super().__init__(
            f"one of the ray tracer's processes was ended by signal {number}: if the memory ran out, "
            "fewer Threads need less"
        )


class Answer(NamedTuple):
    """To the task of this number. done: whether it came to its end; None: it failed."""

    number: int
    stats: Stats
    done: bool | None


class ForkPool:
    """Processes that do tasks until they are told that there are no more.

    Their end takes longer than the call that asks for it: giving the memory of a large process back takes 10 ms and
    more.
    """

    def __init__(self, number: int, record: int, work: Work, first: Iterable[bytes] = ()) -> None:
        """number: of processes. record: bytes of a task. work: what each does with one, on what it had at the fork.
        first: tasks that those which are there first begin with."""
        self.number = number
        tasks_out, self._tasks = os.pipe()
        self._answers, answers_in = os.pipe()
        self._text = b""
        self._at = shared_zeros((number, 2), np.int64)  # of each process the system's number, and its task's + 1
        for task in first:
            self.give(task)
        main = os.getpid()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # forks beside threads: see the head of this file
            place, self._children = _fork(number)
        if place is not None:
            os.close(self._tasks)  # or the end of the tasks would never be seen
            _end_with(main)
            _serve(tasks_out, answers_in, record, work, self._at[place], self._children)
        os.close(tasks_out)
        os.close(answers_in)

    def give(self, task: bytes) -> None:
        """Ask for a task."""
        with contextlib.suppress(BrokenPipeError):  # all processes are gone: `answers` tells
            os.write(self._tasks, task)

    def answers(self, patience: float) -> list[Answer] | None:
        """Tasks that were done, waiting for up to `patience` seconds; None: all processes have ended."""
        if not select.select([self._answers], [], [], patience)[0]:
            return []
        text = os.read(self._answers, 1 << 16)
        if not text:
            return None
        *lines, self._text = (self._text + text).split(b"\n")
        found = [_answer(line) for line in lines]
        used_elsewhere(sum(sum(answer.stats.cpu.values()) for answer in found))
        return found

    def lost(self) -> dict[int, int]:
        """Number of each task whose process is no more -> the signal that ended it."""
        at_work = [(process, task - 1) for process, task in self._at.tolist() if process and task]
        return {task: number for process, task in at_work if (number := _ended_by(process))}

    def end(self, kill: bool = False) -> None:
        """No more tasks; `kill` those that are at work. To be called once."""
        os.close(self._tasks)
        os.close(self._answers)
        if kill and self._children:
            with contextlib.suppress(ProcessLookupError):  # one that has ended waits to be fetched: it is still a group
                os.killpg(self._children[0], signal.SIGKILL)
        threading.Thread(target=_fetch, args=(self._children,), name="hybrid-forks", daemon=True).start()


def _fork(number: int) -> tuple[int | None, list[int]]:
    """Start so many processes, of one group: which of them this is, None for the one that was there before, and its own
    children.

    Each process starts half of those that are still to be started. Copying the page tables of a large one takes 10 ms
    and more, which are not to be spent once for each, one after the other.
    """
    own: list[int] = []
    place, coming, group = None, 0, 0
    while number > 0:
        half = (number + 1) // 2
        try:
            child = os.fork()
        except OSError:  # as many as the system allows: threads do what is left
            break
        if child == 0:
            place, own, coming, number = coming, [], coming + 1, half - 1
        else:
            own.append(child)
            coming, number = coming + half, number - half
        if group == 0:
            group = child or os.getpid()
        if child == 0 or place is None:  # both: nobody knows who comes first
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.setpgid(child, group)
    return place, own


def _end_with(main: int) -> None:
    """Have this child end, in the middle of a task, too, when process `main` has ended.

    The system tells of the end of who has forked it: a thread of `main`, which may end before the others, or another
    child, whose end `main` judges.
    """

    def look(*_: object) -> None:
        if _ended_by(main):
            os._exit(1)

    signal.signal(signal.SIGHUP, look)
    if _prctl is not None:
        _prctl(PR_SET_PDEATHSIG, int(signal.SIGHUP), 0, 0, 0)
    look()  # who ended before has told nobody


def _fetch(children: list[int]) -> None:
    """Wait for the end of all."""
    for child in children:
        with contextlib.suppress(ChildProcessError):  # somebody else has fetched it
            os.waitpid(child, 0)


def _ended_by(process: int) -> int:
    """The signal that ended a process, 0 if it lives (proc(5))."""
    try:
        os.kill(process, 0)
        with open(f"/proc/{process}/stat", encoding="ascii", errors="replace") as file:
            fields = file.read().rpartition(")")[2].split()
    except ProcessLookupError:
        return signal.SIGKILL
    except OSError:
        return 0
    return int(fields[-1]) & 0x7F or signal.SIGKILL if fields[0] in "ZX" else 0


def _serve(tasks: int, answers: int, record: int, work: Work, at: NDArray[np.int64], children: list[int]) -> None:
    """A child's whole life. A task that fails is done again by the parent, and fails there as it should."""
    gc.freeze()  # what came with the fork is nobody's garbage: looking at it would copy it
    try:
        if _mallopt is not None:
            for parameter, value in KEPT_MEMORY.items():
                _mallopt(parameter, value)
        at[0] = os.getpid()
        while len(task := os.read(tasks, record)) == record:
            number = int.from_bytes(task[:NUMBER], "little")
            at[1] = number + 1
            os.write(answers, _line(number, work, task))
            at[1] = 0
        os.close(answers)
        _fetch(children)
    finally:
        os._exit(0)


def _line(number: int, work: Work, task: bytes) -> bytes:
    """What is answered."""
    failed = json.dumps([number, None, {}, {}, {}]).encode() + b"\n"
    try:
        stats, done = work(task)
    except Exception:
        return failed
    counted = [number, done, stats.counts, stats.wall, stats.cpu]
    line = json.dumps(counted, separators=(",", ":")).encode() + b"\n"
    return line if len(line) <= LONGEST_LINE else failed


def _answer(line: bytes) -> Answer:
    number, done, counts, wall, cpu = json.loads(line)
    stats = Stats()
    stats.counts.update(counts)
    stats.wall.update(wall)
    stats.cpu.update(cpu)
    return Answer(number, stats, done)
