# SPDX-License-Identifier: GPL-3.0-or-later
"""Builders of small scenes, and the two ways in which cases look at them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...scene import (
    BLACK,
    Camera,
    Film,
    Float32,
    Float64,
    Instance,
    Scene,
    Settings,
    Surface,
    Texture,
    TriangleMesh,
    World,
)
from ...tracer import trace

Vector = Sequence[float] | Float64
WHITE_WORLD = World((1.0, 1.0, 1.0))


class BrokenInvariant(Exception):
    """A counter of the tracer that must be 0 is not."""


def shoot(scene: Scene, allow: Sequence[str] = (), mask: Float32 | None = None, **settings: Any) -> Film:
    """Trace with one unfiltered ray a pixel through everything; all invariants but the `allow`ed must hold."""
    film = trace(scene, Settings(**{"samples": 1, "camera_sees": "ALL", **settings}), mask=mask)
    broken = {k: v for k, v in film.invariants.items() if v and k not in allow}
    if broken:
        raise BrokenInvariant(", ".join(f"{count} {name.replace('_', ' ')}" for name, count in broken.items()))
    return film


def look_at(eye: Vector, target: Vector = (0, 0, 0), up: Vector = (0, 0, 1)) -> Float64:
    """(4, 4) camera matrix at `eye` looking at `target`: local -Z forward, +Y up."""
    z = np.subtract(eye, target, dtype=np.float64)
    z /= np.sqrt((z * z).sum())
    x = np.cross(np.asarray(up, np.float64), z)
    x /= np.sqrt((x * x).sum())
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = x, np.cross(z, x), z, eye
    return m


def camera(
    eye: Vector = (0, 0, 5),
    target: Vector = (0, 0, 0),
    up: Vector = (0, 1, 0),
    size: tuple[int, int] = (32, 32),
    half: float = 0.5,
    **other: Any,
) -> Camera:
    """A camera whose view plane reaches `half` up and down; perspective unless said otherwise."""
    aspect = size[0] / size[1]
    values: dict[str, Any] = {
        "projection": "PERSP",
        "matrix_world": look_at(eye, target, up),
        "view_plane": (-half * aspect, half * aspect, -half, half),
        "resolution": size,
        "window": (0, 0, *size),
        "clip_start": 1e-3,
        "clip_end": 1e9,
    }
    return Camera(**{**values, **other})


def mesh(vertices: Any, triangles: Any, name: str = "mesh", **other: Any) -> TriangleMesh:
    """A mesh whose corners are its vertices."""
    triangles = np.array(triangles, np.int32).reshape(-1, 3)
    values = {"corners": triangles, **other}
    return TriangleMesh(name, np.array(vertices, np.float32).reshape(-1, 3), triangles, **values)


def quad(corners: Any, name: str = "quad", **other: Any) -> TriangleMesh:
    """A quadrilateral, counter-clockwise seen from outside."""
    return mesh(corners, [(0, 1, 2), (0, 2, 3)], name, **other)


def floor(size: float = 4.0, z: float = 0.0, **other: Any) -> TriangleMesh:
    """A square that faces up."""
    return quad([(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)], "floor", **other)


def ceiling(size: float = 4.0, z: float = 4.0) -> TriangleMesh:
    """A square that faces down."""
    return quad([(-size, -size, z), (-size, size, z), (size, size, z), (size, -size, z)], "ceiling")


def box(low: Vector = (-1, -1, -1), high: Vector = (1, 1, 1), name: str = "box") -> TriangleMesh:
    """A closed box with its triangles facing outward."""
    ends = (low, high)
    vertices = [(ends[k][0], ends[j][1], ends[i][2]) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return mesh(vertices, [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], name)


def icosphere(levels: int = 2, radius: float = 1.0, smooth: bool = False, name: str = "ball") -> TriangleMesh:
    """A subdivided icosahedron on a sphere: 20 x 4^levels triangles."""
    g = (1 + 5**0.5) / 2
    corners: list[tuple[float, float, float]] = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    corners += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    faces += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11)]
    faces += [(6, 2, 10), (8, 6, 7), (9, 8, 1)]
    v, t = np.array(corners, np.float64), np.array(faces)
    for _ in range(levels):
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = inverse.reshape(3, -1) + len(v)
        v = np.concatenate([v, v[unique].mean(1)])
        t = np.concatenate([np.stack(f, 1) for f in ((t[:, 0], a, c), (a, t[:, 1], b), (c, b, t[:, 2]), (a, b, c))])
    v /= np.sqrt((v * v).sum(1, keepdims=True))
    return mesh(v * radius, t, name, normals=v.astype(np.float32) if smooth else None)


def make_scene(*parts: Any, **other: Any) -> Scene:
    """A scene of (mesh, surface[, options of Instance]), ray traced unless said otherwise."""
    meshes: list[TriangleMesh] = []
    instances: list[Instance] = []
    surfaces: list[Surface] = list(other.pop("surfaces", ()))
    for shape, surface, *rest in parts:
        if surface not in surfaces:
            surfaces.append(surface)
        if shape not in meshes:
            meshes.append(shape)
        options = {"ray_traced": True, "matrix_world": np.eye(4), **(rest[0] if rest else {})}
        number = len(instances)
        assigned = (surfaces.index(surface),)
        instances.append(Instance(f"object {number}", meshes.index(shape), surfaces=assigned, **options))
    values = {"camera": camera(), "meshes": tuple(meshes), "instances": tuple(instances), "surfaces": tuple(surfaces)}
    return Scene(**{**values, **other})


def translation(x: float, y: float, z: float) -> Float64:
    """(4, 4) float64."""
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def scaling(x: float, y: float, z: float) -> Float64:
    """(4, 4) float64."""
    return np.diag([float(x), float(y), float(z), 1.0])


def rotation(seed: int = 0) -> Float64:
    """A random (4, 4) rotation matrix: QR of a Gaussian matrix (Stewart 1980)."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    m = np.eye(4)
    m[:3, :3] = q if np.linalg.det(q) > 0 else -q
    return m


def transformed(shape: TriangleMesh, matrix: Float64) -> TriangleMesh:
    """The mesh with a matrix applied to its vertices in float64, turned right side out again if it mirrors."""
    vertices = (shape.vertices.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
    normals = shape.normals
    if normals is not None:
        n = normals.astype(np.float64) @ np.linalg.inv(matrix[:3, :3])
        normals = (n / np.sqrt((n * n).sum(1, keepdims=True))).astype(np.float32)
    turned = [0, 2, 1] if np.linalg.det(matrix[:3, :3]) < 0 else [0, 1, 2]
    return replace(
        shape,
        vertices=vertices,
        normals=normals,
        triangles=np.ascontiguousarray(shape.triangles[:, turned]),
        corners=np.ascontiguousarray(shape.corners[:, turned]),
    )


def matte(color: tuple[float, float, float] = (0.8, 0.8, 0.8), **other: Any) -> Surface:
    """Diffuse and opaque."""
    return Surface(base_color=color, **other)


def glass(ior: float = 1.5, **other: Any) -> Surface:
    """Clear and lossless."""
    return Surface(name="glass", opacity=0.0, ior=ior, **other)


def mirror(r: float = 1.0, **other: Any) -> Surface:
    """Black where it does not reflect."""
    return Surface(name="mirror", base_color=BLACK, reflectivity=r, **other)


def emitter(red: float = 1.0, green: float = 1.0, blue: float = 1.0, **other: Any) -> Surface:
    """A surface that only glows."""
    return Surface(name="emitter", base_color=BLACK, emission=(red, green, blue), **other)


BLACK_BODY = Surface(name="black", base_color=BLACK)


def image(pixels: Any) -> Float32:
    """(h, w, 4) float32 with alpha 1 from (h, w) or (h, w, 3) numbers."""
    values = np.asarray(pixels, np.float32)
    if values.ndim == 2:
        values = np.repeat(values[..., None], 3, axis=2)
    return np.concatenate([values, np.ones((*values.shape[:2], 1), np.float32)], axis=2)


def ramp() -> Texture:
    """Red grows with u and green with v, linearly between texture coordinates 1/4 and 3/4; blue is 1."""
    return Texture("ramp", image([[(0, 0, 1), (1, 0, 1)], [(0, 1, 1), (1, 1, 1)]]), "EXTEND")


RAMP_UVS = np.array([(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)], np.float32)
