# SPDX-License-Identifier: GPL-3.0-or-later
"""Builders of small scenes. Tests get them through the fixture `build`."""

from types import SimpleNamespace

import numpy as np
import pytest

from hybrid_addon.scene import Camera, Instance, Scene, Settings, Surface, TriangleMesh


def look_at(eye, target=(0, 0, 0), up=(0, 0, 1)):
    """Camera matrix at `eye` looking at `target`: local -Z forward, +Y up."""
    eye, target = np.array(eye, float), np.array(target, float)
    z = eye - target
    z /= np.linalg.norm(z)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = x, np.cross(z, x), z, eye
    return m


def camera(eye=(0, 0, 5), target=(0, 0, 0), up=(0, 1, 0), size=(16, 16), half=0.5, **other):
    """A perspective camera whose view plane reaches `half` up and down."""
    aspect = size[0] / size[1]
    values = {
        "projection": "PERSP",
        "matrix_world": look_at(eye, target, up),
        "view_plane": (-half * aspect, half * aspect, -half, half),
        "resolution": size,
        "window": (0, 0, *size),
        "clip_start": 1e-3,
        "clip_end": 1e6,
    }
    return Camera(**{**values, **other})


def mesh(vertices, triangles, name="mesh", **other):
    triangles = np.array(triangles, np.int32).reshape(-1, 3)
    values = {"corners": triangles, **other}
    return TriangleMesh(name, np.array(vertices, np.float32).reshape(-1, 3), triangles, **values)


def quad(corners, name="quad", **other):
    """A quadrilateral, counter-clockwise seen from outside."""
    return mesh(corners, [(0, 1, 2), (0, 2, 3)], name, **other)


def box(low=(-1, -1, -1), high=(1, 1, 1), name="box"):
    """A closed box with its triangles facing outward."""
    vertices = [
        [(low, high)[k][0], (low, high)[j][1], (low, high)[i][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)
    ]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return mesh(vertices, [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], name)


def icosphere(levels=2, radius=1.0, smooth=False, name="icosphere"):
    """A subdivided icosahedron on a sphere."""
    g = (1 + 5**0.5) / 2
    v = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    v += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    t = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
    t += [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10)]
    t += [(8, 6, 7), (9, 8, 1)]
    v, t = np.array(v, float), np.array(t)
    for _ in range(levels):
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = inverse.reshape(3, -1) + len(v)
        v = np.concatenate([v, v[unique].mean(1)])
        a, b, c = middle
        t = np.concatenate([np.stack(f, 1) for f in ((t[:, 0], a, c), (a, t[:, 1], b), (c, b, t[:, 2]), (a, b, c))])
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return mesh(v * radius, t, name, normals=v.astype(np.float32) if smooth else None)


def instance(number, surface=0, matrix=None, name="", **other):
    surfaces = surface if isinstance(surface, tuple) else (surface,)
    return Instance(name or f"object {number}", number, np.eye(4) if matrix is None else matrix, surfaces, **other)


def scene(*parts, **other):
    """A scene of (mesh, surface) pairs, each an instance at the origin; ray traced unless said otherwise."""
    meshes, surfaces, instances = [], list(other.pop("surfaces", ())), []
    for part in parts:
        shape, surface, *rest = part
        if surface not in surfaces:
            surfaces.append(surface)
        options = {"ray_traced": True, **(rest[0] if rest else {})}
        instances.append(instance(len(meshes), surfaces.index(surface), **options))
        meshes.append(shape)
    values = {"camera": camera(), "meshes": tuple(meshes), "instances": tuple(instances), "surfaces": tuple(surfaces)}
    return Scene(**{**values, **other})


def translation(x, y, z):
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def matte(color=(0.8, 0.8, 0.8), **other):
    return Surface(base_color=color, **other)


def glass(ior=1.5, **other):
    return Surface(name="glass", opacity=0.0, ior=ior, **other)


def mirror(r=1.0, **other):
    return Surface(name="mirror", reflectivity=r, **other)


def emitter(*color, **other):
    """A surface that only glows."""
    return Surface(name="emitter", base_color=(0, 0, 0), emission=color, **other)


ONE_RAY = Settings(samples=1, camera_sees="ALL", threads=1)


@pytest.fixture(scope="session")
def build():
    """The builders above, by name."""
    names = (
        look_at, camera, mesh, quad, box, icosphere, instance, scene, translation, matte, glass, mirror, emitter,
    )  # fmt: skip
    return SimpleNamespace(**{f.__name__: f for f in names}, one_ray=ONE_RAY)
