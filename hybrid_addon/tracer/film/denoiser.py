# SPDX-License-Identifier: GPL-3.0-or-later
"""Open Image Denoise by ctypes: the library that Blender ships. Its sharp edges, all ended here:

* Blender has loaded it, so its bare name finds it; else it lies beside Blender, in a folder of each system's own;
* 1.x had other functions: a library without ours counts as none;
* errors are numbers that nobody sees who does not ask: they are asked for after each call that can fail;
* it reads and writes our arrays while it works: they are contiguous float32, and held until it has ended;
* it works for seconds, in threads of its own: so it is called from a thread, and the caller may stop it meanwhile;
* what is not finite spreads over the picture: it is refused here.

Only its CPU device is asked for: the same picture on every machine with the same library, and no driver to fail.
"""

from __future__ import annotations

import ctypes
import platform
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ...scene import Float32

NAMES = {
    "Linux": ("libOpenImageDenoise.so.2",),
    "Windows": ("OpenImageDenoise.dll",),
    "Darwin": ("libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"),
}
"""Of the library, version 2."""

CPU, FLOAT3, CANCELLED, OUT_OF_MEMORY = 1, 3, 6, 4
"""oidn.h of 2.3: OIDNDeviceType, OIDNFormat, OIDNError."""

MOST_MEGABYTES = 1024
"""Of its working space: larger pictures it cuts into tiles that overlap."""

POLL_SECONDS = 0.1
"""How often the caller may stop it."""

_P, _I, _S, _B = ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t, ctypes.c_bool
_Monitor = ctypes.CFUNCTYPE(_B, _P, ctypes.c_double)
_FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {
    "oidnNewDevice": (_P, [_I]),
    "oidnSetDeviceInt": (None, [_P, ctypes.c_char_p, _I]),
    "oidnSetDeviceBool": (None, [_P, ctypes.c_char_p, _B]),
    "oidnGetDeviceInt": (_I, [_P, ctypes.c_char_p]),
    "oidnGetDeviceError": (_I, [_P, _P]),
    "oidnCommitDevice": (None, [_P]),
    "oidnReleaseDevice": (None, [_P]),
    "oidnNewFilter": (_P, [_P, ctypes.c_char_p]),
    "oidnSetSharedFilterImage": (None, [_P, ctypes.c_char_p, _P, _I, _S, _S, _S, _S, _S]),
    "oidnSetFilterBool": (None, [_P, ctypes.c_char_p, _B]),
    "oidnSetFilterInt": (None, [_P, ctypes.c_char_p, _I]),
    "oidnSetFilterProgressMonitorFunction": (None, [_P, _Monitor, _P]),
    "oidnCommitFilter": (None, [_P]),
    "oidnExecuteFilter": (None, [_P]),
    "oidnReleaseFilter": (None, [_P]),
}

_folders: list[Path] = []
_loaded: list[ctypes.CDLL | None] = []


class DenoiserError(RuntimeError):
    """There is no denoiser, or it failed: one line for people."""


def look_in(folders: Iterable[Path]) -> None:
    """Where the library may lie, too. To be told before the first picture."""
    new = [folder for folder in folders if folder not in _folders]
    if new:
        _folders.extend(new)
        if _loaded == [None]:
            _loaded.clear()


def library(system: str = "") -> ctypes.CDLL | None:
    """The library, loaded; None: not found, or another than we know."""
    if not _loaded or system:
        names = NAMES.get(system or platform.system(), ())
        files = [str(folder / name) for folder in _folders for name in names if (folder / name).exists()]
        found = next((one for file in (*names, *files) if (one := _load(file)) is not None), None)
        if system:
            return found
        _loaded[:] = [found]
    return _loaded[0]


def _load(file: str) -> ctypes.CDLL | None:
    try:
        loaded = ctypes.CDLL(file)
        for name, (result, arguments) in _FUNCTIONS.items():
            function = getattr(loaded, name)
            function.restype, function.argtypes = result, arguments
        return loaded
    except (OSError, AttributeError):  # not to be loaded here; a version without one of these functions
        return None


class Denoiser:
    """A device of the library, released at the end of `with`. Raises DenoiserError where there is none."""

    def __init__(self, threads: int = 0, check: Callable[[], None] | None = None) -> None:
        """threads: 0 = all. check: called on this thread while it works; raises to stop."""
        found = library()
        if found is None:
            raise DenoiserError("Open Image Denoise 2, which Blender ships, was not found")
        self._library, self._check = found, check
        self._device = found.oidnNewDevice(CPU)
        if not self._device:
            self._refuse(self._error(None))
        if threads > 0:
            found.oidnSetDeviceInt(self._device, b"numThreads", threads)
        found.oidnSetDeviceBool(self._device, b"setAffinity", False)  # Blender's other threads would crowd on its cores
        found.oidnCommitDevice(self._device)
        self._refuse(self._error(self._device))

    def __enter__(self) -> Denoiser:
        return self

    def __exit__(self, *_: object) -> None:
        self._library.oidnReleaseDevice(self._device)

    @property
    def version(self) -> str:
        """As people write it."""
        number = int(self._library.oidnGetDeviceInt(self._device, b"version"))
        return f"{number // 10000}.{number // 100 % 100}.{number % 100}"

    def __call__(self, color: Float32, albedo: Float32 | None = None, normal: Float32 | None = None) -> Float32:
        """A picture (h, w, 3) without noise, scene-linear, >= 0, of any range.

        color  : (h, w, 3) with noise: each pixel's own.   albedo : (h, w, 3), 0..1; normal : (h, w, 3), of length 1 at
                 most, only with albedo: pictures that have the same edges, and little noise or none.

        Raises DenoiserError, and whatever `check` does.
        """
        height, width, _ = color.shape
        images = {b"color": color, b"albedo": albedo, b"normal": normal}
        inputs = {name: np.ascontiguousarray(a, np.float32) for name, a in images.items() if a is not None}
        if not all(np.isfinite(a).all() for a in inputs.values()):
            raise DenoiserError("the picture to denoise is not finite")
        output = np.empty_like(inputs[b"color"])
        if output.size == 0:
            return output
        own, stop = self._library, threading.Event()
        monitor = _Monitor(lambda _, __: not stop.is_set())
        work = own.oidnNewFilter(self._device, b"RT")
        self._refuse(self._error(self._device))
        try:
            for name, image in {**inputs, b"output": output}.items():
                own.oidnSetSharedFilterImage(work, name, image.ctypes.data, FLOAT3, width, height, 0, 0, 0)
            own.oidnSetFilterBool(work, b"hdr", True)
            own.oidnSetFilterInt(work, b"maxMemoryMB", MOST_MEGABYTES)
            own.oidnSetFilterProgressMonitorFunction(work, monitor, None)
            own.oidnCommitFilter(work)
            self._refuse(self._error(self._device))
            self._work(lambda: own.oidnExecuteFilter(work), stop)
            self._refuse(self._error(self._device))
        finally:
            own.oidnReleaseFilter(work)
        return output

    def _work(self, execute: Callable[[], None], stop: threading.Event) -> None:
        """Execute a filter on another thread, which ends before this returns."""
        thread = threading.Thread(target=execute)
        thread.start()
        try:
            while thread.is_alive():
                thread.join(POLL_SECONDS)
                if self._check is not None:
                    self._check()
        finally:
            stop.set()
            thread.join()

    def _error(self, device: int | None) -> str:
        """The last error, which is forgotten then; "": there was none."""
        message = ctypes.c_char_p()
        number = self._library.oidnGetDeviceError(device, ctypes.byref(message))
        if number in (0, CANCELLED):
            return ""
        return (message.value or b"").decode(errors="replace") or f"error {number}"

    @staticmethod
    def _refuse(error: str) -> None:
        if error:
            raise DenoiserError(f"Open Image Denoise failed: {error}")
