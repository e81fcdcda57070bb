"""Objects that no ray can meet, found out before they are prepared.

Where nothing bends light or lets it through, rays go in few ways: from the camera to the ray traced objects, from there
to the lights, and from flat mirrors to what these show. A way is a box that moves and grows evenly; what none of them
touches could be anywhere else and change nothing. Behind glass, in curved mirrors and between mirrors rays go
everywhere, and everything is needed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene import Camera, Float64, Instance, Scene, Settings, Sphere
from ..core.cache import SceneCache
from ..core.constants import FLAT, MANY_WAYS, MOST_FACETS, NEAR_MARGIN
from ..emitters.lights import kind_of
from ..emitters.world import CompiledWorld
from ..geometry.instances import MeshInstances, bounds_of_batch, mesh_instances_of, shapes_of
from ..geometry.swept_boxes import OUTWARD, SweptBoxes
from ..materials.surfaces import SurfaceTable

Bools = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def unmet(
    scene: Scene, settings: Settings, table: SurfaceTable, world: CompiledWorld, cache: SceneCache
) -> frozenset[int]:
    """Numbers of the instances that no ray can meet; none where that is not easily said. table, world: the scene's."""
    none: frozenset[int] = frozenset()
    things: tuple[Instance | Sphere, ...] = (*scene.instances, *scene.spheres)
    assigned = [list(t.surfaces) if isinstance(t, Instance) else [t.surface] for t in things]
    if settings.camera_sees != "RAY_TRACED" or settings.raster_shadows or scene.planes or not assigned:
        return none
    if table.transmits[sorted(set().union(*assigned))].any():
        return none
    boxes = _boxes(scene, cache)
    there = (boxes[:, 0] <= boxes[:, 1]).all(axis=1)
    camera, shadow, secondary = (
        np.array([getattr(t.visibility, kind) for t in things]) for kind in ("camera", "shadow", "secondary")
    )
    ray_traced = np.array([t.ray_traced for t in things])
    first = there & ray_traced & camera
    if not first.any():
        return none
    # Rays are rounded, and start a little off surfaces.
    others = _grown(boxes, NEAR_MARGIN * np.max(np.abs(boxes[there])))

    met = camera & _any(_from_camera(_few(boxes[first]), scene.camera), others)
    lit, mirrors = first, np.array([table.reflects[surfaces].any() for surfaces in assigned])
    if settings.max_depth > 0 and (first & mirrors).any():
        shown = _shown(scene, settings, table, np.flatnonzero(first & mirrors), boxes, others)
        if shown is None or (settings.max_depth > 1 and (shown & secondary & mirrors).any()):
            return none
        lit = first | (shown & secondary)
    starts = _few(_where_lit(scene, boxes)[lit])
    for light in (*scene.lights, *world.suns):
        if light.cast_shadow:
            met = met | (shadow & _any(kind_of(light)(light).swept_boxes(starts), others))
    if settings.occlusion_samples > 0 and world.gives_light:
        near = _grown(starts, settings.occlusion_distance)
        met = met | (secondary & _any(SweptBoxes(near, np.zeros_like(near), 0.0), others))
    needless = there & ~ray_traced & ~lit & ~met
    return frozenset(np.flatnonzero(needless[: len(scene.instances)]).tolist())


def _any(ways: SweptBoxes, others: Float64) -> Bools:
    return np.asarray(ways.touch(others).any(axis=0))


def _boxes(scene: Scene, cache: SceneCache) -> Float64:
    """(k, 2, 3) around instances, then spheres; of those without geometry the low corner is above the high one."""
    boxes = np.broadcast_to(np.array([[np.inf] * 3, [-np.inf] * 3]), (len(scene.instances), 2, 3)).copy()
    for batch in mesh_instances_of(scene):
        boxes[batch.numbers] = bounds_of_batch(batch, cache)
    balls = np.array([(s.center, s.center) for s in scene.spheres], np.float64).reshape(-1, 2, 3)
    return np.concatenate([boxes, _grown(balls, np.array([s.radius for s in scene.spheres]))])


def _grown(boxes: Float64, by: Float64 | float) -> Float64:
    """Boxes (k, 2, 3) larger on all sides by so much, one number or (k,)."""
    return boxes + np.multiply.outer(by, OUTWARD)


def _few(boxes: Float64) -> Float64:
    """The same boxes, or if they are many, one around all."""
    if len(boxes) <= MANY_WAYS:
        return boxes
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])[None]


def _where_lit(scene: Scene, boxes: Float64) -> Float64:
    """(k, 2, 3) where shadow rays of things in boxes (k, 2, 3) start: smooth triangles lift them, by their size at
    most (`interaction.shadow_origin`)."""
    smooth = [scene.meshes[i.mesh].normals is not None for i in scene.instances] + [False] * len(scene.spheres)
    with np.errstate(invalid="ignore"):
        diagonal = np.sqrt(((boxes[:, 1] - boxes[:, 0]) ** 2).sum(axis=1))
        return _grown(boxes, np.where(smooth, diagonal, 0.0))


def _eyes(camera: Camera) -> Float64:
    """(2, 3) where a perspective camera's rays start."""
    radius = 0.0 if camera.lens is None else camera.lens.radius
    return np.asarray(camera.matrix_world, np.float64)[:3, 3] + radius * OUTWARD


def _directions(boxes: Float64, camera: Camera) -> Float64:
    """(b, 2, 3) around the directions, of any length, of camera rays to points in boxes (b, 2, 3)."""
    if camera.projection == "PERSP":
        return boxes - _eyes(camera)[::-1]
    slope = 0.0 if camera.lens is None else camera.lens.radius / camera.lens.focus_distance
    return np.broadcast_to(slope * OUTWARD - np.asarray(camera.matrix_world, np.float64)[:3, 2], boxes.shape)


def _from_camera(boxes: Float64, camera: Camera) -> SweptBoxes:
    """Camera rays that meet boxes (b, 2, 3), from there on back."""
    if camera.projection == "PERSP":
        return SweptBoxes(boxes, _eyes(camera) - boxes, 1.0)
    return SweptBoxes(boxes, -_directions(boxes, camera)[:, ::-1], np.inf)


def _shown(
    scene: Scene, settings: Settings, table: SurfaceTable, mirrors: Numbers, boxes: Float64, others: Float64
) -> Bools | None:
    """(k,) which things the mirrors of these numbers (m,) may show, in directions from which the camera sees them;
    None: they are not flat."""
    if len(mirrors) > MANY_WAYS or np.max(mirrors) >= len(scene.instances):
        return None
    assigned = sorted({s for m in mirrors.tolist() for s in scene.instances[m].surfaces})
    bumpy = any(table.surfaces[s].normal is not None for s in assigned)
    normals = [_normal(scene, m) for m in mirrors.tolist()]
    if bumpy or (settings.rough_samples > 0 and table.rough[assigned].any()) or any(n is None for n in normals):
        return None
    n = np.array(normals)
    low, high = _directions(boxes[mirrors], scene.camera).transpose(1, 0, 2)
    turn = np.eye(3) - 2 * n[:, :, None] * n[:, None, :]
    middle = np.einsum("mij,mj->mi", turn, (low + high) / 2)
    spread = np.einsum("mij,mj->mi", np.abs(turn), (high - low) / 2)
    spread += 8 * FLAT * np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    ways = SweptBoxes(boxes[mirrors], np.stack([middle - spread, middle + spread], axis=1), np.inf)
    touched = ways.touch(others)
    touched[np.arange(len(mirrors)), mirrors] = False  # what is flat does not see itself
    return np.asarray(touched.any(axis=0))


def _normal(scene: Scene, number: int) -> Float64 | None:
    """(3,) unit normal of an instance whose triangles lie in one plane; None: they do not, or are too many to look."""
    instance = scene.instances[number]
    mesh = scene.meshes[instance.mesh]
    if len(mesh.triangles) > MOST_FACETS:
        return None
    matrix = np.asarray(instance.matrix_world, np.float64)
    first = matrix[:3, :3] @ mesh.vertices[mesh.triangles[0, 0]].astype(np.float64) + matrix[:3, 3]
    (shape,) = shapes_of([MeshInstances(mesh, [instance], [number], matrix[None])], first, True)
    if len(shape.facets) == 0 or shape.smooth.any():
        return None
    normal = shape.facets[0, :3]
    apart = np.abs(shape.facets - [*normal, 0.0]).max(axis=0)
    flat = apart[:3].max() <= FLAT and apart[3] <= FLAT * np.max(shape.extent)
    return normal if flat else None
