# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture from each camera of a scene, into files, one after the other, from the window."""

# No `from __future__ import annotations` here: Blender reads operator properties from the annotations themselves.

import re
from pathlib import Path
from typing import Any

import bpy

from .. import session
from .translations import iface, sentence

WAIT_SECONDS = 0.2
"""Between two looks at whether a picture is done."""


class HYBRID_OT_render_cameras(bpy.types.Operator):
    bl_idname = "hybrid.render_cameras"
    bl_label = "Render All Cameras"
    bl_description = "Render this frame from each camera into a file named after it, in the folder of Output"
    bl_options = {"REGISTER"}

    which: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Cameras",
        items=[
            ("ALL", "All", "Every camera of the scene that is not hidden in renders"),
            ("SELECTED", "Selected", "The selected cameras"),
        ],
    )
    _timer: Any = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if bpy.app.is_job_running("RENDER"):
            cls.poll_message_set("A render is running")
            return False
        if any(b_object.type == "CAMERA" for b_object in context.scene.objects):
            return True
        cls.poll_message_set("The scene has no camera")
        return False

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.prop(self, "which", expand=True)
        for path in pictures(context.scene, chosen(context, self.which)).values():
            layout.label(text=path.name, icon="CAMERA_DATA", translate=False)

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        self._waiting = list(pictures(scene, chosen(context, self.which)).items())
        self._done, self._failed = 0, list[str]()
        if not self._waiting:
            self.report({"WARNING"}, iface("No camera is selected"))
            return {"CANCELLED"}
        self._scene, self._before = scene.name, (scene.camera, scene.render.filepath)
        if bpy.app.background:
            while self._waiting:
                self._begin(scene, "EXEC_DEFAULT")
                self._ended(scene)
            return self._finish(scene)
        self._stopped, self._running = False, False
        self._handler = lambda *_: setattr(self, "_stopped", True)
        bpy.app.handlers.render_cancel.append(self._handler)
        self._timer = context.window_manager.event_timer_add(WAIT_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type != "TIMER" or bpy.app.is_job_running("RENDER"):
            return {"PASS_THROUGH"}
        scene = bpy.data.scenes.get(self._scene)
        if scene is None:
            return self._leave(context, None)
        if self._running:
            self._running = False
            if not self._stopped:
                self._ended(scene)
        if self._stopped or not self._waiting:
            return self._leave(context, scene)
        self._running = True
        try:
            self._begin(scene, "INVOKE_DEFAULT")
        except RuntimeError as error:  # Blender has said why
            self._running = False
            self._failed.append(str(error).strip())
        return {"PASS_THROUGH"}

    def _begin(self, scene: bpy.types.Scene, how: str) -> None:
        scene.camera, self._path = self._waiting.pop(0)
        self._was_there = self._path.exists()
        scene.render.filepath = str(self._path)
        bpy.ops.render.render(how, write_still=True, scene=scene.name)

    def _ended(self, scene: bpy.types.Scene) -> None:
        """One picture is done, or has failed: then the others are tried."""
        error = session.of(scene.name).error
        if error is None:
            self._done += 1
            return
        self._failed.append(f"{self._path.stem}: {error}")
        if not self._was_there:  # Blender saves EEVEE's half, with a hole in it
            self._path.unlink(missing_ok=True)

    def _leave(self, context: bpy.types.Context, scene: bpy.types.Scene | None) -> set[str]:
        context.window_manager.event_timer_remove(self._timer)
        if self._handler in bpy.app.handlers.render_cancel:  # not so after another file was opened
            bpy.app.handlers.render_cancel.remove(self._handler)
        return {"CANCELLED"} if scene is None else self._finish(scene)

    def _finish(self, scene: bpy.types.Scene) -> set[str]:
        scene.camera, scene.render.filepath = self._before
        folder = Path(bpy.path.abspath(scene.render.filepath)).parent
        self.report({"INFO"}, iface("Pictures rendered: {}, in {}").format(self._done, folder))
        for text in self._failed:
            self.report({"ERROR"}, sentence(text))
        return {"FINISHED"}


def chosen(context: bpy.types.Context, which: str) -> list[bpy.types.Object]:
    """The cameras to render from, by name."""
    scene = context.scene
    found = [b_object for b_object in scene.objects if b_object.type == "CAMERA" and not b_object.hide_render]
    if which == "SELECTED":
        found = [b_object for b_object in found if b_object.select_get()]
    return sorted(found, key=lambda b_object: b_object.name)


def pictures(scene: bpy.types.Scene, cameras: list[bpy.types.Object]) -> dict[bpy.types.Object, Path]:
    """Where each camera's picture goes: beside the file of Output, with the camera's name; no two into one file."""
    output = bpy.path.abspath(scene.render.filepath)
    extension = scene.render.file_extension
    path = Path(output, "") if output.endswith(("/", "\\")) else Path(output)
    name = "" if output.endswith(("/", "\\")) else path.name.removesuffix(extension) + "_"
    folder = path if not name else path.parent
    name = re.sub("#+", lambda marks: f"{scene.frame_current:0{len(marks[0])}d}", name)
    found: dict[bpy.types.Object, Path] = {}
    for camera in cameras:
        stem = name + bpy.path.clean_name(camera.name)
        number = sum(other.stem == stem or other.stem.startswith(f"{stem}.") for other in found.values())
        found[camera] = folder / (stem + (f".{number:03d}" if number else "") + extension)
    return found


CLASSES = (HYBRID_OT_render_cameras,)
