# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints one digest for each film of the sample scenes, and each value of the stability cases.

Run before and after a change that must not change a picture, in the same environment, and compare the two outputs:

    python -m tools.film_digests > before.txt

EEVEE is not needed: the sample scenes are traced whole (mode Full), at three frames, with lights of some size, adaptive
sampling, rough rays and the data passes. Compiled kernels draw them, from the first ray on; HYBRID_KERNELS=0: numpy.
The two must not differ.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import numpy as np

from hybrid_addon.tracer.kernels.loading import line, load

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "tools"))

from leave import leave  # noqa: E402

PASSES = frozenset({"DEPTH", "NORMAL", "SAMPLES", "REFLECTION", "REFRACTION"})


def digest(*arrays: np.ndarray) -> str:
    """Of all bytes of these arrays."""
    content = hashlib.blake2b(digest_size=12)
    for array in arrays:
        content.update(f"{array.dtype}{array.shape}".encode())
        content.update(np.ascontiguousarray(array).tobytes())
    return content.hexdigest()


def sample_scenes() -> None:
    """Each .blend of sample_scenes/ at 80 pixels across, in two qualities."""
    import bpy

    import hybrid_addon as hybrid

    hybrid.register()
    for path in sorted((ROOT / "sample_scenes").glob("*.blend")):
        bpy.ops.wm.open_mainfile(filepath=str(path))
        scene = bpy.context.scene
        scale = 80 / scene.render.resolution_x
        scene.render.resolution_y = round(scene.render.resolution_y * scale)
        scene.render.resolution_x, scene.render.resolution_percentage = 80, 100
        scene.hybrid.passes = PASSES
        for frame, samples, adaptive, rough in ((1, 4, 0.0, 1), (20, 9, 0.05, 2), (33, 2, 0.01, 0)):
            scene.hybrid.adaptive, scene.hybrid.rough_samples = adaptive, rough
            result = hybrid.render(scene, frame=frame, mode="FULL", samples=samples)
            rays = sum(value for key, value in result.report["rays"].items() if isinstance(value, int))
            print(path.stem, frame, samples, digest(result.image, result.mask), rays, flush=True)


def stability() -> None:
    """The value of each case that needs no Blender, to the last bit, and its picture."""
    from hybrid_addon.measure.stability import CASES

    for case in CASES:
        found = case.run()
        picture = "-" if found.picture is None else digest(found.picture)
        print(case.name, repr(found.value), picture, flush=True)


if __name__ == "__main__":
    load()
    print(line(), file=sys.stderr)
    stability()
    sample_scenes()
    leave()
