"""Blender's camera -> scene.Camera.

Source of the view plane: BKE_camera_params_compute_viewplane, re-derived; the test compares with
Object.calc_matrix_camera on random cameras.
"""

from __future__ import annotations

from typing import Literal, cast

import bpy
import numpy as np

from ...scene import Camera, Float64
from .messages import UnsupportedError, Warnings

Size = tuple[int, int]
Window = tuple[int, int, int, int]


def translate_camera(
    b_depsgraph: bpy.types.Depsgraph, b_scene: bpy.types.Scene, resolution: Size, window: Window, warn: Warnings
) -> Camera:
    """The scene's active camera, with its animated values; UnsupportedError if it has none that can be traced."""
    b_object = _active_camera(b_depsgraph, b_scene)
    b_camera = b_object.data
    _warn_of_blur(b_object, b_scene, warn)
    return Camera(
        projection=_projection(b_object),
        matrix_world=matrix_without_scale(b_object),
        view_plane=view_plane(b_camera, resolution, (b_scene.render.pixel_aspect_x, b_scene.render.pixel_aspect_y)),
        resolution=resolution,
        window=window,
        clip_start=b_camera.clip_start,
        clip_end=b_camera.clip_end,
    )


def _active_camera(b_depsgraph: bpy.types.Depsgraph, b_scene: bpy.types.Scene) -> bpy.types.Object:
    if b_scene.camera is None:
        raise UnsupportedError(f"scene {b_scene.name!r} has no camera; add one and make it the active camera")
    b_object = b_scene.camera.evaluated_get(b_depsgraph)
    if b_object.type != "CAMERA":
        raise UnsupportedError(
            f"scene {b_scene.name!r} looks through {b_object.name!r}, which is no camera but of type {b_object.type}; "
            "choose a camera"
        )
    return b_object


def _projection(b_object: bpy.types.Object) -> Literal["PERSP", "ORTHO"]:
    kind = b_object.data.type
    if kind not in ("PERSP", "ORTHO"):
        raise UnsupportedError(
            f"camera {b_object.name!r} is of type {kind}; set Lens > Type to Perspective or Orthographic"
        )
    return cast(Literal["PERSP", "ORTHO"], kind)


def matrix_without_scale(b_object: bpy.types.Object) -> Float64:
    """(4, 4) float64 camera to world; Blender drops a camera's scale (RE_GetCameraModelMatrix)."""
    matrix = np.array(b_object.matrix_world, dtype=np.float64)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    matrix[:3, :3] /= np.where(lengths > 0, lengths, 1.0)
    return matrix


def view_plane(
    b_camera: bpy.types.Camera, resolution: Size, pixel_aspect: tuple[float, float]
) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) of the full frame: at z = -1 for PERSP (unitless), in metres for ORTHO."""
    width, height = resolution
    aspect = pixel_aspect[1] / pixel_aspect[0]
    fit = _sensor_fit(b_camera, width, height, aspect)
    across = width if fit == "HORIZONTAL" else aspect * height  # length of the fitted side, in pixel widths
    pixel = _extent(b_camera) / across
    shift_x, shift_y = b_camera.shift_x * across, b_camera.shift_y * across
    half_x, half_y = 0.5 * width, 0.5 * height * aspect
    return (
        (shift_x - half_x) * pixel,
        (shift_x + half_x) * pixel,
        (shift_y - half_y) * pixel,
        (shift_y + half_y) * pixel,
    )


def _sensor_fit(b_camera: bpy.types.Camera, width: int, height: int, aspect: float) -> str:
    if b_camera.sensor_fit == "AUTO":
        return "HORIZONTAL" if width >= aspect * height else "VERTICAL"
    return b_camera.sensor_fit


def _extent(b_camera: bpy.types.Camera) -> float:
    """Length of the fitted side of the view plane: tangent units for PERSP, metres for ORTHO."""
    if b_camera.type == "ORTHO":
        return b_camera.ortho_scale
    sensor = b_camera.sensor_height if b_camera.sensor_fit == "VERTICAL" else b_camera.sensor_width
    return sensor / b_camera.lens


def _warn_of_blur(b_object: bpy.types.Object, b_scene: bpy.types.Scene, warn: Warnings) -> None:
    if b_object.data.dof.use_dof:
        warn.add(f"camera {b_object.name!r}: depth of field is not traced; ray traced objects are in focus")
    if b_scene.render.use_motion_blur:
        warn.add(f"scene {b_scene.name!r}: motion blur is not traced; ray traced objects stand still")
