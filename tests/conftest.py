# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests run numpy, in this process and in those that they start: tests of kernels load them (tests/tracer/kernels)."""

import os

from hybrid_addon.tracer.kernels.loading import SWITCH

os.environ.setdefault(SWITCH, "0")
