# SPDX-License-Identifier: GPL-3.0-or-later
"""`make demo`: render a sample scene hybrid and lay raster, mask, traced and composite side by side.

python tools/demo.py [SCENE.blend] [--output DIR] [--resolution WxH] [--samples N]
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from leave import leave  # noqa: E402

import hybrid_addon as hybrid  # noqa: E402
from hybrid_addon.blender import cli  # noqa: E402
from hybrid_addon.blender.render import images  # noqa: E402


def main() -> int:
    """Render, write, and say where everything is."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=ROOT / "sample_scenes" / "studio.blend")
    parser.add_argument("--output", type=Path, default=ROOT / "demo")
    parser.add_argument("--resolution", type=cli.resolution, default=(480, 360))
    parser.add_argument("--samples", type=int, help="instead of the file's")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    hybrid.register()
    bpy.ops.wm.open_mainfile(filepath=str(arguments.scene), load_ui=False)
    scene = bpy.context.scene
    try:
        result = hybrid.render(scene, resolution=arguments.resolution, samples=arguments.samples)
    except hybrid.HybridError as error:
        sys.stderr.write(f"demo: {error}\n")
        return 2
    written = write(scene, result, arguments.output)
    for line in cli_summary(result):
        print(line)
    for name, path in written.items():
        print(f"{name + ':':10} {path}")
    return 0


def cli_summary(result: hybrid.HybridResult) -> tuple[str, str]:
    """The panel's two lines."""
    from hybrid_addon.report.frame import summary

    return summary(result.report)


def write(scene: bpy.types.Scene, result: hybrid.HybridResult, folder: Path) -> dict[str, Path]:
    """Every picture as PNG (through the scene's view transform), the report as JSON, and all four in one row."""
    mask = np.repeat(result.mask[..., None], 4, axis=-1)
    mask[..., 3] = 1.0
    panels = {"raster": result.raster, "mask": mask, "traced": result.traced, "composite": result.image}
    paths = {}
    for name, pixels in panels.items():
        opaque = pixels.copy()
        opaque[..., 3] = 1.0  # over black: a PNG viewer shows what is there, not a checkerboard
        paths[name] = folder / f"{name}.png"
        view_transformed(scene, opaque, paths[name], raw=name == "mask")
    paths["all four"] = folder / "hybrid.png"
    row(list(paths.values())[:4], paths["all four"])
    paths["report"] = folder / "report.json"
    paths["report"].write_text(json.dumps(result.report, indent=1), encoding="utf-8")
    return paths


def view_transformed(scene: bpy.types.Scene, pixels: np.ndarray, path: Path, raw: bool) -> None:
    """Save scene-linear pixels as an 8-bit PNG the way Blender shows them; `raw` shows the numbers themselves."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(path.stem, width, height, alpha=True, float_buffer=True)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    transform = scene.view_settings.view_transform
    try:
        if raw:
            scene.view_settings.view_transform = "Raw"
        with images.image_settings(scene, "IMAGE", "PNG", "8"):
            image.save_render(str(path), scene=scene)
    finally:
        scene.view_settings.view_transform = transform
        bpy.data.images.remove(image)


def row(paths: list[Path], target: Path) -> None:
    """Paste pictures side by side."""
    import OpenImageIO as oiio

    pictures = [oiio.ImageBuf(str(path)) for path in paths]
    width, height = pictures[0].spec().width, pictures[0].spec().height
    whole = oiio.ImageBuf(oiio.ImageSpec(width * len(pictures), height, 3, "uint8"))
    for index, picture in enumerate(pictures):
        oiio.ImageBufAlgo.paste(whole, index * width, 0, 0, 0, oiio.ImageBufAlgo.channels(picture, (0, 1, 2)))
    whole.write(str(target))


if __name__ == "__main__":
    leave(main())
