# SPDX-License-Identifier: GPL-3.0-or-later
"""What instances cost, and Embree's scenes: memory of a whole trace, then builds and queries side by side.

    python -m tools.instance_memory

Each scene is traced in a process of its own (64 x 64 pixels, one sample, a field of instances), once small before
what is measured. Then our own Embree scene and embreex' of the same triangles are built and asked in turn in one
process: processor seconds, medians.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hybrid_addon import memory
from hybrid_addon.scene import Camera, Instance, PointLight, Scene, Settings, Surface, TriangleMesh, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.geometry import embree, instanced
from hybrid_addon.tracer.geometry.embree.embreex_scene import EmbreexScene
from hybrid_addon.tracer.kernels import loading

FIELDS = {
    "1000 of 5120 triangles, kept once": (1000, 4, True),
    "1000 of 5120 triangles, flattened": (1000, 4, False),
    "a million of 20 triangles, kept once": (1_000_000, 0, True),
}
ROUNDS, RAYS = 9, 200_000
SETTINGS = Settings(samples=1, camera_sees="ALL", threads=1)


def ball(levels: int) -> TriangleMesh:
    """An icosahedron, its triangles cut into four so many times."""
    g = (1 + 5**0.5) / 2
    v = np.array([(0, s, t * g) for s in (1, -1) for t in (1, -1)], float)
    v = np.concatenate([np.roll(v, k, axis=1) for k in range(3)])
    near = np.linalg.norm(v[:, None] - v, axis=2) < 2.1
    t = np.array(
        [(i, j, k) for i in range(12) for j in range(12) for k in range(12) if i < min(j, k) and j != k
         and near[i, j] and near[j, k] and near[k, i] and np.linalg.det(v[[i, j, k]]) > 0]
    )  # fmt: skip
    for _ in range(levels):
        corners = v[t]
        middle = (corners + corners[:, [1, 2, 0]]) / 2
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = middle.transpose(1, 0, 2)
        points = np.concatenate([np.stack(part, 1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        v, t = np.unique(points.reshape(-1, 3).round(12), axis=0, return_inverse=True)
        t = t.reshape(-1, 3)
    vertices = (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)
    triangles = t.astype(np.int32)
    return TriangleMesh("ball", vertices, triangles, triangles, normals=vertices)


def field(count: int, levels: int) -> Scene:
    """So many balls on a square of 8 m, seen from one side."""
    side = int(np.ceil(count**0.5))
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3] *= 3.2 / side
    matrices[:, 0, 3], matrices[:, 1, 3] = (part / side * 8 - 4 for part in np.divmod(np.arange(count), side))
    eye = np.eye(4)
    eye[:3, :3] = [[1, 0, 0], [0, 0.64, -0.77], [0, 0.77, 0.64]]
    eye[:3, 3] = 0, -6, 5
    camera = Camera("PERSP", eye, (-0.5, 0.5, -0.5, 0.5), (64, 64), (0, 0, 64, 64), 1e-3, 1e3)
    instances = tuple(Instance("ball", 0, matrix, (0,), True) for matrix in matrices)
    light = PointLight("lamp", position=(3, 2, 6), intensity=(200.0, 200.0, 200.0))
    surface = Surface(base_color=(0.3, 0.7, 0.2))
    return Scene(camera, (ball(levels),), instances, surfaces=(surface,), lights=(light,), world=World((0.3, 0.4, 0.5)))


def one(name: str) -> None:
    """Trace a field and say what that took."""
    count, levels, once = FIELDS[name]
    loading.load()
    if not once:
        setattr(instanced, "INSTANCING_FROM", 1 << 60)  # noqa: B010 (mypy: a constant is not assigned to)
    scene = field(count, levels)
    trace(field(4, 1), SETTINGS)
    before, began = memory.peak(), time.process_time()
    trace(scene, SETTINGS)
    seconds = time.process_time() - began
    print(f"{name:40s} {((memory.peak() or 0) - (before or 0)) / 2**20:7.0f} MB  {seconds:6.1f} s", flush=True)


def side_by_side() -> None:
    """Builds and queries of our own scene and of embreex'."""
    loading.load()
    mesh, rng = ball(6), np.random.default_rng(0)
    bumps = (mesh.vertices * (1 + 0.02 * rng.normal(size=(len(mesh.vertices), 1)))).astype(np.float32)
    origin = (2 * rng.normal(size=(3, RAYS))).astype(np.float32)
    direction = rng.normal(size=(3, RAYS))
    direction = (direction / np.sqrt((direction * direction).sum(0))).astype(np.float32)
    far = np.full(RAYS, 5, np.float32)
    found: dict[str, list[float]] = {}

    def timed(what: str, do: Callable[[], Any]) -> Any:
        began = time.process_time()
        result = do()
        found.setdefault(what, []).append(time.process_time() - began)
        return result

    for _ in range(ROUNDS):
        for name, kind in (("our own", embree.OwnScene), ("embreex", EmbreexScene)):
            scene = timed(f"{name}: build, {len(mesh.triangles)} triangles", partial(kind, bumps, mesh.triangles))
            timed(f"{name}: nearest hit", partial(scene.nearest, origin, direction))
            timed(f"{name}: any hit", partial(scene.occluded, origin, direction, far))
    for what, seconds in sorted(found.items()):
        median = statistics.median(seconds)
        rate = "" if "build" in what else f"  {RAYS / median / 1e6:5.1f} million rays/s"
        print(f"{what:40s} {median * 1e3:7.1f} ms{rate}")


def main() -> None:
    """All of it, each scene in a process of its own."""
    if len(sys.argv) > 1:
        return one(sys.argv[1])
    for name in FIELDS:
        subprocess.run([sys.executable, "-m", "tools.instance_memory", name], check=True, cwd=Path(__file__).parents[1])
    side_by_side()


if __name__ == "__main__":
    main()
