"""`hybrid render`: frames of a .blend to pictures, passes and a report."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...presets import QUALITY
from .. import api
from ..errors import HybridError
from ..pipeline import nodes
from ..render import handoff, images
from . import batch, frames, marks
from .common import Verbs, check_outputs, number, open_file, picture, resolution, say


def add(verbs: Verbs) -> None:
    """Add the verb to the parser."""
    render = verbs.add_parser("render", help="render a .blend hybrid")
    render.set_defaults(verb=_render)
    render.add_argument("file", type=Path, metavar="FILE")
    render.add_argument(
        "--output", type=picture, required=True, metavar="PATH",
        help="PNG or EXR, by its extension; #### is the frame, {camera_name}, {scene_name} and {blend_name} are names",
    )  # fmt: skip
    render.add_argument("--make-folder", action="store_true", help="make the output's folder if there is none")
    when = render.add_mutually_exclusive_group()
    limit = frames.FRAME_LIMIT
    when.add_argument("--frame", type=number(-limit, limit, int), metavar="N", help="default: the file's current frame")
    when.add_argument("--frames", type=_frames, metavar="LIST", help="as 1-10x2,15: every second from 1 to 10, and 15")
    when.add_argument("--animation", action="store_true", help="the file's frame range")
    several: dict[str, Any] = {"nargs": "+", "action": "extend", "metavar": "NAME"}
    render.add_argument("--scene", **several, help="'all': each that has a camera; default: the active")
    render.add_argument("--camera", **several, help="'all': every one; default: the scene's own")
    render.add_argument(
        "--skip-existing", action="store_true",
        help="leave out what is there already, and what another process renders at the moment",
    )  # fmt: skip
    render.add_argument("--file-outputs", action="store_true", help="let the file's own File Output nodes write too")
    render.add_argument("--progress", choices=batch.PROGRESS, default="text", help="openjd: for Open Job Description")
    render.add_argument("--mode", choices=("hybrid", "raster", "full"), help="default: the file's own")
    marks.add(render)
    render.add_argument("--preset", choices=[key.lower() for key in QUALITY], help="options beside it win")
    render.add_argument("--samples", type=number(1, 65536, int), metavar="N", help="rays through each ray traced pixel")
    render.add_argument("--max-depth", type=number(0, 1024, int), metavar="N", help="bounces")
    render.add_argument("--cutoff", type=number(0, 1), metavar="X", help="share that a sample may lose to small rays")
    render.add_argument(
        "--time-budget", type=number(0, 1e6), metavar="SECONDS",
        help="for a frame, EEVEE included; what does not fit is given up, samples first; 0: no limit",
    )  # fmt: skip
    render.add_argument("--adaptive", type=number(0, 0.99), metavar="X", help="contrast; 0: all samples everywhere")
    render.add_argument("--shadow-samples", type=number(0, 1024, int), metavar="N", help="0: hard shadows")
    render.add_argument("--occlusion-samples", type=number(0, 64, int), metavar="N", help="0: no ambient occlusion")
    render.add_argument("--occlusion-distance", type=number(0, 1e6), metavar="METRES", help="0: as EEVEE's Fast GI")
    render.add_argument("--rough-samples", type=number(0, 64, int), metavar="N", help="0: rough mirrors are sharp")
    render.add_argument(
        "--traced-shadows", nargs="?", const="on", choices=("auto", "off", "on"),
        help="who draws the shadows of ray traced objects on what EEVEE draws: on, the ray tracer; off, EEVEE",
    )  # fmt: skip
    render.add_argument("--no-traced-shadows", action="store_const", const="off", dest="traced_shadows", help="off")
    render.add_argument("--caustics", choices=("none", "simple", "photons"), help="of traced shadows")
    render.add_argument("--photons", type=number(1, 2e9, int), metavar="N", help="for caustics by photons")
    render.add_argument(
        "--raster-backed", action=argparse.BooleanOptionalAction,
        help="show EEVEE's own pixels in reflections where they are known, or shade everything there",
    )  # fmt: skip
    render.add_argument("--light-falloff", choices=("eevee", "physical"), help="default: the file's own")
    render.add_argument("--resolution", type=resolution, metavar="WxH")
    render.add_argument("--threads", type=number(0, 1024, int), metavar="N", help="0: all cores")
    render.add_argument(
        "--report", type=Path, metavar="PATH.json", help="what was done, what it cost, what was left out"
    )
    render.add_argument(
        "--passes", type=Path, metavar="DIR", help="also write raster, mask, traced and the data passes as EXR"
    )
    render.add_argument(
        "--handoff", action="store_true",
        help="also write DIR/composite.blend, from which Blender without the add-on composites the passes",
    )  # fmt: skip


def _frames(text: str) -> list[int]:
    try:
        return frames.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _render(arguments: argparse.Namespace) -> None:
    folders = [arguments.passes] if arguments.passes else []
    if arguments.make_folder:
        folders.append(arguments.output.parent)
    check_outputs([path for path in (arguments.output, arguments.report) if path], *folders)
    scenes = batch.choose_scenes(open_file(arguments.file), arguments.scene)
    for scene in scenes:
        marks.apply(scene, arguments)
    work = batch.shots(arguments, scenes)
    if arguments.handoff:
        _check_handoff(work, arguments)
    single = len(work) == 1 and not (arguments.animation or arguments.frames)
    reports = batch.Reports(arguments.report, work, single=single, keep=arguments.skip_existing)
    warned: set[str] = set()

    def render(shot: batch.Shot) -> None:
        report = _render_shot(shot, arguments)
        for warning in dict.fromkeys(report["warnings"]):
            if warning not in warned:
                warned.add(warning)
                say(f"warning: {warning}")
        seconds = report["time"]["total"]["wall"]
        reports.add(shot, report)
        say(f"frame {shot.frame}: {shot.picture} ({seconds:.2f} s, {report['mask_coverage'] * 100:.1f} % ray traced)")

    silenced = [] if arguments.file_outputs else _silence(scenes)
    batch.run(work, render, skip_existing=arguments.skip_existing, progress=arguments.progress)
    for node in silenced:
        node.mute = False
    if arguments.handoff:
        _hand_off(work, arguments)


def _silence(scenes: Sequence[bpy.types.Scene]) -> list[bpy.types.Node]:
    """Mute what would write where the file says, and not the user; say it. Returns the nodes."""
    trees = [tree for scene in scenes if (tree := nodes.compositor_tree(scene))]
    trees += [tree for tree in bpy.data.node_groups if tree.bl_idname == "CompositorNodeTree" and tree not in trees]
    found = [node for tree in trees for node in tree.nodes if node.type == "OUTPUT_FILE" and not node.mute]
    for node in found:
        node.mute = True
    if found:
        what = f"{len(found)} File Output node(s) of the file"
        say(f"warning: {what} write nothing: --file-outputs lets them write where the file says")
    return found


def _check_handoff(work: Sequence[batch.Shot], arguments: argparse.Namespace) -> None:
    if not arguments.passes:
        raise HybridError("--handoff needs --passes DIR: the folder for the layers and composite.blend")
    if len({(shot.scene, shot.camera) for shot in work}) > 1:
        raise HybridError("--handoff writes one scene, seen by one camera: render the others by commands of their own")
    if min(shot.frame for shot in work) < 0:
        raise HybridError("--handoff needs frames from 0 on: Blender numbers no file of a sequence below 0")


def _hand_off(work: Sequence[batch.Shot], arguments: argparse.Namespace) -> None:
    """The plain file beside the passes, of the size and camera they were rendered with."""
    first = min(work, key=lambda shot: shot.frame)
    path, numbers = arguments.passes / "composite.blend", [shot.frame for shot in work]
    numbered = bool(arguments.animation or arguments.frames)
    if arguments.resolution:
        b_render = first.scene.render
        b_render.resolution_x, b_render.resolution_y = arguments.resolution
        b_render.resolution_percentage = 100
    handoff.save(path, first.scene, first.camera, first.passes, numbers if numbered else [])
    say(f"hand-off: {path}")


def _render_shot(shot: batch.Shot, arguments: argparse.Namespace) -> dict[str, Any]:
    """One picture, written last: where it is, its layers are too. Returns the report."""
    if bpy.context.window:  # of any other scene 4.5 draws EEVEE's half even where nothing uses it
        bpy.context.window.scene = shot.scene
    result = api.render(
        shot.scene,
        camera=shot.camera,
        frame=shot.frame,
        mode=arguments.mode,
        preset=arguments.preset,
        samples=arguments.samples,
        max_depth=arguments.max_depth,
        cutoff=arguments.cutoff,
        adaptive=arguments.adaptive,
        time_budget=arguments.time_budget,
        shadow_samples=arguments.shadow_samples,
        rough_samples=arguments.rough_samples,
        occlusion_samples=arguments.occlusion_samples,
        occlusion_distance=arguments.occlusion_distance,
        traced_shadows=arguments.traced_shadows,
        caustics=arguments.caustics,
        photons=arguments.photons,
        raster_backed=arguments.raster_backed,
        light_falloff=arguments.light_falloff,
        resolution=arguments.resolution,
        threads=arguments.threads,
    )
    for name, path in shot.passes.items():
        plane = result.passes.get(name) if name not in batch.PASSES else getattr(result, name)
        images.write_exr(path, np.zeros_like(result.mask) if plane is None else plane)
    images.write_render_result(shot.picture, shot.scene)
    return result.report
