"""Portions over forked processes: threads would wait for the one interpreter lock.

A numpy call holds the lock only to begin and to end, but a portion makes thousands. Two threads lose a fifth to handing
the lock over, and with more than some four that takes longer than the work. A forked process has an interpreter of its
own and all that the parent had made ready, Embree's trees too, without a copy. What it finds it adds to the totals,
which lie in shared memory; what it counted it says in one line for each portion.

Only for Linux. A fork has one thread, and what the others held stays held in it: glibc and Python mend their own
locks, and a child needs no other. It imports nothing, prints nothing, builds no tree (Embree would wait for the threads
that it builds with), leaves the graphics driver and the window alone, and ends without cleaning up. Should one wait all
the same before it has begun, its work is done by threads (`passes.SLOW_START`).
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
from collections.abc import Callable
from math import prod

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .tally import Tally

AVAILABLE = sys.platform == "linux"

FEWEST = 2
"""Processes: two are up to twice as fast as one thread, two threads at most one and a half times (`passes`)."""

WORTH_IT = 1 << 15
"""Camera rays, below which starting processes, some milliseconds each, and copying what they touch cost too much."""

RECORD = 8  # bytes of a portion's number; far below PIPE_BUF, so whole records are read and written
BY_SIGNAL = 128
"""Exit codes over this say that a process of one's own was ended by a signal, as those of shells do."""

LONGEST_LINE = getattr(select, "PIPE_BUF", 512)  # bytes that are written at once, whoever else writes

KEPT_MEMORY = {-1: 1 << 30, -3: 1 << 25}
"""glibc's M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of a child: what it frees it keeps. To be given memory that it has just
given back would take up to a tenth of its time."""

Work = Callable[[int], tuple[Tally, bool]]
"""Does the portion of this number: what was counted, and whether it came to its end."""


_mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if AVAILABLE else None  # not every Linux has glibc


def shared_zeros(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray:
    """An array of zeros that forked processes write to as one."""
    size = prod(shape) * np.dtype(dtype).itemsize
    return np.frombuffer(mmap.mmap(-1, max(size, 1)), dtype, prod(shape)).reshape(shape)


class ForkKilled(RuntimeError):
    """A process was ended from outside."""


class Forks:
    """Processes that do portions; to be used in a `with`, at whose end none works any more.

    Their end takes longer than that of the `with`: giving the memory of a large process back takes 10 ms and more.

    number : of processes.   work : what each does with a portion's number, on what it had at the fork.
    """

    def __init__(self, number: int, work: Work) -> None:
        jobs_out, self._jobs = os.pipe()
        self._answers, answers_in = os.pipe()
        self._text = b""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # forks beside threads: see the head of this file
            is_parent, self._children = _fork(number)
        if not is_parent:
            os.close(self._jobs)  # or the end of the jobs would never be seen
            _serve(jobs_out, answers_in, work, self._children)
        os.close(jobs_out)
        os.close(answers_in)

    def __enter__(self) -> Forks:
        return self

    def __exit__(self, *_: object) -> None:
        self.no_more()
        if self._children:
            with contextlib.suppress(ProcessLookupError):  # one that has ended waits to be fetched: it is still a group
                os.killpg(self._children[0], signal.SIGKILL)
        threading.Thread(target=_fetch, args=(self._children,), name="hybrid-forks", daemon=True).start()
        os.close(self._answers)

    def check(self) -> None:
        """When all have ended: raises ForkKilled if not by themselves, for then nobody knows what they have added."""
        killed = _fetch(self._children)
        if killed:
            raise ForkKilled(
                f"one of the ray tracer's processes was ended by signal {killed}: if the memory ran out, "
                "fewer Threads need less"
            )

    def give(self, portion: int) -> None:
        """Ask for a portion."""
        with contextlib.suppress(BrokenPipeError):  # all processes are gone: `answers` tells
            os.write(self._jobs, portion.to_bytes(RECORD, "little"))

    def no_more(self) -> None:
        """The processes end when they have done what was asked for."""
        if self._jobs >= 0:
            os.close(self._jobs)
            self._jobs = -1

    def answers(self, patience: float) -> list[tuple[int, Tally, bool]] | None:
        """Portions that were done, waiting for up to `patience` seconds; None: all processes have ended."""
        if not select.select([self._answers], [], [], patience)[0]:
            return []
        text = os.read(self._answers, 1 << 16)
        if not text:
            return None
        *lines, self._text = (self._text + text).split(b"\n")
        return [_answer(line) for line in lines]


def _fork(number: int) -> tuple[bool, list[int]]:
    """Start so many processes, of one group; whether this is the one that was there before, and its own children.

    Each process starts half of those that are still to be started. Copying the page tables of a large one takes 10 ms
    and more, which are not to be spent once for each, one after the other.
    """
    own: list[int] = []
    is_parent, group = True, 0
    while number > 0:
        half = (number + 1) // 2
        try:
            child = os.fork()
        except OSError:  # as many as the system allows: threads do what is left
            break
        if child == 0:
            is_parent, own, number = False, [], half - 1
        else:
            own.append(child)
            number -= half
        if group == 0:
            group = child or os.getpid()
        if child == 0 or is_parent:  # both: nobody knows who comes first
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.setpgid(child, group)
    return is_parent, own


def _fetch(children: list[int]) -> int:
    """Wait for the end of all; the signal that ended one of them, or one of theirs, 0 for none."""
    found = 0
    while children:
        with contextlib.suppress(ChildProcessError):  # somebody else has fetched it
            code = os.waitstatus_to_exitcode(os.waitpid(children.pop(), 0)[1])
            found = found or -min(code, 0) or max(code - BY_SIGNAL, 0)
    return found


def _serve(jobs: int, answers: int, work: Work, children: list[int]) -> None:
    """A child's whole life. A portion that fails is not answered: the parent does it again, and fails as it should."""
    code = 1
    gc.freeze()  # what came with the fork is nobody's garbage: looking at it would copy it
    try:
        if _mallopt is not None:
            for parameter, value in KEPT_MEMORY.items():
                _mallopt(parameter, value)
        while len(job := os.read(jobs, RECORD)) == RECORD:
            portion = int.from_bytes(job, "little")
            tally, done = work(portion)
            counted = [portion, done, tally.counts, tally.wall, tally.cpu]
            line = json.dumps(counted, separators=(",", ":")).encode() + b"\n"
            if len(line) > LONGEST_LINE:
                break
            os.write(answers, line)
        os.close(answers)
        killed = _fetch(children)
        code = BY_SIGNAL + killed if killed else 0
    finally:
        os._exit(code)


def _answer(line: bytes) -> tuple[int, Tally, bool]:
    portion, done, counts, wall, cpu = json.loads(line)
    tally = Tally()
    tally.counts.update(counts)
    tally.wall.update(wall)
    tally.cpu.update(cpu)
    return portion, tally, done
