# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception that people see: its text is one line that names what is wrong and what to do."""

from __future__ import annotations

import platform


class HybridError(ValueError):
    """Bad input (exit code 2 on the command line, an error report in the interface)."""


class TooLarge(HybridError):
    """It does not fit into this machine's memory. The work fails (exit code 1): elsewhere the same may do."""


def require_tracer() -> None:
    """Raise HybridError where the tracer cannot be imported: Embree, another file on each system, is missing."""
    try:
        from .. import tracer  # noqa: F401
    except ImportError as error:
        text = f"Embree does not load on {platform.platform()}: {error}; install this system's zip"
        raise HybridError(text) from error
