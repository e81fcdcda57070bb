# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs pytest and leaves at once: bpy's static destructors can hang a process that has rendered with EEVEE (4.5).

Run as ``python tools/run_tests.py [pytest's arguments]``; the exit code is pytest's own.
"""

import sys

import pytest
from leave import leave

leave(int(pytest.main(sys.argv[1:])))
