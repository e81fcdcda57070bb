# SPDX-License-Identifier: GPL-3.0-or-later
"""`hybrid render`: frames of a .blend to pictures, passes and a report."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...presets import QUALITY
from ...settings_table import RENDER
from .. import api
from ..errors import HybridError
from ..pipeline import nodes
from ..render import handoff, images
from . import batch, frames, marks, setting_flags
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
    marks.add(render)
    render.add_argument("--preset", choices=[key.lower() for key in QUALITY], help="options beside it win")
    setting_flags.add(render, RENDER)
    render.add_argument("--resolution", type=resolution, metavar="WxH")
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
    if work[0].scene.render.use_multiview:
        raise HybridError("--handoff writes one view: switch Stereoscopy off (Properties > Output), or leave it out")
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
        preset=arguments.preset,
        resolution=arguments.resolution,
        **setting_flags.given(RENDER, arguments),
    )
    for view, own in (result.views or {"": result}).items():
        for name, path in shot.passes.items():
            plane = own.passes.get(name) if name not in batch.PASSES else getattr(own, name)
            path = images.with_suffix(path, shot.scene, view)
            images.write_exr(path, np.zeros_like(own.mask) if plane is None else plane)
    images.write_render_result(shot.picture, shot.scene)
    return result.report
