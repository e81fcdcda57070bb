# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles kernels, or loads them from a cache, in the background: until one is there, numpy does its work.

    cache_in(folder)      where machine code is kept; without it, the user's cache folder (XDG_CACHE_HOME)
    begin(after=0.0)      load in a thread, if it has not begun
    load()                load all now
    status()              {"state": "ready", "numba": "0.68.1", "ready": 12, "of": 12, "failed": {}}

HYBRID_KERNELS=0 in the environment switches all of it off. Each kernel is in use as soon as it is ready. What was
compiled is found again by what it is made of (its code, its helpers, its constants; numba adds its own version and the
processor), so an update of the add-on compiles only what it changes. A cache folder that cannot be written costs time.

A process may end at any moment: its end waits for the kernel in work (a second or two, PARTING at most), not for the
others. Who needs some at once (`load`) waits for the one in work, and then has his own before all others.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import importlib
import importlib.util
import os
import pkgutil
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ... import accelerated

SWITCH = "HYBRID_KERNELS"

PATIENCE = 2.0
"""Seconds from the first picture of a process without a window until kernels are loaded: importing numba takes about
one, which a frame that is done sooner does not gain back."""

NOT_KERNELS = ("declare", "loading")
"""Modules of this room that declare none."""

STATES = ("off", "no numba", "not begun", "loading", "ready", "stopped")
"""off: switched off. no numba: none can be imported. not begun: nothing asked for kernels yet. stopped: the process
ends. ready: nothing is in work; where only some kernels were asked for, the others are not there."""

PARTING = 5.0
"""Seconds that the end of a process waits at most for the kernel in work: LLVM should not be cut off."""

STAMPED = 16
"""So much of a fingerprint is in the names of files."""

_lock, _declaring = threading.Lock(), threading.Lock()
_stop, _wake = threading.Event(), threading.Event()
_turn = threading.Condition()  # of what follows
_at_work: list[bool] = []  # of each thread that loads kernels: whether somebody waits for it
_begun: set[str] = set()
_folder: list[Path] = []
_thread: list[threading.Thread] = []
_done: set[str] = set()
_known: dict[str, Any] = {"state": "not begun", "numba": "", "ready": 0, "of": 0}


def is_off() -> bool:
    """Whether the environment says that numpy is to do everything."""
    return os.environ.get(SWITCH, "1").strip().lower() in ("0", "off", "no", "false")


def status() -> dict[str, Any]:
    """How far loading has come: `state` (see STATES), `numba`'s version or "", how many are `ready` `of` all, and why
    others `failed`, by name."""
    state = "off" if is_off() else _known["state"]
    return {**_known, "state": state, "ready": len(accelerated.in_use()), "failed": accelerated.failed()}


def line() -> str:
    """The same in words."""
    now = status()
    return {
        "off": f"numpy ({SWITCH}=0)",
        "no numba": "numpy (there is no numba for this Python)",
        "not begun": "numpy (kernels are not asked for yet)",
        "loading": f"numba {now['numba']}: {now['ready']} of {now['of']} kernels, others are being compiled",
        "stopped": f"numba {now['numba']}: {now['ready']} of {now['of']} kernels",
        "ready": f"numba {now['numba']}: {now['ready']} of {now['of']} kernels",
    }[now["state"]]


def cache_in(folder: Path) -> None:
    """Keep machine code there. To be said before loading begins."""
    _folder[:] = [folder]


def cache_folder() -> Path:
    """Where machine code is kept."""
    if _folder:
        return _folder[0]
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "hybrid_addon" / "kernels"


def begin(after: float = 0.0) -> None:
    """Load all kernels in the background, once; nothing if they are switched off.

    after : seconds to wait first, or until somebody begins at once: a process that is over sooner loads nothing.
    """
    if is_off() or _stop.is_set():
        return
    with _lock:
        if not _thread:
            atexit.register(stop)
            _thread.append(threading.Thread(target=_wait_and_load, args=(after,), name="hybrid-kernels", daemon=True))
            _thread[0].start()
    if after == 0:
        _wake.set()


def stop() -> None:
    """Begin no more kernels, and wait for the one in work, but not for long."""
    _stop.set()
    _wake.set()
    with _turn:
        _turn.notify_all()
    for thread in _thread:
        thread.join(PARTING)


def load(names: set[str] | None = None) -> dict[str, Any]:
    """Load all kernels now, or those of these functions before all others, and return the status."""
    if not is_off():
        _load(names, urgent=True)
    return status()


def is_kept(name: str) -> bool:
    """Whether the machine code of a function's kernel is in the cache."""
    for kernel in _declared():
        if kernel.of == name:
            fields = importlib.import_module(".declare", __package__).names_in_all(kernel)
            stamp = fingerprint(kernel.function, fields)[:STAMPED]
            return any(cache_folder().glob(f"{kernel.function.__name__}-{stamp}*.nbi"))
    return False


def ends_within(seconds: float) -> bool:
    """Wait so long; whether the process ends meanwhile."""
    return _stop.wait(seconds)


def _wait_and_load(after: float) -> None:
    _wake.wait(after)
    try:
        _load(None, urgent=False)
    except Exception as error:  # a thread has nobody to raise it to
        _report("loading", error)


def _load(names: set[str] | None, urgent: bool) -> None:
    """Load those that nobody has begun, one by one, and wait for those that another thread has in work. One that is not
    urgent lets the urgent go first."""
    try:
        _known["numba"] = importlib.import_module("numba").__version__
    except Exception:  # there is none, or it refuses this numpy
        _known["state"] = "no numba"
        return
    with _turn:
        _at_work.append(urgent)
        _known["state"] = "loading"
    try:
        kernels = _declared()
        _known["of"] = sum(not kernel.late or kernel.of in _begun | (names or set()) for kernel in kernels)
        wanted = [kernel for kernel in kernels if (not kernel.late if names is None else kernel.of in names)]
        for kernel in wanted:
            with _turn:
                _turn.wait_for(lambda: urgent or True not in _at_work or _stop.is_set())
                if _stop.is_set():
                    return
                if kernel.of in _begun:
                    continue
                _begun.add(kernel.of)
            _provide(kernel)
        with _turn:
            _turn.wait_for(lambda: _done.issuperset(kernel.of for kernel in wanted) or _stop.is_set())
    finally:
        with _turn:
            _at_work.remove(urgent)
            if not _at_work:
                _known["state"] = "stopped" if _stop.is_set() else "ready"
            _turn.notify_all()


def _provide(kernel: Any) -> None:
    try:
        accelerated.provide(kernel.of, compiled(kernel), kernel.written, kernel.tables, kernel.of_rows)
    except Exception as error:
        _report(kernel.of, error)
    finally:
        with _turn:
            _done.add(kernel.of)
            _turn.notify_all()


def _report(name: str, error: Exception) -> None:
    """Note a failure; at the end of a process everything may fail, and nobody needs to know."""
    if not _stop.is_set():
        accelerated.report_failure(name, error)


def _declared() -> list[Any]:
    """All kernels of this room's modules; one that fails takes no other's kernels away."""
    assert __package__ is not None
    with _declaring:
        names = list(_modules(Path(__file__).parent))
        for name in ("declare", *(name for name in names if name not in NOT_KERNELS)):
            try:
                if name not in accelerated.failed():
                    importlib.import_module(f".{name}", __package__)
            except Exception as error:
                _report(name, error)
        declare = sys.modules.get(f"{__package__}.declare")
        return list(declare.DECLARED) if declare is not None else []


def _modules(folder: Path, package: str = "") -> Iterator[str]:
    """Names of all modules of the room, those of rooms in it, too."""
    for module in pkgutil.iter_modules([str(folder)]):
        yield package + module.name
        if module.ispkg:
            yield from _modules(folder / module.name, f"{package}{module.name}.")


def compiled(kernel: Any) -> Callable[..., Any]:
    """A declared kernel as machine code, of the cache if it is there."""
    import numba

    declare = importlib.import_module(".declare", __package__)
    dispatcher = numba.njit(**declare.OPTIONS)(kernel.function)
    cache = _cache(kernel.function, declare.names_in_all(kernel))
    for signature in kernel.signatures:
        if _stop.is_set():
            raise InterruptedError("the process ends")
        if cache is not None:
            dispatcher._cache = cache
        try:
            dispatcher.compile(signature)
        except Exception:
            if cache is None:
                raise
            with contextlib.suppress(OSError):  # the folder cannot be written
                cache.flush()  # what was kept is damaged
            cache, dispatcher._cache = None, numba.core.caching.NullCache()
            dispatcher.compile(signature)
    dispatcher.disable_compile()
    for signature in kernel.signatures:  # numba notes how arguments convert in the first call, which takes it 0.1 s
        dispatcher(*[declare.nothing(t) for t in signature])
    result: Callable[..., Any] = dispatcher
    return result


def _cache(function: Callable[..., Any], fields: str = "") -> Any:
    """numba's own cache of a function, but in our folder, and found by what the function is made of; None: no cache.

    fields : of records among its arguments (`declare.names_in`).

    numba's would go by the source file alone, and its folder is one for all who use numba in this process.
    """
    try:
        from numba.core import caching

        stamp, folder = fingerprint(function, fields), str(cache_folder())
        version = "{}{}".format(*sys.version_info)

        class Locator(caching._CacheLocator):  # type: ignore[misc]
            def get_cache_path(self) -> str:
                return folder

            def get_source_stamp(self) -> str:
                return stamp

            def get_disambiguator(self) -> str:
                return stamp[:STAMPED]  # kernels of one name, and versions of one kernel, each have a file of their own

            @classmethod
            def from_function(cls, function: Any, file: str) -> Any:
                locator = cls()
                locator.ensure_cache_path()  # type: ignore[no-untyped-call]
                return locator

        class Implementation(caching.CompileResultCacheImpl):  # type: ignore[misc]
            _locator_classes = [Locator]  # type: ignore[list-item]

            def get_filename_base(self, fullname: str, abiflags: str) -> str:
                return f"{function.__name__}-{self.locator.get_disambiguator()}.py{version}{abiflags}"

        class Cache(caching.FunctionCache):  # type: ignore[misc]
            _impl_class = Implementation

            def _index_key(self, signature: Any, codegen: Any) -> Any:
                # numba's own would hash helpers in a closure, which differ from process to process
                return signature, codegen.magic_tuple(), stamp

        return Cache(function)  # type: ignore[no-untyped-call]
    except Exception:  # not to be written, or another numba than the one that we know
        return None


def fingerprint(function: Callable[..., Any], fields: str = "") -> str:
    """What the machine code of a function depends on: its code, that of its helpers, all their constants, how they are
    compiled, and the fields of records."""
    options = importlib.import_module(".declare", __package__).OPTIONS
    content = hashlib.sha256(f"numpy {np.__version__} {sorted(options.items())}{fields}".encode())
    for part in _parts(function, set()):
        content.update(part)
    return content.hexdigest()


def _parts(function: Callable[..., Any], seen: set[int]) -> Iterator[bytes]:
    if id(function) in seen:
        return
    seen.add(id(function))
    code = function.__code__
    yield function.__name__.encode() + code.co_code + repr((code.co_consts, code.co_names)).encode()
    named = {name: function.__globals__.get(name) for name in code.co_names}
    for module in [value for value in named.values() if isinstance(value, ModuleType)]:
        if not module.__name__.startswith(f"{accelerated.__package__}."):
            continue
        named |= {f"{module.__name__}.{name}": getattr(module, name, None) for name in code.co_names}
    around = zip(code.co_freevars, (cell.cell_contents for cell in function.__closure__ or ()), strict=True)
    for name, value in [*named.items(), *around]:
        if hasattr(value, "py_func"):
            yield f"{name} {sorted(value.targetoptions.items())}".encode()
            yield from _parts(value.py_func, seen)
        elif isinstance(value, (bool, int, float, str, tuple, np.generic)):
            yield f"{name} {type(value).__name__} {value!r}".encode()
        elif isinstance(value, type):
            yield f"{name} {value.__name__}".encode()
        elif isinstance(value, np.ndarray):
            yield f"{name} {value.dtype} {value.shape}".encode() + value.tobytes()
