# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the picture of the manual that shows *Denoise*: frosted glass and brushed metal of the first pictures.

python tools/denoise_picture.py OUTPUT.png

From left to right 4 samples, 4 samples denoised, and 32 samples, all ray traced.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

from demo import view_transformed  # noqa: E402
from first_picture import everyday, products  # noqa: E402
from leave import leave  # noqa: E402

import hybrid_addon as hybrid  # noqa: E402

SIZE = 240, 180
COLUMNS = ((4, False), (4, True), (32, False))


def main() -> int:
    """Draw the two scenes below one another."""
    output = Path(sys.argv[1])
    output.parent.mkdir(parents=True, exist_ok=True)
    hybrid.register()
    rows = []
    for build in (everyday.teapot, products.frosted):
        build()
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = SIZE
        scene.hybrid.mode, scene.hybrid.adaptive = "FULL", 0.0
        rows.append([hybrid.render(scene, samples=n, denoise=denoise).image for n, denoise in COLUMNS])
    whole = np.concatenate([np.concatenate(row, axis=1) for row in reversed(rows)])
    view_transformed(scene, whole, output, raw=False)
    print(output)
    return 0


if __name__ == "__main__":
    leave(main())
