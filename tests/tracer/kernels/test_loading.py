# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels come out of the cache, those first that somebody waits for; whatever fails takes no other away."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numba
import numpy as np
import pytest

from hybrid_addon import accelerated
from hybrid_addon.tracer.geometry import embree
from hybrid_addon.tracer.geometry.embree import library
from hybrid_addon.tracer.kernels import declare, loading

from .inputs import Source, _rays, embree_scene

SECOND = """
import sys, pathlib
from hybrid_addon import accelerated
from hybrid_addon.tracer.kernels import loading
accelerated.provide = lambda name, kernel, *rest: print(name, sum(kernel.stats.cache_misses.values()))
loading.cache_in(pathlib.Path(sys.argv[1]))
print(loading.load()["failed"])
"""


def add_one(a, out):
    for i in range(len(a)):
        out[i] = a[i] + np.float32(1)


ADD_ONE = declare.Kernel("add_one", add_one, [(declare.f4[1], declare.written(declare.f4[1]))])


@pytest.fixture
def fresh(monkeypatch):
    """Nothing has been loaded, and nothing failed."""
    monkeypatch.setenv(loading.SWITCH, "1")
    for name in ("_begun", "_done"):
        monkeypatch.setattr(loading, name, set())
    monkeypatch.setattr(loading, "_known", dict(loading._known))
    monkeypatch.setattr(loading, "_stop", threading.Event())
    monkeypatch.setattr(loading, "_thread", [])
    monkeypatch.setattr(accelerated, "_failed", {})
    monkeypatch.setattr(accelerated, "_warned", ["no warnings"])
    monkeypatch.setattr(accelerated, "_wanted", True)
    return monkeypatch


def test_a_second_process_compiles_nothing(loaded) -> None:
    """Kernels that close over helpers, and kernels of one name, too."""
    command = [sys.executable, "-c", SECOND, str(loading.cache_folder())]
    environment = {**os.environ, loading.SWITCH: "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    *lines, failed = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )[:-1]
    assert failed == "{}" and {line.split()[0] for line in lines} == {
        kernel.of for kernel in declare.DECLARED if not kernel.late
    }
    assert [line for line in lines if not line.endswith(" 0")] == []


def test_a_damaged_cache_costs_time(fresh, tmp_path: Path) -> None:
    fresh.setattr(loading, "_folder", [tmp_path])
    loading.compiled(ADD_ONE)
    for damaged in ("*.nbc", "*.nbi"):
        for file in tmp_path.glob(damaged):
            file.write_bytes(file.read_bytes()[:-20])
        ones, out = np.ones(3, np.float32), np.zeros(3, np.float32)
        loading.compiled(ADD_ONE)(ones, out)
        assert (out == 2).all()
        loading.compiled(ADD_ONE)  # is kept once more
        assert sum(loading.compiled(ADD_ONE).stats.cache_hits.values()) == 1


def test_how_helpers_are_compiled_decides_whether_the_cache_has_a_kernel(monkeypatch) -> None:
    def of(**options):
        helper = numba.njit(**options)(eval("lambda a: a"))
        return loading.fingerprint(eval("lambda a: f(a)", {"f": helper}))

    first = of(nogil=True)
    assert first == of(nogil=True) and first != of(nogil=True, inline="always")
    monkeypatch.setitem(declare.OPTIONS, "error_model", "python")
    assert first != of(nogil=True)


def test_a_module_that_fails_takes_no_other_kernels_away(fresh) -> None:
    found = [loading.pkgutil.ModuleInfo(None, name, False) for name in ("broken", "hits")]
    fresh.setattr(loading.pkgutil, "iter_modules", lambda path: found)
    assert loading._declared() == declare.DECLARED and list(accelerated.failed()) == ["broken"]


def kernels_named(fresh, names: str) -> list[str]:
    """Kernels of one letter that are there at once: in which order they are loaded."""
    fresh.setattr(loading, "_declared", lambda: [declare.Kernel(name, add_one, []) for name in names])
    order: list[str] = []
    fresh.setattr(loading, "compiled", lambda kernel: order.append(kernel.of))
    fresh.setattr(accelerated, "provide", lambda *args: None)
    return order


def test_what_somebody_waits_for_is_loaded_before_all_others(fresh) -> None:
    order, seen = kernels_named(fresh, "abcde"), []
    at_once = loading.compiled

    def hurry():
        seen.append(loading.load({"d"}) and "".join(order))

    def compiled(kernel):
        at_once(kernel)
        if kernel.of == "b":
            waiting.start()
            with loading._turn:
                assert loading._turn.wait_for(lambda: "d" in loading._begun, 60)
        if kernel.of == "d":
            with loading._turn:  # this thread would go on with c meanwhile
                seen.append(loading._turn.wait_for(lambda: "c" in loading._begun, 0.1))

    waiting = threading.Thread(target=hurry)
    fresh.setattr(loading, "compiled", compiled)
    loading._load(None, urgent=False)
    waiting.join()
    assert "".join(order) == "abdce" and seen[0] is False and seen[1].startswith("abd")


def test_the_state_says_whether_something_is_in_work(fresh) -> None:
    kernels_named(fresh, "ab")
    assert loading.load({"a"})["state"] == "ready" and loading._done == {"a"}
    loading._stop.set()
    assert loading.load()["state"] == "stopped" and loading._done == {"a"}


def test_the_end_of_a_process_waits_for_one_kernel_and_not_for_ever(fresh) -> None:
    class Thread:
        def join(self, limit):
            assert limit == loading.PARTING

    loading._thread.append(Thread())
    loading.stop()
    loading._provide(ADD_ONE)  # begins no signature, and nobody hears of it
    assert loading._done == {"add_one"} and not accelerated.failed()


def test_kernels_that_come_later_respect_that_numpy_is_wanted(fresh) -> None:
    fresh.setattr(accelerated, "ALL", {})
    accelerated.use(False)
    name = f"{__name__}.add_one"
    accelerated.provide(name, add_one, (1,))  # before its function is imported
    accelerated.accelerated(add_one)
    twins = accelerated.ALL[name]
    assert twins.compiled is add_one and twins.written == (1,) and twins.kernel is None
    accelerated.use(True)
    assert twins.kernel is add_one


def test_without_embrees_queries_their_kernels_are_not_declared(monkeypatch) -> None:
    """Linked without them they would end the process."""
    monkeypatch.setattr(library, "library", lambda: object())
    assert library.query_addresses() == {}
    monkeypatch.setattr(library, "library", lambda: None)
    monkeypatch.setattr(declare, "DECLARED", [])
    spec = spec_from_file_location("hybrid_addon.tracer.kernels.again", Path(loading.__file__).parent / "packets.py")
    spec.loader.exec_module(module_from_spec(spec))
    assert declare.DECLARED == []


def test_a_forked_process_builds_no_tree(kernels, monkeypatch) -> None:
    """It lacks Embree's threads, and would wait for ever: its parent does the task again."""
    scene = embree_scene()
    rays = _rays(Source(np.random.default_rng(1), 9))
    accelerated.use(False)
    with monkeypatch.context() as child:
        child.setattr(embree.os, "getpid", lambda: -1)
        with pytest.raises(RuntimeError, match="builds no trees"):
            scene.nearest(*rays)
    assert scene.nearest(*rays).shape == (9,)
