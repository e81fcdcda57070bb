"""The world's geometry as flat arrays: all instances realised, recentred in float64, rounded to float32 once.

A *primitive* is a triangle, an analytic sphere or an analytic plane; they are numbered in this order, and every
per-primitive array runs over all of them. The float32 vertices made here *are* the scene: hit points, normals and
distances are worked out from them in float64.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import Float32, Float64, Instance, Int32, Plane, Scene, Sphere, TriangleMesh
from .constants import EMBREE_LIMIT
from .soup import Soup, facets_of, join, no_triangles
from .subdivide import split_large_triangles

Bools = NDArray[np.bool_]
Layouts = Sequence[Mapping[str, tuple[int, int]]]
"""For each surface, key of what it reads of a corner -> (start, width)."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """nt triangles, then ns spheres, then planes: np primitives in all. Coordinates are relative to `center`."""

    center: Float64  # (3,) of the scene's bounds, in world space
    vertices: Float32  # (nv, 3)
    triangles: Int32  # (nt, 3) counter-clockwise seen from outside, mirrored instances too
    facets: Float64  # (np, 4) unit geometric normal and its distance from the origin: n.x = d; 0 for spheres
    extent: Float32  # (np,) largest |coordinate| of the primitive's vertices: scale of its rounding errors
    normals: Float32 | None  # (nt, 9) shading normals of the three corners; None: nothing is smooth
    smooth: Bools  # (np,) shading normals differ from the geometric one
    corner_data: Float32 | None  # (nt, 3 k) what expressions read of the three corners; None: nothing
    layouts: Layouts  # for each surface: where in the k numbers of a corner its data are
    object: NDArray[np.intp]  # (np,) number in the scene: of its instances, then its spheres, then its planes
    surface: NDArray[np.intp]  # (np,) index into the surface table (intp: `take` need not convert it)
    ray_traced: Bools  # (np,) flagged by the artist
    camera: Bools  # (np,) visibility for camera rays,
    shadow: Bools  # (np,) for shadow rays,
    secondary: Bools  # (np,) and for reflected and refracted rays
    sphere_center: Float64  # (ns, 3)
    sphere_radius: Float64  # (ns,)
    dropped: int  # triangles left out because they are degenerate or not finite
    split: int  # triangles made by splitting large ones towards small flagged objects

    @property
    def triangle_count(self) -> int:
        """The first primitive that is not a triangle."""
        return len(self.triangles)

    @property
    def sphere_count(self) -> int:
        """Spheres come right after the triangles."""
        return len(self.sphere_radius)

    def bounds_radius(self) -> float:
        """Radius of a ball around the centre that holds all primitives (infinite if there are planes)."""
        n = self.triangle_count + self.sphere_count
        if n < len(self.surface):
            return float("inf")
        return float(np.sqrt(3) * np.max(self.extent, initial=0.0))


@dataclass(eq=False)
class _Batch:
    """All instances of one mesh, k of them, in world space and float64."""

    mesh: TriangleMesh
    instances: list[Instance]
    numbers: list[int]  # of the instances in the scene
    matrices: Float64  # (k, 4, 4)
    vertices: Float64  # (k, nv, 3)


def flatten(scene: Scene, layouts: Layouts, use_normals: bool = True) -> Geometry:
    """Realise all visible instances.

    layouts     : for each surface of the scene what it reads of a mesh's corners.
    use_normals : False leaves the shading normals out (a plan that never shades).
    """
    batches = list(_batches(scene))
    spheres, planes = [s for s in scene.spheres if _visible(s)], [p for p in scene.planes if _visible(p)]
    center = _center(scene, batches, spheres)
    parts = [_realise(b, center, layouts, use_normals) for b in batches]
    mesh = join(parts) if parts else no_triangles()
    balls = np.array([(*np.subtract(b.center, center), b.radius) for b in spheres if b.ray_traced]).reshape(-1, 4)
    mesh = split_large_triangles(mesh, balls)
    analytic: list[Sphere | Plane] = [*scene.spheres, *scene.planes]
    numbers = [number for number, thing in enumerate(analytic, len(scene.instances)) if _visible(thing)]
    return _assemble(mesh, layouts, center, spheres, planes, numbers)


def _visible(thing: Instance | Sphere | Plane) -> bool:
    v = thing.visibility
    return v.camera or v.shadow or v.secondary


def _batches(scene: Scene) -> Iterator[_Batch]:
    """Group the visible instances by mesh: numpy then works on all instances of a mesh at once."""
    members: dict[int, list[int]] = {}
    for number, instance in enumerate(scene.instances):
        if _visible(instance) and len(scene.meshes[instance.mesh].triangles):
            members.setdefault(instance.mesh, []).append(number)
    for mesh, numbers in members.items():
        instances = [scene.instances[n] for n in numbers]
        matrices = np.array([i.matrix_world for i in instances], np.float64)
        local = scene.meshes[mesh].vertices.astype(np.float64)
        yield _Batch(scene.meshes[mesh], instances, numbers, matrices, _transform(local, matrices))


def _transform(points: Float64, matrices: Float64) -> Float64:
    """(n, 3) points through (k, 4, 4) matrices: (k, n, 3)."""
    m = matrices[:, :, :, None]
    x, y, z = points.T
    with np.errstate(invalid="ignore", over="ignore"):  # vertices that are not finite are dropped later
        return np.stack([m[:, i, 0] * x + m[:, i, 1] * y + m[:, i, 2] * z + m[:, i, 3] for i in range(3)], axis=-1)


def _center(scene: Scene, batches: list[_Batch], spheres: Sequence[Sphere]) -> Float64:
    """Centre of the bounds of what is flagged, else of everything: there coordinates are small and rounding is least.

    The camera's place if there is only the unbounded.
    """
    for flagged in (True, False):
        low, high = [], []
        for batch in batches:
            chosen = [i.ray_traced or not flagged for i in batch.instances]
            points = batch.vertices[chosen].reshape(-1, 3)
            points = points[(np.abs(points) < EMBREE_LIMIT).all(1)]
            if len(points):
                low.append(points.min(0))
                high.append(points.max(0))
        for sphere in spheres:
            if sphere.ray_traced or not flagged:
                low.append(np.subtract(sphere.center, sphere.radius))
                high.append(np.add(sphere.center, sphere.radius))
        if low:
            return np.asarray((np.min(low, axis=0) + np.max(high, axis=0)) / 2)
    return np.array(scene.camera.matrix_world, np.float64)[:3, 3]


def _realise(batch: _Batch, center: Float64, layouts: Layouts, use_normals: bool) -> Soup:
    """Triangles of all instances of one mesh."""
    mesh, k = batch.mesh, len(batch.instances)
    nv, nt = len(mesh.vertices), len(mesh.triangles)
    with np.errstate(invalid="ignore", over="ignore"):
        vertices = (batch.vertices - center).astype(np.float32).reshape(-1, 3)
    sign = _handedness(batch.matrices)

    def wind(indices: Int32) -> Int32:
        """(k, nt, 3): a mirrored instance turns its triangles over; swapping two corners turns them back."""
        return np.where((sign < 0)[:, None, None], indices[None, :, [0, 2, 1]], indices[None])

    triangles = (wind(mesh.triangles) + (np.arange(k, dtype=np.int32) * np.int32(nv))[:, None, None]).reshape(-1, 3)
    corners = wind(mesh.corners) if mesh.normals is not None or mesh.uv_maps or mesh.attributes else None
    surface = _surface_of_triangles(batch)
    flags = np.array([_flags(i) for i in batch.instances], bool).T
    corner_points = vertices[triangles]
    facets, extent, sound = facets_of(corner_points)
    normals = None
    if use_normals and mesh.normals is not None and corners is not None:
        normals = _corner_normals(mesh.normals, batch.matrices, sign, corners).reshape(-1, 9)
    smooth = _is_smooth(normals, facets) if normals is not None else np.zeros(k * nt, bool)
    data = _corner_data(batch, corners, surface, layouts) if corners is not None else None
    return Soup(
        vertices=vertices,
        triangles=triangles[sound],
        facets=facets[sound],
        extent=extent[sound],
        normals=None if normals is None else normals[sound],
        smooth=smooth[sound],
        corner_data=None if data is None else data[sound],
        object=np.repeat(np.array(batch.numbers, np.int32), nt)[sound],
        surface=surface[sound],
        flags=np.repeat(flags, nt, axis=1)[:, sound],
        dropped=int(len(sound) - np.count_nonzero(sound)),
    )


def _flags(thing: Instance | Sphere | Plane) -> tuple[bool, bool, bool, bool]:
    v = thing.visibility
    return thing.ray_traced, v.camera, v.shadow, v.secondary


def _handedness(matrices: Float64) -> Float64:
    """(k,) sign of the determinant: -1 for mirrored instances, 0 for singular ones."""
    a, b, c = matrices[:, 0, :3], matrices[:, 1, :3], matrices[:, 2, :3]
    return np.asarray(np.sign((a * np.cross(b, c)).sum(1)))


def _surface_of_triangles(batch: _Batch) -> Int32:
    """(k nt,) surface of each triangle, through the slots of each instance; a slot too many wears the last one."""
    slots = batch.mesh.surface_slots
    if slots is None:
        slots = np.zeros(len(batch.mesh.triangles), np.int32)
    width = int(np.max(slots)) + 1
    worn = np.array([(i.surfaces + (i.surfaces[-1],) * width)[:width] for i in batch.instances], np.int32)
    return worn[:, slots].reshape(-1)


def _corner_normals(local: Float32, matrices: Float64, sign: Float64, corners: Int32) -> Float32:
    """(k, nt, 3 corners, 3) unit world normals through the cofactor matrix, which exists for singular matrices too.

    cofactor(M) = det(M) M^-T, so its sign makes up for mirroring.
    """
    m = matrices[:, :3, :3]
    cofactor = np.stack([np.cross(m[:, (i + 1) % 3], m[:, (i + 2) % 3]) for i in range(3)], axis=1)
    cofactor *= np.where(sign < 0, -1.0, 1.0)[:, None, None]
    padded = np.zeros((len(m), 4, 4))
    padded[:, :3, :3] = cofactor
    with np.errstate(all="ignore"):
        world = _transform(local.astype(np.float64), padded)
        world /= np.sqrt((world * world).sum(-1, keepdims=True))
    instance = np.arange(len(m))[:, None, None]
    return world.astype(np.float32)[instance, corners]


def _is_smooth(normals: Float32, facets: Float64) -> Bools:
    """Triangles whose shading normal can differ from the geometric one, and whose normals are usable at all."""
    rows = np.ascontiguousarray(normals.T)
    flat = (rows.reshape(3, 3, -1) == facets[:, :3].T.astype(np.float32)).all(axis=(0, 1))
    return np.isfinite(rows).all(axis=0) & ~flat


def _corner_data(batch: _Batch, corners: Int32, surface: Int32, layouts: Layouts) -> Float32 | None:
    """(k nt, 3 w) what expressions read of the corners; each triangle carries what its own surface reads."""
    worn = np.unique(surface).tolist()
    width = max((start + size for s in worn for start, size in layouts[s].values()), default=0)
    if width == 0:
        return None
    result = np.zeros((len(surface), 3, width), np.float32)
    for s in worn:
        reads = surface == s
        for key, (start, size) in layouts[s].items():
            source = _source(batch, key, corners)
            if source is not None:
                result[reads, :, start : start + size] = source.reshape(len(surface), 3, -1)[reads, :, :size]
    result[~np.isfinite(result)] = 0
    return result.reshape(len(surface), -1)


def _source(batch: _Batch, key: str, corners: Int32) -> Float32 | None:
    """(k, nt, 3 corners, width) of the mesh's own data; tangents are turned to world space."""
    mesh = batch.mesh
    if key.startswith("uv:"):
        local = mesh.uv_maps.get(key.removeprefix("uv:"), mesh.uv_maps.get(""))
    else:
        local = mesh.attributes.get(key)
    if local is None:
        return None
    if not key.startswith("tangent:"):
        return local[corners]
    linear = batch.matrices.copy()
    linear[:, :3, 3] = 0
    world = np.concatenate(
        [_transform(local[:, :3].astype(np.float64), linear), np.empty((len(linear), len(local), 1))], 2
    )
    world[..., 3] = local[:, 3] * np.where(_handedness(batch.matrices) < 0, -1, 1)[:, None]
    return world.astype(np.float32)[np.arange(len(linear))[:, None, None], corners]


def _assemble(
    mesh: Soup,
    layouts: Layouts,
    center: Float64,
    spheres: Sequence[Sphere],
    planes: Sequence[Plane],
    numbers: list[int],
) -> Geometry:
    """Append the analytic shapes, of these numbers in the scene, to the triangles."""
    ns = len(spheres)
    sphere_center = np.array([s.center for s in spheres], np.float64).reshape(-1, 3) - center
    sphere_radius = np.array([s.radius for s in spheres], np.float64)
    point = np.array([p.point for p in planes], np.float64).reshape(-1, 3) - center
    normal = np.array([p.normal for p in planes], np.float64).reshape(-1, 3)
    normal = normal / np.sqrt((normal * normal).sum(1, keepdims=True))
    distance = (normal * point).sum(1)
    analytic: list[Sphere | Plane] = [*spheres, *planes]
    flags = np.concatenate([mesh.flags, np.array([_flags(a) for a in analytic], np.bool_).reshape(-1, 4).T], axis=1)
    facets = np.concatenate([mesh.facets, np.zeros((ns, 4)), np.concatenate([normal, distance[:, None]], axis=1)])
    sphere_extent = np.abs(sphere_center).max(1, initial=0) + sphere_radius
    # A plane is as large as what stands on it: one through the very centre must not lose its scale.
    scale = max(np.max(mesh.extent, initial=0.0), np.max(sphere_extent, initial=0.0))
    extent = np.concatenate([sphere_extent, np.maximum(np.abs(distance), scale)])
    return Geometry(
        center=center,
        vertices=mesh.vertices,
        triangles=np.ascontiguousarray(mesh.triangles, np.int32),
        facets=np.ascontiguousarray(facets),
        extent=np.concatenate([mesh.extent, extent.astype(np.float32)]),
        normals=mesh.normals if mesh.smooth.any() else None,
        smooth=np.concatenate([mesh.smooth, np.zeros(len(analytic), bool)]),
        corner_data=mesh.corner_data,
        layouts=layouts,
        object=np.concatenate([mesh.object, np.array(numbers, np.intp)]).astype(np.intp),
        surface=np.concatenate([mesh.surface, np.array([a.surface for a in analytic], np.int32)]).astype(np.intp),
        ray_traced=flags[0],
        camera=flags[1],
        shadow=flags[2],
        secondary=flags[3],
        sphere_center=sphere_center,
        sphere_radius=sphere_radius,
        dropped=mesh.dropped,
        split=mesh.split,
    )
