# SPDX-License-Identifier: GPL-3.0-or-later
"""Fifteen scenes as an artist would first try the add-on on: EEVEE, Hybrid at its defaults, and Cycles, converged."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "tools"), str(ROOT / "sample_scenes")]
