# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads all kernels once, with a cache that outlives the run (in the environment's folder)."""

import sys
from pathlib import Path

import numba  # noqa: F401  (an environment without it fails here: no kernel would be compared)
import pytest

from hybrid_addon import accelerated
from hybrid_addon.tracer.kernels import loading


@pytest.fixture(scope="session")
def loaded():
    """The loading module, with all kernels loaded and out of use."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(loading.SWITCH, "1")
        loading.cache_in(Path(sys.prefix) / "kernels")
        loading.load()
    accelerated.use(False)
    return loading


@pytest.fixture
def kernels(loaded):
    """The same, in use for one test."""
    accelerated.use(True)
    yield loaded
    accelerated.use(False)
