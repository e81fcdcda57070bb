# SPDX-License-Identifier: GPL-3.0-or-later
"""Main memory: what is to be had of it, what this process has used, and a refusal in one line before it runs out."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

MEGABYTE, GIGABYTE = 1 << 20, 1 << 30

REFUSED = "not enough memory"
"""How every such line begins."""

NAMED = 3  # parts that a refusal names

V1_UNLIMITED = 1 << 60  # control groups of version 1 say such numbers where there is no limit


class NotEnoughMemory(MemoryError):
    """What is asked for does not fit into memory: one line that says what takes it and what to do."""


def require(parts: Mapping[str, int], advice: str, there: int | None = None) -> None:
    """Raise NotEnoughMemory if the sum of `parts`, name -> bytes still to be taken, is more than what is to be had.

    A machine that cannot tell what is to be had refuses nothing. there: bytes to be had, if known already.
    """
    there, needed = available() if there is None else there, sum(parts.values())
    if there is None or needed <= there:
        return
    largest = sorted(parts.items(), key=lambda part: -part[1])[:NAMED]
    takes = ", ".join(f"{name} {amount(size)}" for name, size in largest if size)
    raise NotEnoughMemory(f"{REFUSED}: {takes}, of {amount(there)} that are free; {advice}")


def amount(size: float) -> str:
    """Bytes for people: '64 MB', '1.5 GB' (of 2^20 and 2^30 bytes)."""
    if size >= GIGABYTE:
        return f"{size / GIGABYTE:.1f} GB"
    return f"{size / MEGABYTE:.0f} MB" if size >= 10 * MEGABYTE else f"{size / MEGABYTE:.1f} MB"


def available() -> int | None:
    """Bytes that can be taken before the machine swaps or the process is ended; None: it does not say."""
    try:
        if sys.platform == "linux":
            return min((room for room in (_of_machine(), *_of_groups()) if room is not None), default=None)
        if sys.platform == "win32":
            return _of_windows()
        if sys.platform == "darwin":
            return _of_macos()
    except (OSError, ValueError, AttributeError):
        pass
    return None


def peak() -> int | None:
    """Bytes of main memory that this process has held at most, since it began; None: it does not say."""
    try:
        if sys.platform == "win32":
            return _peak_of_windows()
        if sys.platform == "linux":
            return _kilobytes("VmHWM", Path("/proc/self/status"))
        import resource

        largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return largest if sys.platform == "darwin" else largest * 1024
    except (ImportError, OSError, AttributeError):
        return None


# ------------------------------------------------------------------------------------------------ Linux


def _of_machine(meminfo: Path = Path("/proc/meminfo")) -> int | None:
    """MemAvailable: free memory, and caches that can be dropped."""
    return _kilobytes("MemAvailable", meminfo)


def _kilobytes(wanted: str, file: Path) -> int | None:
    """Bytes, of a file with lines "name: n kB". The peak that `getrusage` has begins at that of the parent process."""
    for line in file.read_text().splitlines():
        name, _, value = line.partition(":")
        if name == wanted:
            return int(value.split()[0]) * 1024
    return None


def _of_groups(own: Path = Path("/proc/self/cgroup"), root: Path = Path("/sys/fs/cgroup")) -> list[int]:
    """What the control groups that this process is in leave to it (containers, batch systems, systemd)."""
    found: list[int] = []
    lines = own.read_text().splitlines() if own.is_file() else []
    for line in lines:
        _, kinds, path = line.split(":", 2)
        if not kinds:
            folder, names = root, ("memory.max", "memory.current", "inactive_file")
        elif "memory" in kinds.split(","):
            folder = root / "memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        else:
            continue
        group = PurePosixPath(path.lstrip("/"))
        for each in (group, *group.parents):
            room = _of_group(folder / each, *names)
            if room is not None:
                found.append(room)
    return found


def _of_group(folder: Path, limit: str, used: str, cache: str) -> int | None:
    """The limit of one control group less what it uses; file caches can be dropped."""
    try:
        text = (folder / limit).read_text().strip()
        if text == "max" or int(text) > V1_UNLIMITED:
            return None
        statistics = dict(line.split()[:2] for line in (folder / "memory.stat").read_text().splitlines())
        return max(0, int(text) - int((folder / used).read_text()) + int(statistics.get(cache, 0)))
    except (OSError, ValueError):
        return None


# ------------------------------------------------------------------------------------------------ Windows and macOS


class _MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of sysinfoapi.h."""

    _fields_ = (
        ("length", ctypes.c_uint32),
        ("load", ctypes.c_uint32),
        *((name, ctypes.c_uint64) for name in ("total", "free", "total_page", "free_page", "total_virtual")),
        ("free_virtual", ctypes.c_uint64),
        ("free_extended", ctypes.c_uint64),
    )


class _ProcessMemory(ctypes.Structure):
    """PROCESS_MEMORY_COUNTERS of psapi.h."""

    _fields_ = (
        ("length", ctypes.c_uint32),
        ("faults", ctypes.c_uint32),
        ("peak", ctypes.c_size_t),
        *((f"other_{i}", ctypes.c_size_t) for i in range(7)),
    )


def _of_windows() -> int | None:
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    found = ctypes.CDLL("kernel32").GlobalMemoryStatusEx(ctypes.byref(status))
    return int(status.free) if found else None


def _peak_of_windows() -> int | None:
    kernel, counters = ctypes.CDLL("kernel32"), _ProcessMemory(length=ctypes.sizeof(_ProcessMemory))
    kernel.GetCurrentProcess.restype = ctypes.c_void_p
    process = ctypes.c_void_p(kernel.GetCurrentProcess())
    found = kernel.K32GetProcessMemoryInfo(process, ctypes.byref(counters), counters.length)
    return int(counters.peak) if found else None


def _of_macos() -> int | None:
    """Free and inactive pages (mach/vm_statistics.h, HOST_VM_INFO64): those that can be had without swapping."""
    system = ctypes.CDLL("/usr/lib/libSystem.dylib")
    pages, count, size = (ctypes.c_uint32 * 64)(), ctypes.c_uint32(38), ctypes.c_size_t()
    system.mach_host_self.restype = ctypes.c_uint32
    host = system.mach_host_self()
    if system.host_statistics64(host, 4, pages, ctypes.byref(count)) or system.host_page_size(host, ctypes.byref(size)):
        return None
    free, _active, inactive = pages[0], pages[1], pages[2]
    return (free + inactive) * size.value
