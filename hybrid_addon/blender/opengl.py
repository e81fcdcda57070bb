"""Is there an OpenGL for EEVEE? Asked before a headless render, because Blender crashes without one."""

from __future__ import annotations

import ctypes
import functools
import os
import sys

import bpy

from .errors import HybridError

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
    return _egl_problem()


@functools.cache
def _egl_problem() -> str:
    """What keeps EGL from giving a headless OpenGL context; "" if nothing does. The display stays open for Blender."""
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        return "libEGL.so.1 is not installed"
    egl.eglGetPlatformDisplay.restype = ctypes.c_void_p
    egl.eglGetPlatformDisplay.argtypes = [ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
    egl.eglGetDisplay.restype = ctypes.c_void_p
    egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    # A driver answers for the default display (NVIDIA) or, with no screen at all, for Mesa's surfaceless platform.
    displays = (egl.eglGetDisplay(None), egl.eglGetPlatformDisplay(_EGL_PLATFORM_SURFACELESS_MESA, None, None))
    if not any(display and egl.eglInitialize(display, None, None) for display in displays):
        return "EGL finds no driver"
    if not egl.eglBindAPI(_EGL_OPENGL_API):
        return "the EGL driver has no OpenGL"
    return ""
