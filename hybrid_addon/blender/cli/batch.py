# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of one `render`: scenes x cameras x frames, what is finished already, and the report of all of them."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from .. import api, files
from ..errors import HybridError
from ..pipeline import scene_setup
from ..render.images import paths_of, with_suffix
from ..view_layers import views
from . import frames
from .common import say
from .marks import find

ALL = "all"
PASSES = ("raster", "mask", "traced")
PROGRESS = ("text", "openjd")  # openjd: the lines that an Open Job Description session takes from a task's output


@dataclass(frozen=True)
class Shot:
    """One picture to render. passes : where its layers go, by name; empty if they are not wanted."""

    scene: bpy.types.Scene
    camera: bpy.types.Object | None
    frame: int
    picture: Path
    passes: dict[str, Path]

    @property
    def camera_name(self) -> str:
        """The camera's name, as far as it is known before the frame is set."""
        camera = self.camera or self.scene.camera
        return camera.name if camera else ""

    @property
    def finished(self) -> bool:
        """Whether all its files are there. They appear whole, and the picture last."""
        passes = [with_suffix(path, self.scene, view) for path in self.passes.values() for view in views(self.scene)]
        return all(path.is_file() for path in (*paths_of(self.picture, self.scene), *passes))


def choose_scenes(active: bpy.types.Scene, names: Sequence[str] | None) -> list[bpy.types.Scene]:
    """The named scenes, all that have a camera, or the file's own."""
    own = {scene.name: scene for scene in bpy.data.scenes if not scene_setup.is_trace_scene(scene)}
    if names == [ALL] and ALL not in own:
        return [scene for scene in own.values() if scene.camera]
    return [find(own, name, "scene", "the file") for name in names or [active.name]]


def choose_cameras(scene: bpy.types.Scene, names: Sequence[str] | None) -> list[bpy.types.Object | None]:
    """The named cameras, all of the scene, or [None]: the scene's own. HybridError for what cannot be rendered."""
    if not names:
        return [None]
    own = {ob.name: ob for ob in sorted(scene.objects, key=lambda ob: ob.name) if ob.type == "CAMERA"}
    everyone = names == [ALL] and ALL not in own
    chosen = list(own.values()) if everyone else [find(own, name, "camera", f"scene '{scene.name}'") for name in names]
    for camera in chosen or [None]:
        api.check_camera(scene, camera)
    return chosen


def shots(arguments: argparse.Namespace, scenes: Sequence[bpy.types.Scene]) -> list[Shot]:
    """Everything that one command renders, in order. HybridError if two of them would be one file."""
    found = []
    for scene in scenes:
        cameras = choose_cameras(scene, arguments.camera)
        for camera in cameras:
            tail = [frames.safe(scene.name)] if len(scenes) > 1 else []
            tail += [frames.safe(camera.name)] if camera and len(cameras) > 1 else []
            found += [_shot(scene, camera, frame, tail, arguments) for frame in _frames(scene, arguments)]
    _check_distinct(found)
    return found


def _shot(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    frame: int,
    tail: Sequence[str],
    arguments: argparse.Namespace,
) -> Shot:
    seen_by = camera or scene.camera
    names = {
        "scene_name": scene.name,
        "camera_name": seen_by.name if seen_by else "",
        "blend_name": arguments.file.stem,
    }
    numbered = bool(arguments.animation or arguments.frames)
    picture = frames.file_path(arguments.output, frame, names, numbered=numbered)
    passes = {}
    if arguments.passes:
        ends = "_".join(["", *tail, *([f"{frame:04d}"] if numbered else [])])
        wanted = (*PASSES, *sorted(name.lower() for name in scene.hybrid.passes))
        passes = {name: arguments.passes / f"{name}{ends}.exr" for name in wanted}
    return Shot(scene, camera, frame, picture, passes)


def _frames(scene: bpy.types.Scene, arguments: argparse.Namespace) -> list[int]:
    if arguments.animation:
        return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    return arguments.frames or [arguments.frame if arguments.frame is not None else scene.frame_current]


def _check_distinct(found: Sequence[Shot]) -> None:
    owners: dict[str, Shot] = {}
    for shot in found:
        for path in (shot.picture, *shot.passes.values()):
            other = owners.setdefault(os.path.normcase(path.absolute()), shot)
            if other is not shot:
                what = "{scene_name}" if other.scene != shot.scene else "{camera_name}"
                raise HybridError(f"several pictures would be '{path}': put {what} into the name in --output")


def run(work: Sequence[Shot], render: Callable[[Shot], None], *, skip_existing: bool, progress: str = "text") -> None:
    """Render them one after the other, saying how far it is after each: the lines of PROGRESS (docs/manual)."""
    for done, shot in enumerate(work, 1):
        if not skip_existing:
            render(shot)
        elif shot.finished:
            say(f"frame {shot.frame}: {shot.picture} is there already")
        else:
            with files.claim(shot.picture) as mine:
                if not mine:
                    say(f"frame {shot.frame}: another process renders {shot.picture}")
                elif not shot.finished:  # looked at again: it may have been finished while we asked
                    render(shot)
        where, percent = f"{done}/{len(work)} frame {shot.frame} camera {shot.camera_name}", done * 100 // len(work)
        if progress == "openjd":
            say(f"openjd_status: {where}", prefix="")
            say(f"openjd_progress: {percent}", prefix="")
        else:
            say(f"progress {where} {percent}%")


class Reports:
    """The report file: written whole after each frame, so that a killed batch keeps what it has done."""

    def __init__(self, path: Path | None, work: Sequence[Shot], *, single: bool, keep: bool) -> None:
        self._path, self._single = path, single
        self._order = [str(shot.picture) for shot in work]
        self._entries: dict[str, dict[str, Any]] = {}
        if keep and path is not None:
            self._entries = {entry["output"]: entry for entry in _read(path) if entry["output"] in self._order}

    def add(self, shot: Shot, report: dict[str, Any]) -> None:
        """One more frame."""
        entry = {**report, "scene": shot.scene.name, "camera": shot.camera_name, "output": str(shot.picture)}
        self._entries[entry["output"]] = entry
        if self._path is None:
            return
        done = [self._entries[name] for name in self._order if name in self._entries]
        whole = done[0] if self._single else {"schema": report["schema"], "frames": done}
        with files.atomic(self._path) as temporary:
            Path(temporary).write_text(json.dumps(whole, indent=1), encoding="utf-8")


def _read(path: Path) -> Iterator[dict[str, Any]]:
    """The frames of an earlier report. One that is none, or broken, counts for nothing."""
    try:
        whole = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return
    for entry in whole.get("frames", [whole]) if isinstance(whole, dict) else []:
        if isinstance(entry, dict) and isinstance(entry.get("output"), str):
            yield entry
