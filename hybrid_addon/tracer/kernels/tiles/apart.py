# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles what takes minutes in a process of its own, and loads it when that is done.

There it takes neither this process' interpreter lock nor, when Blender is closed, its time: the process is ended then.
What it leaves is in the cache. Where there is no Python to run, or the cache cannot be written, nothing is loaded.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

from .... import accelerated
from .. import loading

CHILD = """
import importlib, json, os, pathlib, sys, types
told = json.loads(sys.argv[1])
sys.path[:0] = told["path"]
hasattr(os, "nice") and os.nice(10)
parts = told["package"].split(".")
for n in range(1, len(parts) + 1):  # no package of it runs, least of all Blender's part
    name = ".".join(parts[:n])
    sys.modules[name] = package = types.ModuleType(name)
    package.__path__ = [told["folder"]] if n == len(parts) else []
loading = importlib.import_module(told["package"] + ".tracer.kernels.loading")
loading.cache_in(pathlib.Path(told["cache"]))
loading.load({told["kernel"]})
"""

POLL = 0.2
"""Seconds between two looks at whether it is done, or Blender is being closed."""

BELOW_NORMAL, NO_WINDOW = 0x4000, 0x08000000  # of Windows' CreateProcess

PATIENCE = 20.0
"""Seconds from the first picture that could use it until it is compiled: a process that is over sooner would have
compiled for nothing. What is in the cache is loaded at once."""

_since: dict[str, float] = {}
_asked: set[str] = set()
_children: list[subprocess.Popen[bytes]] = []


def ask_for(name: str) -> None:
    """Have the kernel of a function in use some time, if kernels are being loaded at all."""
    if name in _asked or loading.is_off() or loading.status()["state"] not in ("loading", "ready"):
        return
    is_first, now = name not in _since, time.monotonic()
    if is_first:
        _since[name] = now
    if now - _since[name] >= PATIENCE:
        _asked.add(name)
    elif not is_first:
        return
    threading.Thread(target=_load, args=(name, name in _asked), name="hybrid-tiles", daemon=True).start()


def _load(name: str, compiles: bool) -> None:
    """Load what is kept, or first compile it."""
    try:
        if loading.is_kept(name) or (compiles and compile_apart(name) and loading.is_kept(name)):
            _asked.add(name)
            loading.load({name})
    except Exception as error:  # a thread has nobody to raise it to
        accelerated.report_failure(name, error)


def compile_apart(name: str) -> bool:
    """Compile a kernel into the cache, in another process; whether that went well. Blocks until it is done."""
    if not Path(sys.executable or "").stem.lower().startswith("python"):
        return False  # Blender itself, or none
    told = {
        "package": accelerated.__package__, "folder": str(Path(accelerated.__file__).parent), "kernel": name,
        "cache": str(loading.cache_folder()), "path": sys.path,
    }  # fmt: skip
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, json.dumps(told)],
        env={**os.environ, loading.SWITCH: "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        creationflags=BELOW_NORMAL | NO_WINDOW if os.name == "nt" else 0,
    )
    _children.append(child)
    try:
        while child.poll() is None:
            if loading.ends_within(POLL):
                return False
        return bool(child.returncode == 0)
    finally:
        _end(child)


@atexit.register
def _end_all() -> None:
    """No process outlives this one."""
    for child in list(_children):
        _end(child)


def _end(child: subprocess.Popen[bytes]) -> None:
    if child.poll() is None:
        child.kill()
        child.wait()
