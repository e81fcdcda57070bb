# SPDX-License-Identifier: GPL-3.0-or-later
"""Is there an OpenGL for EEVEE, and a graphics card behind it? Asked before a headless render, which may crash else."""

from __future__ import annotations

import ctypes
import functools
import os
import sys

import bpy

from ..errors import HybridError

_PACKAGES = "libegl1 libgl1 libegl-mesa0 libgl1-mesa-dri"  # Debian and Ubuntu: Mesa's software OpenGL
_EGL_OPENGL_API = 0x30A2  # egl.h
_EGL_PLATFORM_SURFACELESS_MESA = 0x31DD  # eglext.h


def require() -> None:
    """Raise HybridError if EEVEE cannot render on this machine."""
    problem = missing()
    if problem:
        raise HybridError(
            f"EEVEE needs OpenGL and {problem}: install a graphics driver or Mesa (Debian: apt install {_PACKAGES}), "
            "or use mode full, which needs none"
        )


def missing() -> str:
    """What keeps this machine from giving OpenGL; "" if nothing does, or if there is a display to give it."""
    if not bpy.app.background or not sys.platform.startswith("linux"):
        return ""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return ""
    return _egl()[0]


def draws_on_processor() -> bool:
    """Whether a headless Blender has no OpenGL, or Mesa's on the processor."""
    return sys.platform.startswith("linux") and (bool(missing()) or "swrast" in _egl()[1])


@functools.cache
def _egl() -> tuple[str, str]:
    """What keeps EGL from giving a headless OpenGL context, "" if nothing does; and the driver's name, "" if unknown.

    The display stays open for Blender.
    """
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        return "libEGL.so.1 is not installed", ""
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetPlatformDisplay.restype = ctypes.c_void_p
    egl.eglGetPlatformDisplay.argtypes = [ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
    egl.eglGetDisplay.restype = ctypes.c_void_p
    egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    # A driver answers for the default display (NVIDIA) or, with no screen at all, for Mesa's surfaceless platform.
    displays = (egl.eglGetDisplay(None), egl.eglGetPlatformDisplay(_EGL_PLATFORM_SURFACELESS_MESA, None, None))
    display = next((d for d in displays if d and egl.eglInitialize(d, None, None)), None)
    if display is None:
        return "EGL finds no driver", ""
    if not egl.eglBindAPI(_EGL_OPENGL_API):
        return "the EGL driver has no OpenGL", ""
    address = egl.eglGetProcAddress(b"eglGetDisplayDriverName")  # EGL_MESA_query_driver
    name = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_void_p)(address)(display) if address else None
    return "", (name or b"").decode(errors="replace")
