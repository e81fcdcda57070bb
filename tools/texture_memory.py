# SPDX-License-Identifier: GPL-3.0-or-later
"""What textures cost: memory of a whole render, and time of a look-up.

    python -m tools.texture_memory

Each scene is rendered in a process of its own (mode Full, 64 x 48 pixels): cubes with random images on them, and a
glass ball. Beside the process's growth stands what the images take as they are stored; then the nanoseconds of a
bilinear look-up at random places and at neighbouring ones, one kind of image after the other, the median of all
rounds.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

KINDS = {
    "4k-8-bit": (1, 4096, "uint8", "png"),
    "4k-float": (1, 4096, "float", "exr"),
    "20-of-2k": (20, 2048, "uint8", "png"),
}
ROUNDS = 9
POINTS = 1 << 16


def render(kind: str) -> None:
    """Make the images of one kind, render twice, and print what that took."""
    import bpy
    import OpenImageIO as oiio

    import hybrid_addon as hybrid
    from hybrid_addon import memory

    count, size, width, ending = KINDS[kind]
    hybrid.register()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    stored = 0
    with tempfile.TemporaryDirectory() as folder:
        for i in range(count):
            path = f"{folder}/{i}.{ending}"
            pixels = np.random.default_rng(i).integers(0, 255, (size, size, 3), dtype=np.uint8)
            spec = oiio.ImageSpec(size, size, 3, width)
            spec["png:compressionLevel"] = 1
            out = oiio.ImageOutput.create(path)
            assert out is not None
            out.open(path, spec)
            out.write_image(pixels)
            out.close()
            stored += size * size * (4 if width == "uint8" else 16)
            b_material = bpy.data.materials.new(f"Image {i}")
            if bpy.app.version < (5, 0, 0):
                b_material.use_nodes = True
            b_nodes, b_links = b_material.node_tree.nodes, b_material.node_tree.links
            b_texture = b_nodes.new("ShaderNodeTexImage")
            b_texture.image = bpy.data.images.load(path)
            b_links.new(b_texture.outputs["Color"], b_nodes["Principled BSDF"].inputs["Base Color"])
            bpy.ops.mesh.primitive_cube_add(size=0.4, location=(-2 + 0.5 * (i % 8), 2, 0.5 * (i // 8)))
            bpy.context.object.data.materials.append(b_material)
        del pixels
        bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 1))
        hybrid.mark(bpy.context.object, opacity=0.0)
        hybrid.enable(scene)
        before = memory.peak() or 0
        seconds = []
        for _ in range(2):
            began = time.perf_counter()
            hybrid.render(mode="full", samples=1)
            seconds.append(time.perf_counter() - began)
        grown = ((memory.peak() or 0) - before) / 2**20
    print(f"{kind}: {stored / 2**20:.0f} MB stored, {grown:.0f} MB grown, {seconds[0]:.1f} s, again {seconds[1]:.1f} s")


def lookups() -> None:
    """Nanoseconds of one bilinear look-up, for kinds of images, side by side."""
    from hybrid_addon.scene import Texels
    from hybrid_addon.tracer.materials.textures import lookup

    rng = np.random.default_rng(0)
    curve = rng.random(256).astype(np.float32)
    for size in (512, 4096):
        bytes_ = rng.integers(0, 255, (size, size, 4), dtype=np.uint8)
        floats = bytes_.astype(np.float32)
        images = {
            "float32 RGBA": floats, "8-bit sRGB": Texels(bytes_, curve), "half RGBA": Texels(floats.astype(np.float16)),
            "8-bit grey": Texels(bytes_[..., :1].copy()), "8-bit times alpha": Texels(bytes_, curve, multiplies=True),
        }  # fmt: skip
        random = rng.random((2, POINTS), np.float32)
        side = np.arange(POINTS, dtype=np.float32)
        near = np.stack([side % 256, side // 256]) * np.float32(0.7 / size) + np.float32(0.1)
        for name, (u, v) in (("random", random), ("near", near)):
            taken: dict[str, list[float]] = {kind: [] for kind in images}
            for _ in range(ROUNDS):
                for kind, image in images.items():
                    began = time.perf_counter()
                    lookup(image, u, v, "REPEAT", "REPEAT")
                    taken[kind].append((time.perf_counter() - began) / POINTS * 1e9)
            medians = {kind: statistics.median(each) for kind, each in taken.items()}
            print(f"{size}, {name}: " + ", ".join(f"{kind} {each:.0f} ns" for kind, each in medians.items()))


def main() -> None:
    """All kinds, then the look-ups."""
    if len(sys.argv) > 1:
        render(sys.argv[1])
        return
    for kind in KINDS:
        command = [sys.executable, "-m", "tools.texture_memory", kind]
        found = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[1], check=False)
        lines = [line for line in found.stdout.splitlines() if line.startswith(kind)]
        print("\n".join(lines) or f"{kind}: failed: {found.stderr[-300:]}", flush=True)
    lookups()


if __name__ == "__main__":
    main()
