# SPDX-License-Identifier: GPL-3.0-or-later
"""Forty materials as artists build them, on one stage: EEVEE, Hybrid at its defaults, and Cycles."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "tools"), str(ROOT / "sample_scenes")]
