# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render job, on a thread of its own, has Blender's main thread do: with a window, the one that draws it.

The image *Render Result* has two locks, which Blender 5.2 takes in two orders. Whoever wants its pixels takes the
image's lock, then the result's, lets go of the first and keeps the second; when done he takes the first again, to let
go of the second. Two threads that do so at once wait for each other for ever: a render engine that saves the picture,
and the window that draws it. The main thread alone cannot. (`tests/real_blender/retrace.py` draws without a pause:
while our engine saved the picture itself, one of a few runs stood still.)
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

import bpy

from . import growing

POLL_SECONDS = 0.02
"""Between two looks, of the main thread for work and of the render for an answer."""

IDLE_SECONDS = 0.25
"""The same of the main thread while nothing is rendered."""

PATIENCE_SECONDS = 10.0
"""After which the main thread is not coming, because something else keeps it: then it does not draw, either."""

T = TypeVar("T")
_asked: SimpleQueue[tuple[Future[Any], Callable[[], Any]]] = SimpleQueue()


def call(work: Callable[[], T], check: Callable[[], None] | None = None) -> T:
    """The result of `work` (or what it raises), done by the main thread, which may take a moment to come to it.

    check : is called while waiting; raises if nobody wants the result any more.
    """
    if bpy.app.background or threading.current_thread() is threading.main_thread():
        return work()
    future: Future[T] = Future()
    _asked.put((future, work))
    began = time.perf_counter()
    try:
        while not wait([future], POLL_SECONDS).done:
            if check is not None:
                check()
            if time.perf_counter() - began > PATIENCE_SECONDS and future.cancel():
                return work()
    except BaseException:
        if not future.cancel():  # it is being done: what it works with must not go meanwhile
            wait([future])
        raise
    return future.result()


def post(work: Callable[[], Any]) -> None:
    """Have the main thread do this soon, and do not wait for it; in the background nobody would see it."""
    if not bpy.app.background:
        _asked.put((Future(), work))


def _serve() -> float:
    """A timer, which Blender runs on the main thread between events and drawing."""
    with contextlib.suppress(Empty):
        while True:
            future, work = _asked.get_nowait()
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(work())
                except BaseException as error:
                    future.set_exception(error)
    growing.redraw()
    return POLL_SECONDS if bpy.app.is_job_running("RENDER") else IDLE_SECONDS


def register() -> None:
    """Begin to look for work; for ever, since a render must not touch the list of timers."""
    if not bpy.app.background:
        bpy.app.timers.register(_serve, first_interval=0.0, persistent=True)


def unregister() -> None:
    """Look no more; what waits is done."""
    if not bpy.app.background and bpy.app.timers.is_registered(_serve):
        bpy.app.timers.unregister(_serve)
        _serve()
