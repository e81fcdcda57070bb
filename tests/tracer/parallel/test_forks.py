# SPDX-License-Identifier: GPL-3.0-or-later
"""Forked processes do the work of threads: the same picture, bit for bit, and none of them is left."""

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon.clock import Clock
from hybrid_addon.measure.stability import effects
from hybrid_addon.measure.stability.build import shoot
from hybrid_addon.scene import PointLight, Settings, World
from hybrid_addon.tracer.film import pixels
from hybrid_addon.tracer.parallel import forks, pool
from hybrid_addon.tracer.render import Cancelled, trace
from hybrid_addon.tracer.sampling import passes, tiles

pytestmark = pytest.mark.skipif(not forks.AVAILABLE, reason="this system does not fork")
PASSES = frozenset({"samples", "reflection"})
HOW = Settings(samples=8, camera_sees="ALL", threads=4, adaptive=0.05, cutoff=1 / 255, chunk=4096, passes=PASSES)


def test_there_are_no_forks_where_malloc_would_stay_locked_in_them():
    """A Blender whose malloc is TBB's stood still: the lock of another thread was held in the child for ever."""
    usual = "7f00-7f01 r-xp 0 00:00 1 /usr/lib/libc.so.6\n7f02-7f03 r-xp 0 00:00 2 /opt/blender/lib/libtbbmalloc.so.2\n"
    assert forks.can_fork(usual)
    assert not forks.can_fork(usual + "7f04-7f05 r-xp 0 00:00 3 /usr/lib/libtbbmalloc_proxy.so.2\n")


@pytest.fixture(scope="module")
def scene(build):
    """Glass, a mirror and a floor under a lamp of some size: every kind of ray."""
    floor = build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])
    lamp = PointLight("lamp", (3, 2, 6), (400, 400, 300), radius=0.5)
    return build.scene(
        (build.icosphere(3, smooth=True), build.glass()), (build.box((1.2, -1, -1), (2, 0, 1)), build.mirror(0.8)),
        (floor, build.matte()), camera=build.camera((0, -6, 3), up=(0, 0, 1), size=(200, 160)), lights=(lamp,),
        world=World((0.4, 0.5, 0.8)),
    )  # fmt: skip


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(tiles, "WORTH_IT", 0)


def children(of=None):
    """Processes of this one that are there, and theirs."""
    found = []
    for path in os.listdir("/proc"):
        above = parent(path) if path.isdigit() else None
        if above == (of or os.getpid()):
            found += [path, *children(int(path))]
    return sorted(found)


def soon(condition):
    """Whether it comes true within a minute: processes end a little later than the work."""
    until = time.perf_counter() + 60
    while not (true := condition()) and time.perf_counter() < until:
        time.sleep(0.01)
    return true


def none_left(before):
    """Whether all that were started end; of those before, some may, too."""
    return soon(lambda: set(children()) <= set(before))


def alike():
    """How many processes run what this one runs: also those that nobody is the parent of any more."""
    own, number = command(os.getpid()), 0
    for path in os.listdir("/proc"):
        number += path.isdigit() and command(path) == own
    return number


def command(number):
    try:
        with open(f"/proc/{number}/cmdline", "rb") as file:
            return file.read()
    except OSError:
        return None


def parent(number):
    return stat(number)[1]


def has_begun(number):
    """Whether it has worked for some ticks of the clock: then it has a tile."""
    return (stat(number)[11] or 0) >= 5


def stat(number):
    """What the system says of a process, from its state on (proc(5)); None for each where there is none."""
    try:
        with open(f"/proc/{number}/stat", encoding="ascii", errors="replace") as file:
            return [None, *(int(field) for field in file.read().rpartition(")")[2].split()[1:])]
    except OSError:
        return [None] * 50


def test_the_picture_is_that_of_threads(scene):
    before = children()
    threads, processes = trace(scene, HOW), trace(scene, replace(HOW, processes=True))
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(processes, name), getattr(threads, name))
    for name in PASSES:
        np.testing.assert_array_equal(processes.passes[name], threads.passes[name])
    assert processes.rays == threads.rays
    assert processes.sampling == threads.sampling
    assert processes.time["shade"]["cpu"] > 0
    assert none_left(before)


def test_what_they_use_of_the_processors_counts(scene):
    """The clock of this process knows nothing of it."""
    clock, here = Clock(), time.process_time()
    film = trace(scene, replace(HOW, processes=True))
    elsewhere = clock.read()["cpu"] - (time.process_time() - here)
    assert elsewhere == pytest.approx(film.time["trace"]["cpu"], rel=0.5)
    assert elsewhere > 0.5 * film.time["shade"]["cpu"] > 0


@pytest.mark.parametrize("blurred", [False, True])
def test_with_every_effect_too(blurred):
    scene = effects.out_of_focus(effects.effects()) if blurred else effects.effects()
    film = shoot(scene, **effects.HYBRID, threads=4, processes=True, chunk=512)
    assert effects.differ(film, effects.reference(blurred)) == 0


def test_the_work_is_done_elsewhere(scene, monkeypatch):
    """Else the test above shows nothing."""
    here = []
    monkeypatch.setattr(passes, "trace_rays", lambda *a, **k: here.append(os.getpid()))
    trace(scene, replace(HOW, processes=True, adaptive=0.0))
    assert not here


def test_they_stay_for_all_of_a_picture(scene, monkeypatch):
    """Several passes, and what makes a picture of them."""
    made, init = [], forks.ForkPool.__init__
    resolved, develop = [], pixels.PixelBuffer.resolved
    monkeypatch.setattr(forks.ForkPool, "__init__", lambda self, *a: (made.append(1), init(self, *a))[1])
    monkeypatch.setattr(pixels.PixelBuffer, "resolved", lambda self, p: (resolved.append(1), develop(self, p))[1])
    film = trace(scene, replace(HOW, processes=True))
    assert film.sampling["samples_max"] == 8 and film.sampling["samples_mean"] < 8  # there were several
    assert len(made) == 1 and not resolved


def test_no_more_are_started_than_the_passes_need(scene, monkeypatch):
    """To develop the picture those do that are there, however many pieces it is in."""
    made, init = [], forks.ForkPool.__init__
    monkeypatch.setattr(forks.ForkPool, "__init__", lambda self, n, *a: (made.append(n), init(self, n, *a))[1])
    monkeypatch.setattr(tiles, "SMALLEST_TILE", 1 << 17)  # of which there is one
    monkeypatch.setattr(tiles, "SHORTEST", 1e6)
    monkeypatch.setattr(passes, "DEVELOP_CHUNK", 1000)
    film = trace(scene, replace(HOW, samples=4, adaptive=0.0, threads=8, processes=True))
    assert made == [1]
    np.testing.assert_array_equal(film.radiance, trace(scene, replace(HOW, samples=4, adaptive=0.0)).radiance)


def test_what_fails_in_a_process_alone_is_done_here(scene, monkeypatch):
    """And others do the rest."""
    here, before, trace_rays = os.getpid(), children(), passes.trace_rays

    def fail_there(*arguments, **more):
        if os.getpid() != here:
            raise MemoryError
        return trace_rays(*arguments, **more)

    monkeypatch.setattr(passes, "trace_rays", fail_there)
    film = trace(scene, replace(HOW, processes=True))
    np.testing.assert_array_equal(film.radiance, trace(scene, HOW).radiance)
    assert none_left(before)


def test_one_that_is_killed_without_work_harms_nobody(scene, monkeypatch):
    """Between two passes."""
    killed, run = [], pool.WorkerPool.run

    def run_and_kill(self, *arguments):
        if self._processes is not None and not killed:
            killed.append(int(self._processes._at[0, 0]))
            os.kill(killed[0], signal.SIGKILL)
        return run(self, *arguments)

    monkeypatch.setattr(pool.WorkerPool, "run", run_and_kill)
    film = trace(scene, replace(HOW, processes=True))
    assert killed
    np.testing.assert_array_equal(film.radiance, trace(scene, HOW).radiance)


def test_cancelling_ends_them(scene):
    before, asked = alike(), []

    def progress(fraction):
        asked.append(fraction)
        return fraction < 0.1

    with pytest.raises(Cancelled):
        trace(scene, replace(HOW, samples=64, adaptive=0.0, processes=True), progress=progress)
    assert asked[-1] < 1
    assert soon(lambda: alike() <= before)  # whose parent was ended before them is fetched by the system


def test_the_deadline_holds(scene):
    film = trace(scene, replace(HOW, samples=4096, adaptive=0.0, processes=True), deadline=time.perf_counter() + 1.0)
    assert film.time["trace"]["wall"] < 30  # of minutes
    assert np.isfinite(film.radiance).all()


@pytest.mark.parametrize("grandchild", [False, True])
def test_one_that_is_killed_is_named(scene, grandchild):
    before = children()

    def right(number):
        return number not in before and (parent(number) != os.getpid()) == grandchild and has_begun(number)

    def kill():
        while not (new := [c for c in children() if right(c)]):
            time.sleep(0.01)
        os.kill(int(new[0]), signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    with pytest.raises(forks.ForkKilled, match=r"signal 9.*memory"):
        trace(scene, replace(HOW, samples=64, adaptive=0.0, processes=True))
    killer.join()
    assert none_left(before)


def test_what_fails_in_a_process_fails_here(scene, monkeypatch):
    def fail(*_arguments, **_more):
        raise ZeroDivisionError("in the tracer")

    monkeypatch.setattr(passes, "trace_rays", fail)
    with pytest.raises(ZeroDivisionError, match="in the tracer"):
        trace(scene, replace(HOW, processes=True))


@pytest.mark.parametrize("stuck", [[0], [0, 1, 2, 3]])
def test_a_process_that_never_begins_is_not_waited_for(scene, monkeypatch, stuck):
    """As one that waits for a lock which nobody holds any more: its tile is done here."""
    here, before, trace_tile = os.getpid(), children(), passes.Passes._trace_tile

    def trace_or_wait(self, pixels, work, deadline, begun):
        number = (begun.ctypes.data - begun.base.ctypes.data) // begun.itemsize
        if os.getpid() != here and number in stuck:
            time.sleep(1000)
        return trace_tile(self, pixels, work, deadline, begun)

    monkeypatch.setattr(pool, "SLOW_START", 0.3)
    monkeypatch.setattr(passes.Passes, "_trace_tile", trace_or_wait)
    how, began = replace(HOW, samples=4, adaptive=0.0), time.perf_counter()
    film = trace(scene, replace(how, processes=True))
    assert time.perf_counter() - began < 500
    np.testing.assert_array_equal(film.radiance, trace(scene, how).radiance)
    assert none_left(before)


def test_where_the_system_forks_no_more_threads_do_it(scene, monkeypatch):
    def fork():
        raise OSError("Resource temporarily unavailable")

    how = replace(HOW, samples=4, adaptive=0.0)
    monkeypatch.setattr(os, "fork", fork)
    film = trace(scene, replace(how, processes=True))
    np.testing.assert_array_equal(film.radiance, trace(scene, how).radiance)


def test_sums_of_all_processes_meet_in_one_array():
    shared = forks.shared_zeros((3, 5), np.float64)
    child = os.fork()
    if child == 0:
        shared[1] = 7
        os._exit(0)
    os.waitpid(child, 0)
    assert (shared[1] == 7).all() and not shared[[0, 2]].any()


ORPHANS = """
import time
from hybrid_addon.tracer.parallel.forks import ForkPool

def work(task):
    time.sleep(1000)

pool = ForkPool(4, 8, work, (number.to_bytes(8, "little") for number in range(4)))
while not pool._at.all():
    time.sleep(0.01)
print(*pool._at[:, 0], flush=True)
time.sleep(1000)
"""


def test_they_end_in_the_middle_of_a_task_when_the_parent_is_killed():
    """Children and their children."""
    parent = subprocess.Popen([sys.executable, "-c", ORPHANS], stdout=subprocess.PIPE, text=True)
    numbers = parent.stdout.readline().split()
    try:
        assert len(numbers) == 4 and all(command(number) for number in numbers)
    finally:
        parent.kill()
        parent.communicate()
    assert soon(lambda: not any(command(number) for number in numbers))
