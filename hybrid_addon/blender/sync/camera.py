# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera -> scene.Camera.

Source of the view plane: BKE_camera_params_compute_viewplane, re-derived; the test compares with
Object.calc_matrix_camera on random cameras.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import bpy
import numpy as np

from ...scene import Camera, Float64, Lens, Panorama
from ..view_layers import camera_in_work
from .coverage import name_settings
from .messages import UnsupportedError, Warnings

Size = tuple[int, int]
Window = tuple[int, int, int, int]
Eye = Callable[[bpy.types.Object], tuple[Any, float]]
"""Where the view in work has an evaluated camera: its matrix to world, (4, 4) without scale, and its Shift X."""

ORTHO_APERTURE = 0.04
"""An orthographic camera has no focal length: in EEVEE it is this share of the focus distance (in Cycles, 1 metre)."""
MIN_FSTOP = MIN_FOCUS = 1e-5
"""EEVEE's guards."""


def translate_camera(
    b_depsgraph: bpy.types.Depsgraph,
    b_scene: bpy.types.Scene,
    resolution: Size,
    window: Window,
    warn: Warnings,
    eye: Eye | None = None,
) -> Camera:
    """The scene's active camera, with its animated values; UnsupportedError if it has none that can be traced.

    eye : where the view in work has it; None for where it stands.
    """
    b_object = _active_camera(b_depsgraph, b_scene)
    b_camera = b_object.data
    name_settings(b_camera, f"camera {b_object.name!r}", warn)
    matrix, shift_x = (matrix_without_scale(b_object), b_camera.shift_x) if eye is None else eye(b_object)
    aspect, panorama = (b_scene.render.pixel_aspect_x, b_scene.render.pixel_aspect_y), None
    plane = view_plane(b_camera, resolution, aspect, shift_x)
    b_mapping = panorama_settings(b_camera)
    if b_camera.type == "PANO" and b_scene.hybrid.mode == "FULL" and b_mapping is not None:
        panorama = _panorama(b_camera, b_mapping, resolution, aspect)
        plane = shift_x, 1 + shift_x, b_camera.shift_y, 1 + b_camera.shift_y  # by the frame, whichever side fits
    return Camera(
        projection=_projection(b_object, warn) if panorama is None else "PANO",
        matrix_world=np.array(matrix, np.float64),
        view_plane=plane,
        resolution=resolution,
        window=window,
        clip_start=b_camera.clip_start,
        clip_end=b_camera.clip_end,
        lens=lens(b_object),
        panorama=panorama,
    )


def _active_camera(b_depsgraph: bpy.types.Depsgraph, b_scene: bpy.types.Scene) -> bpy.types.Object:
    b_chosen = camera_in_work(b_scene)
    if b_chosen is None:
        raise UnsupportedError(f"scene {b_scene.name!r} has no camera; add one and make it the active camera")
    b_object = b_chosen.evaluated_get(b_depsgraph)
    if b_object.type != "CAMERA":
        raise UnsupportedError(
            f"scene {b_scene.name!r} looks through {b_object.name!r}, which is no camera but of type {b_object.type}; "
            "choose a camera"
        )
    return b_object


def _projection(b_object: bpy.types.Object, warn: Warnings) -> Literal["PERSP", "ORTHO"]:
    """EEVEE draws every camera that is not orthographic as the perspective one of its lens."""
    kind = b_object.data.type
    if kind not in ("PERSP", "ORTHO"):
        name = b_object.data.bl_rna.properties["type"].enum_items[kind].name
        warn.add(f"camera {b_object.name!r}: its type {name} is Cycles' alone; drawn as Perspective, as EEVEE draws it")
    if kind == "PANO":
        warn.add(f"camera {b_object.name!r}: Advanced > Trace: Everything draws it as a panorama")
    return "ORTHO" if kind == "ORTHO" else "PERSP"


def panorama_settings(b_camera: bpy.types.Camera) -> Any:
    """What has the settings of a panorama: the camera since Blender 5.0, until then what Cycles adds; None: nothing."""
    return b_camera if hasattr(b_camera, "panorama_type") else getattr(b_camera, "cycles", None)


def _panorama(
    b_camera: bpy.types.Camera, b_mapping: Any, resolution: Size, pixel_aspect: tuple[float, float]
) -> Panorama:
    """How a panoramic camera maps directions, as Cycles reads its settings."""
    kind = b_mapping.panorama_type
    found = Panorama(
        kind=kind,
        longitude=(b_mapping.longitude_min, b_mapping.longitude_max),
        latitude=(b_mapping.latitude_min, b_mapping.latitude_max),
        field_of_view=b_mapping.fisheye_fov,
        lens=b_mapping.fisheye_lens,
        sensor=_sensor(b_camera, resolution, pixel_aspect),
    )
    if kind == "CENTRAL_CYLINDRICAL":
        longitude, height = (
            tuple(getattr(b_mapping, f"central_cylindrical_range_{axis}_{end}") for end in ("min", "max"))
            for axis in "uv"
        )
        return replace(found, longitude=longitude, height=height, radius=b_mapping.central_cylindrical_radius)
    if kind == "FISHEYE_LENS_POLYNOMIAL":
        k0, k1, k2, k3, k4 = (getattr(b_mapping, f"fisheye_polynomial_k{power}") for power in range(5))
        return replace(found, polynomial=(k0, k1, k2, k3, k4))
    return found


def _sensor(b_camera: bpy.types.Camera, resolution: Size, pixel_aspect: tuple[float, float]) -> tuple[float, float]:
    """Millimetres (width, height) of the sensor under the full frame."""
    width, height = resolution[0] * pixel_aspect[0], resolution[1] * pixel_aspect[1]
    fit = _sensor_fit(b_camera, resolution[0], resolution[1], pixel_aspect[1] / pixel_aspect[0])
    size = b_camera.sensor_height if b_camera.sensor_fit == "VERTICAL" else b_camera.sensor_width
    return (size, size * height / width) if fit == "HORIZONTAL" else (size * width / height, size)


def matrix_without_scale(b_object: bpy.types.Object) -> Float64:
    """(4, 4) float64 camera to world; Blender drops a camera's scale (RE_GetCameraModelMatrix)."""
    matrix = np.array(b_object.matrix_world, dtype=np.float64)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    matrix[:3, :3] /= np.where(lengths > 0, lengths, 1.0)
    return matrix


def view_plane(
    b_camera: bpy.types.Camera, resolution: Size, pixel_aspect: tuple[float, float], shift_x: float | None = None
) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) of the full frame: at z = -1 for PERSP (unitless), in metres for ORTHO.

    shift_x : instead of the camera's own, for one of several views.
    """
    width, height = resolution
    aspect = pixel_aspect[1] / pixel_aspect[0]
    fit = _sensor_fit(b_camera, width, height, aspect)
    across = width if fit == "HORIZONTAL" else aspect * height  # length of the fitted side, in pixel widths
    pixel = _extent(b_camera) / across
    shift_x, shift_y = (b_camera.shift_x if shift_x is None else shift_x) * across, b_camera.shift_y * across
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


def lens(b_object: bpy.types.Object) -> Lens | None:
    """The thin lens of an evaluated camera, of EEVEE's size (`DepthOfField::sync`), or None."""
    b_camera = b_object.data
    b_dof = b_camera.dof
    if not b_dof.use_dof:
        return None
    focus = max(_focus(b_object), MIN_FOCUS)
    size = ORTHO_APERTURE * focus if b_camera.type == "ORTHO" else b_camera.lens * 1e-3
    return Lens(
        radius=size / (2 * max(b_dof.aperture_fstop, MIN_FSTOP)),
        focus_distance=focus,
        blades=b_dof.aperture_blades,
        rotation=b_dof.aperture_rotation,
        ratio=b_dof.aperture_ratio,
    )


def _focus(b_object: bpy.types.Object) -> float:
    """Metres along the view axis to what is in focus: an object, a bone of it, or the distance that is set."""
    b_dof = b_object.data.dof
    b_target = b_dof.focus_object
    if b_target is None:
        return b_dof.focus_distance
    place = b_target.matrix_world
    b_bone = b_target.pose.bones.get(b_dof.focus_subtarget) if b_target.pose and b_dof.focus_subtarget else None
    if b_bone is not None:
        place = place @ b_bone.matrix
    matrix = matrix_without_scale(b_object)
    return float(abs(matrix[:3, 2] @ (np.array(place)[:3, 3] - matrix[:3, 3])))
