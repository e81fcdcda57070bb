# SPDX-License-Identifier: GPL-3.0-or-later
"""The door: scenes that cannot be traced are refused with one line that names what is wrong."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ...scene import (
    Camera,
    Expression,
    Float32,
    FogBody,
    Int32,
    Medium,
    Plane,
    Scene,
    Settings,
    Sphere,
    Surface,
    TriangleMesh,
    World,
)
from ..core.panorama import MAPPINGS
from ..emitters.lights import kind_of

_SHARES = ("reflectivity", "opacity")
_SCALARS = ("ambient", "diffuse", "roughness", "coat", "coat_roughness", "sheen", "sheen_roughness")
_COLORS = (
    "base_color", "specular", "emission", "reflection_tint", "transmission_tint", "interface_tint", "coat_tint",
    "sheen_tint", "absorption",
)  # fmt: skip


def validate(scene: Scene, settings: Settings, mask: Float32 | None) -> None:
    """Raise ValueError for anything that the tracer has no answer to."""
    _check_settings(settings)
    _check_camera(scene)
    _check_mask(scene, mask)
    _check_raster(scene)
    for mesh in scene.meshes:
        _check_mesh(mesh)
    _check_references(scene)
    for number, surface in enumerate(scene.surfaces):
        _check_surface(scene, number, surface)
    for shape in _shapes(scene):
        _check_shape(shape)
    _check_lights(scene)
    for medium in (*scene.fog.media, *(s.fog for s in scene.surfaces if s.fog is not None)):
        _check_medium(medium)
    for body in scene.fog.bodies:
        _check_grids(body)
    _require(scene.fog.steps >= 1, f"fog: steps must be at least 1, got {scene.fog.steps}")
    for world in (scene.world, scene.world.backdrop):
        _check_world(world or scene.world)


def _check_world(world: World) -> None:
    if isinstance(world.radiance, Expression):
        _require(world.environment is None, "world: radiance varies by itself, it cannot have an environment, too")
    else:
        _require(_finite(world.radiance), f"world: radiance must be finite, got {world.radiance}")
    _require(bool(np.isfinite(world.rotation).all()), "world: rotation must be finite")
    if world.sun is not None:
        _require(world.sun.threshold > 0, f"world: the sun's threshold must be > 0, got {world.sun.threshold}")


def _check_medium(medium: Medium) -> None:
    for name in ("absorption", "scattering", "emission"):
        value = getattr(medium, name)
        sound = isinstance(value, Expression) or (_finite(value) and min(value) >= 0)
        _require(sound, f"fog: {name} must be finite and not negative, got {value}")
    g = medium.anisotropy
    _require(isinstance(g, Expression) or -1 < g < 1, f"fog: anisotropy must lie between -1 and 1, got {g}")


def _check_grids(body: FogBody) -> None:
    for name, grid in body.grids.items():
        sound = grid.values.ndim == 4 and min(grid.values.shape) > 0 and grid.values.shape[3] in (1, 3, 4)
        _require(sound, f"fog {body.name!r}: grid {name!r} must be (nx, ny, nz, 1, 3 or 4), got {grid.values.shape}")
        _require(bool(np.isfinite(grid.from_local).all()), f"fog {body.name!r}: grid {name!r} must have a finite place")


def _shapes(scene: Scene) -> list[Sphere | Plane]:
    return [*scene.spheres, *scene.planes]


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


def _within(indices: Int32, size: int) -> bool:
    """Whether all indices lie in 0 .. size - 1 (Embree reads out of bounds otherwise)."""
    return bool(np.min(indices) >= 0 and np.max(indices) < size)


def _finite(values: Iterable[float]) -> bool:
    return all(math.isfinite(v) for v in values)


def _check_settings(settings: Settings) -> None:
    _require(settings.samples >= 1, f"settings: samples must be at least 1, got {settings.samples}")
    _require(settings.max_depth >= 0, f"settings: max_depth must not be negative, got {settings.max_depth}")
    _require(settings.chunk >= 1, f"settings: chunk must be at least 1, got {settings.chunk}")
    _require(settings.threads >= 0, f"settings: threads must not be negative, got {settings.threads}")
    _require(
        math.isfinite(settings.filter_radius) and settings.filter_radius >= 0,
        f"settings: filter_radius must be finite and not negative, got {settings.filter_radius}",
    )
    _require(
        settings.shadow_samples >= 0, f"settings: shadow_samples must be at least 0, got {settings.shadow_samples}"
    )
    _require(
        settings.occlusion_samples >= 0 and settings.occlusion_distance > 0,
        f"settings: occlusion_samples must be at least 0 and occlusion_distance more, "
        f"got {settings.occlusion_samples} and {settings.occlusion_distance}",
    )
    _require(settings.rough_samples >= 0, f"settings: rough_samples must be at least 0, got {settings.rough_samples}")
    _require(0 <= settings.cutoff < 1, f"settings: cutoff must lie in 0..1, got {settings.cutoff}")
    _require(0 <= settings.adaptive < 1, f"settings: adaptive must lie in 0..1, got {settings.adaptive}")
    caustics = ("NONE", "SIMPLE", "PHOTONS")
    _require(
        settings.caustics in caustics,
        f"settings: caustics must be NONE, SIMPLE or PHOTONS, got {settings.caustics!r}",
    )
    _require(0 <= settings.photons < 1 << 31, f"settings: photons must lie in 0..2^31, got {settings.photons}")
    camera_sees = ("RAY_TRACED", "RASTER", "ALL")
    _require(
        settings.camera_sees in camera_sees,
        f"settings: see must be RAY_TRACED, RASTER or ALL, got {settings.camera_sees!r}",
    )


def _check_camera(scene: Scene) -> None:
    camera = scene.camera
    _require(
        camera.projection in ("PERSP", "ORTHO", "PANO"),
        f"camera: projection must be PERSP, ORTHO or PANO, got {camera.projection!r}",
    )
    _check_panorama(camera)
    _require(bool(np.isfinite(camera.matrix_world).all()), "camera: matrix_world must be finite")
    _require(_finite(camera.view_plane), f"camera: view_plane must be finite, got {camera.view_plane}")
    clip = (camera.clip_start, camera.clip_end)
    _require(not np.isnan(clip).any(), f"camera: clip_start and clip_end must be numbers, got {clip}")
    if camera.lens is not None:
        lens = camera.lens
        sizes = (lens.radius, lens.focus_distance, lens.ratio, lens.rotation)
        _require(_finite(sizes) and min(sizes[:3]) > 0, f"camera: radius, focus and ratio must be above 0, got {lens}")
    x0, y0, x1, y1 = camera.window
    _require(x0 <= x1 and y0 <= y1 and x0 >= 0 and y0 >= 0, f"camera: window is upside down: {camera.window}")
    _require(min(camera.resolution) >= 1, f"camera: resolution must be at least 1 x 1, got {camera.resolution}")


def _check_panorama(camera: Camera) -> None:
    panorama = camera.panorama
    _require(
        (panorama is not None) == (camera.projection == "PANO"),
        f"camera: a panorama is what PANO needs, and no other projection, got {camera.projection!r} with {panorama}",
    )
    if panorama is None:
        return
    _require(panorama.kind in MAPPINGS, f"camera: panorama must be one of {', '.join(MAPPINGS)}, got {panorama.kind!r}")
    for field in fields(panorama):
        value = getattr(panorama, field.name)
        if field.name != "kind":
            _require(_finite(np.atleast_1d(value)), f"camera: the panorama's {field.name} must be finite, got {value}")
    above_0 = (panorama.radius, panorama.lens, *panorama.sensor)
    _require(min(above_0) > 0, f"camera: the panorama's radius, lens and sensor must be above 0, got {above_0}")


def _check_mask(scene: Scene, mask: Float32 | None) -> None:
    x0, y0, x1, y1 = scene.camera.window
    if mask is not None:
        _require(
            np.shape(mask) == (y1 - y0, x1 - x0),
            f"mask: must be (height, width) of the camera's window, {(y1 - y0, x1 - x0)}, got {np.shape(mask)}",
        )


def _check_raster(scene: Scene) -> None:
    if scene.raster is None:
        return
    x0, y0, x1, y1 = scene.camera.window
    for name, array, shape in (
        ("pixels", scene.raster.pixels, (y1 - y0, x1 - x0, 4)),
        ("depth", scene.raster.depth, (y1 - y0, x1 - x0)),
        ("albedo", scene.raster.albedo, (y1 - y0, x1 - x0, 3)),
    ):
        _require(array is None or np.shape(array) == shape, f"raster: {name} must be {shape}, got {np.shape(array)}")


def _check_mesh(mesh: TriangleMesh) -> None:
    name, nt = f"mesh {mesh.name!r}", len(mesh.triangles)
    _require(mesh.vertices.ndim == 2 and mesh.vertices.shape[1] == 3, f"{name}: vertices must be (n, 3)")
    _require(mesh.triangles.shape == (nt, 3), f"{name}: triangles must be (n, 3)")
    if nt == 0:
        return
    _require(
        _within(mesh.triangles, len(mesh.vertices)),
        f"{name}: a triangle names a vertex that is not there",
    )
    tables = [t for t in (mesh.normals, *mesh.uv_maps.values(), *mesh.attributes.values()) if t is not None]
    if tables:
        _require(mesh.corners.shape == (nt, 3), f"{name}: corners must have the shape of triangles")
        _require(
            _within(mesh.corners, min(len(t) for t in tables)),
            f"{name}: a triangle names a corner that is not there",
        )
    if mesh.surface_slots is not None:
        _require(mesh.surface_slots.shape == (nt,), f"{name}: surface_slots must name one slot for each triangle")
        _require(bool(np.min(mesh.surface_slots) >= 0), f"{name}: a surface slot is negative")


def _check_references(scene: Scene) -> None:
    for i in scene.instances:
        name = f"object {i.name!r}"
        _require(0 <= i.mesh < len(scene.meshes), f"{name}: there is no mesh {i.mesh}")
        _require(np.shape(i.matrix_world) == (4, 4), f"{name}: matrix_world must be (4, 4)")
        _require(len(i.surfaces) > 0, f"{name}: wears no surface")
        for s in i.surfaces:
            _require(0 <= s < len(scene.surfaces), f"{name}: there is no surface {s}")
    for shape in _shapes(scene):
        _require(
            0 <= shape.surface < len(scene.surfaces), f"object {shape.name!r}: there is no surface {shape.surface}"
        )


def _check_surface(scene: Scene, number: int, surface: Surface) -> None:
    def require(condition: bool, what: str) -> None:
        if not condition:
            raise ValueError(f"{_wearer(scene, number)}surface {surface.name!r}: {what}")

    for closure in surface.closures:
        require(not closure.surface.closures, "a closure is a sum of closures itself: list them one by one")
        weight = np.ravel(np.asarray(0.0 if isinstance(closure.weight, Expression) else closure.weight, np.float64))
        require(len(weight) in (1, 3) and _finite(weight), f"a closure's weight must be finite, got {closure.weight}")
        require(float(np.min(weight)) >= 0, f"a closure's weight must not be negative, got {closure.weight}")
        _check_surface(scene, number, replace(closure.surface, name=closure.surface.name or surface.name))
    if not isinstance(surface.ior, Expression):
        require(math.isfinite(surface.ior) and surface.ior > 0, f"ior must be a positive number, got {surface.ior}")
    spread = surface.dispersion
    require(math.isfinite(spread) and spread >= 0, f"dispersion must be finite and not negative, got {spread}")
    coat_ior: Any = surface.coat_ior
    require(math.isfinite(coat_ior) and coat_ior >= 1, f"coat_ior must be at least 1, got {coat_ior}")
    constant: dict[str, Any] = {f: getattr(surface, f) for f in (*_SHARES, *_SCALARS, *_COLORS)}
    constant = {f: value for f, value in constant.items() if not isinstance(value, Expression)}
    for field in (name for name in _SHARES if name in constant):
        value = constant[field]
        require(0 <= value <= 1, f"{field} must lie in 0..1, got {value}")
    for field in (name for name in _SCALARS if name in constant):
        value = constant[field]
        require(math.isfinite(value) and value >= 0, f"{field} must be finite and not negative, got {value}")
    require(min(surface.absorption, default=0.0) >= 0, f"absorption must not be negative, got {surface.absorption}")
    for field in (name for name in _COLORS if name in constant):
        value = constant[field]
        require(len(value) == 3 and _finite(value), f"{field} must be three finite numbers, got {value}")


def _wearer(scene: Scene, number: int) -> str:
    """Who wears the surface, for the message."""
    for instance in scene.instances:
        if number in instance.surfaces:
            return f"object {instance.name!r}, "
    for shape in _shapes(scene):
        if shape.surface == number:
            return f"object {shape.name!r}, "
    return ""


def _check_shape(shape: Sphere | Plane) -> None:
    name = f"object {shape.name!r}"
    if isinstance(shape, Sphere):
        _require(_finite(shape.center), f"{name}: center must be finite, got {shape.center}")
        _require(
            math.isfinite(shape.radius) and shape.radius > 0, f"{name}: radius must be positive, got {shape.radius}"
        )
        return
    _require(_finite(shape.point), f"{name}: point must be finite, got {shape.point}")
    _require(
        _finite(shape.normal) and any(shape.normal), f"{name}: normal must be finite and not 0, got {shape.normal}"
    )


def _check_lights(scene: Scene) -> None:
    objects = len(scene.instances) + len(scene.spheres) + len(scene.planes)
    for light in scene.lights:
        kind_of(light)(light).validate()
        for number in sorted((light.receivers or frozenset()) | (light.blockers or frozenset())):
            message = f"light {light.name!r}: it is linked to object {number}, but there are {objects}"
            _require(0 <= number < objects, message)
