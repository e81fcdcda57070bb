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
import json
import mmap
import os
import select
import signal
import sys
import warnings
from collections.abc import Callable
from math import prod

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .tally import Tally

AVAILABLE = sys.platform == "linux"

FEWEST = 2
"""Processes: two are twice as fast as one thread (measured, 1.9 to 2.1 times), two threads 1.6 times."""

WORTH_IT = 1 << 17
"""Camera rays, below which starting processes, some milliseconds each, and copying what they touch cost too much."""

RECORD = 8  # bytes of a portion's number; far below PIPE_BUF, so whole records are read and written
LONGEST_LINE = getattr(select, "PIPE_BUF", 512)  # bytes that are written at once, whoever else writes

Work = Callable[[int], tuple[Tally, bool]]
"""Does the portion of this number: what was counted, and whether it came to its end."""


def shared_zeros(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray:
    """An array of zeros that forked processes write to as one."""
    size = prod(shape) * np.dtype(dtype).itemsize
    return np.frombuffer(mmap.mmap(-1, max(size, 1)), dtype, prod(shape)).reshape(shape)


class ForkKilled(RuntimeError):
    """A process was ended from outside."""


class Forks:
    """Processes that do portions; to be used in a `with`, at whose end none is left.

    number : of processes.   work : what each does with a portion's number, on what it had at the fork.
    """

    def __init__(self, number: int, work: Work) -> None:
        jobs_out, self._jobs = os.pipe()
        self._answers, answers_in = os.pipe()
        self._text = b""
        self._children: list[int] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # forks beside threads: see the head of this file
            for _ in range(number):
                child = os.fork()
                if child == 0:
                    os.close(self._jobs)  # or the end of the jobs would never be seen
                    _serve(jobs_out, answers_in, work)
                self._children.append(child)
        os.close(jobs_out)
        os.close(answers_in)

    def __enter__(self) -> Forks:
        return self

    def __exit__(self, *_: object) -> None:
        self.no_more()
        for child in self._children:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)  # one that has ended waits to be fetched: its number is not reused
        self._fetch()
        os.close(self._answers)

    def _fetch(self) -> list[int]:
        """Wait for the end of all; their exit codes, -n for signal n."""
        codes = []
        while self._children:
            with contextlib.suppress(ChildProcessError):  # somebody else has fetched it
                codes.append(os.waitstatus_to_exitcode(os.waitpid(self._children.pop(), 0)[1]))
        return codes

    def check(self) -> None:
        """When all have ended: raises ForkKilled if not by themselves, for then nobody knows what they have added."""
        killed = [-code for code in self._fetch() if code < 0]
        if killed:
            raise ForkKilled(
                f"{len(killed)} of the ray tracer's processes were ended by signal {killed[0]}: if the memory ran out, "
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


def _serve(jobs: int, answers: int, work: Work) -> None:
    """A child's whole life. A portion that fails is not answered: the parent does it again, and fails as it should."""
    code = 1
    try:
        while len(job := os.read(jobs, RECORD)) == RECORD:
            portion = int.from_bytes(job, "little")
            tally, done = work(portion)
            counted = [portion, done, tally.counts, tally.wall, tally.cpu]
            line = json.dumps(counted, separators=(",", ":")).encode() + b"\n"
            if len(line) > LONGEST_LINE:
                break
            os.write(answers, line)
        code = 0
    finally:
        os._exit(code)


def _answer(line: bytes) -> tuple[int, Tally, bool]:
    portion, done, counts, wall, cpu = json.loads(line)
    tally = Tally()
    tally.counts.update(counts)
    tally.wall.update(wall)
    tally.cpu.update(cpu)
    return portion, tally, done
