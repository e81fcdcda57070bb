"""`hybrid render`: frames of a .blend to pictures, passes and a report."""

from __future__ import annotations

import argparse
import json
import re
from difflib import get_close_matches
from pathlib import Path

import bpy

from .. import api, images
from ..errors import HybridError
from .common import Verbs, check_outputs, number, open_file, picture, resolution, say


def add(verbs: Verbs) -> None:
    """Add the verb to the parser."""
    render = verbs.add_parser("render", help="render a .blend hybrid")
    render.set_defaults(verb=_render)
    render.add_argument("file", type=Path, metavar="FILE")
    render.add_argument("--output", type=picture, required=True, metavar="PATH", help="PNG or EXR, by its extension")
    when = render.add_mutually_exclusive_group()
    when.add_argument(
        "--frame", type=number(-1048574, 1048574, int), metavar="N", help="default: the file's current frame"
    )
    when.add_argument(
        "--animation", action="store_true", help="the file's frame range; #### in PATH is the frame number"
    )
    render.add_argument("--mode", choices=("hybrid", "raster", "full"), help="default: the file's own")
    render.add_argument("--ray-traced", nargs="+", metavar="NAME", help="flag these objects instead of the file's")
    render.add_argument("--reflectivity", type=number(0, 1), metavar="X", help="of the ray traced objects, 0..1")
    render.add_argument("--opacity", type=number(0, 1), metavar="X", help="of the ray traced objects, 0..1")
    render.add_argument("--ior", type=number(1e-6, 1e6), metavar="X", help="of the ray traced objects")
    render.add_argument("--samples", type=number(1, 65536, int), metavar="N", help="rays through each ray traced pixel")
    render.add_argument("--max-depth", type=number(0, 1024, int), metavar="N", help="bounces")
    render.add_argument("--light-falloff", choices=("eevee", "physical"), help="default: the file's own")
    render.add_argument("--resolution", type=resolution, metavar="WxH")
    render.add_argument("--threads", type=number(0, 1024, int), metavar="N", help="0: all cores")
    render.add_argument(
        "--report", type=Path, metavar="PATH.json", help="what was done, what it cost, what was left out"
    )
    render.add_argument("--passes", type=Path, metavar="DIR", help="also write raster, mask and traced as EXR")


def _render(arguments: argparse.Namespace) -> None:
    outputs = [path for path in (arguments.output, arguments.report) if path]
    check_outputs(outputs, arguments.passes)
    scene = open_file(arguments.file)
    _mark(scene, arguments)
    frames = [arguments.frame if arguments.frame is not None else scene.frame_current]
    if arguments.animation:
        frames = list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    reports = []
    for frame in frames:
        result = api.render(
            scene,
            frame=frame,
            mode=arguments.mode,
            samples=arguments.samples,
            max_depth=arguments.max_depth,
            light_falloff=arguments.light_falloff,
            resolution=arguments.resolution,
            threads=arguments.threads,
        )
        path = _frame_path(arguments.output, frame) if arguments.animation else arguments.output
        images.write_render_result(path, scene)
        if arguments.passes:
            _write_passes(arguments.passes, result, f"_{frame:04d}" if arguments.animation else "")
        reports.append({**result.report, "output": str(path)})
        for warning in result.report["warnings"]:
            say(f"warning: {warning}")
        seconds = result.report["time"]["total"]["wall"]
        say(f"frame {frame}: {path} ({seconds:.2f} s, {result.report['mask_coverage'] * 100:.1f} % ray traced)")
    if arguments.report:
        whole = {"schema": reports[0]["schema"], "frames": reports} if arguments.animation else reports[0]
        with images.atomic(arguments.report) as temporary:
            Path(temporary).write_text(json.dumps(whole, indent=1), encoding="utf-8")


def _mark(scene: bpy.types.Scene, arguments: argparse.Namespace) -> None:
    """Flag the named objects, with the values given; values without names go to all objects that are flagged."""
    values = {name: getattr(arguments, name) for name in ("reflectivity", "opacity", "ior")}
    if arguments.ray_traced:
        for b_object in scene.objects:
            b_object.hybrid.ray_traced = False
        chosen = [_find_object(scene, name) for name in arguments.ray_traced]
    else:
        given = any(value is not None for value in values.values())
        chosen = [ob for ob in scene.objects if ob.hybrid.ray_traced] if given else []
        if given and not chosen:
            raise HybridError("no object is ray traced: name some with --ray-traced")
    for b_object in chosen:
        api.mark(b_object, **values)


def _find_object(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    b_object = scene.objects.get(name)
    if b_object is None:
        close = get_close_matches(name, [ob.name for ob in scene.objects], n=1)
        hint = f"; did you mean '{close[0]}'?" if close else ""
        raise HybridError(f"no object '{name}' in scene '{scene.name}'{hint}")
    return b_object


def _write_passes(folder: Path, result: api.HybridResult, suffix: str) -> None:
    for name in ("raster", "mask", "traced"):
        images.write_exr(folder / f"{name}{suffix}.exr", getattr(result, name))


def _frame_path(path: Path, frame: int) -> Path:
    """shot.png -> shot0001.png; shot_###.png -> shot_001.png (Blender's own rule)."""
    hashes = re.search(r"#+", path.name)
    if hashes:
        name = path.name[: hashes.start()] + f"{frame:0{len(hashes.group())}d}" + path.name[hashes.end() :]
        return path.with_name(name)
    return path.with_name(f"{path.stem}{frame:04d}{path.suffix}")
