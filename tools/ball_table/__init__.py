# SPDX-License-Identifier: GPL-3.0-or-later
"""One ball for each closure node and each input of Principled at three values: hybrid beside EEVEE and Cycles."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tools"))
