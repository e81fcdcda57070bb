# SPDX-License-Identifier: GPL-3.0-or-later
"""What is written beside the user's files and in Blender's temporary folder: whole or not at all, under safe names."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import secrets
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import bpy

from .errors import HybridError

LITTER_AGE = 3600.0
"""Seconds after which a part of a file belongs to nobody: writing one takes seconds, and clocks of a farm differ by
less than this."""

_PART = ".hybrid-*.part.*"
_SCRATCH = "hybrid_*.exr"


@contextlib.contextmanager
def atomic(path: str | os.PathLike[str]) -> Iterator[str]:
    """Give a temporary name beside `path`; rename it there on success, remove it on failure: whole or not at all.

    Nobody can guess the name, and it is short and plain whatever the file's own name is. What a killed process left
    behind stands in nobody's way, and is removed once it is old.
    """
    path = Path(path).absolute()  # Blender takes a bare name for a folder
    sweep(path.parent)
    temporary = path.with_name(f".hybrid-{secrets.token_hex(8)}.part{path.suffix}")
    try:
        yield str(temporary)
        os.replace(temporary, path)
    except OSError as error:
        raise HybridError(f"cannot write '{path}': {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def scratch() -> Iterator[str]:
    """An EXR file's name in Blender's temporary folder, for this user only; removed afterwards.

    Blender removes that folder when it ends, but not when it is killed: what is left there is removed by the next one.
    """
    folder = bpy.app.tempdir or tempfile.gettempdir()
    _sweep_sessions(folder)
    prefix, suffix = _SCRATCH.split("*")
    try:
        handle, name = tempfile.mkstemp(prefix=prefix, suffix=suffix, dir=folder)
    except OSError as error:
        raise HybridError(f"cannot write into Blender's temporary folder '{folder}': {error.strerror}") from error
    os.close(handle)
    try:
        yield name
    finally:
        Path(name).unlink(missing_ok=True)


@contextlib.contextmanager
def claim(path: Path) -> Iterator[bool]:
    """Whether this process may work on `path`, or another one is at it, here or on another machine of the farm.

    A lock on a small file beside it. The operating system drops the lock of a process that dies, however it dies, so
    that no claim is ever stale. Where the file system knows no locks everyone may: the last whole file then wins.
    """
    digest = hashlib.sha256(os.fsencode(path.name)).hexdigest()
    name = path.absolute().with_name(f".hybrid-{digest[:16]}.claim")
    try:
        handle = os.open(name, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
    except OSError as error:
        raise HybridError(f"cannot write '{name}': {error.strerror}") from error
    mine = _lock(handle)
    try:
        yield mine
    finally:
        if mine and os.name != "nt":
            name.unlink(missing_ok=True)  # still locked: whoever waits for nothing here finds the work done
        os.close(handle)
        if mine and os.name == "nt":  # Windows removes no open file
            with contextlib.suppress(OSError):
                name.unlink()


def _lock(handle: int) -> bool:
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


@functools.lru_cache(maxsize=64)
def sweep(folder: Path, pattern: str = _PART) -> None:
    """Remove what killed processes left in a folder, once for each folder."""
    for path in folder.glob(pattern):
        with contextlib.suppress(OSError):  # another one was faster, or it is not ours
            if time.time() - path.lstat().st_mtime > LITTER_AGE:
                path.unlink()


@functools.lru_cache(maxsize=8)
def _sweep_sessions(folder: str) -> None:
    """The temporary folders of other Blenders of this user, once: on a farm there are many. Not through a link, which
    anyone may have put there."""
    for session in Path(folder).absolute().parent.glob("blender_*"):
        with contextlib.suppress(OSError):
            own = not hasattr(os, "getuid") or session.lstat().st_uid == os.getuid()
            if own and session.is_dir() and not session.is_symlink():
                sweep(session, _SCRATCH)
