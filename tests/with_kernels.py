# SPDX-License-Identifier: GPL-3.0-or-later
"""A plugin of pytest: the tests run with all compiled kernels in use, as in Blender, not with numpy.

make test-kernels                # the tests of the tracer that hold whoever works it out; ARGS= for others
"""

import os
import sys
from pathlib import Path

import pytest

from hybrid_addon import accelerated
from hybrid_addon.tracer.kernels import loading

os.environ[loading.SWITCH] = "1"


def pytest_sessionstart() -> None:
    """Load them all first: what were loaded in the middle of a test would prove less."""
    loading.cache_in(Path(sys.prefix) / "kernels")
    loading.load()
    if accelerated.failed() or not accelerated.in_use():
        raise pytest.UsageError(f"there are no kernels to test with: {loading.line()} {accelerated.failed()}")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A kernel that failed was replaced by numpy, and its test passed: that is a failure here."""
    if accelerated.failed():
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
        sys.stderr.write(f"\nkernels failed: {accelerated.failed()}\n")


def pytest_report_header() -> str:
    """Who worked."""
    return loading.line()
