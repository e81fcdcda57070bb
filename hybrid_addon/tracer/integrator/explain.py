# SPDX-License-Identifier: GPL-3.0-or-later
"""Why is this pixel like this: the ray tree of one pixel's central ray, as the wave loop itself walks it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...procedural import elementary
from ...scene import Float32, Float64
from ..core.rays import Rays
from ..core.stats import Stats
from ..core.vectors import Array, Index
from ..film.path_hash import REFLECTED, TRANSMITTED, child_path
from ..film.samples import SampleBuffer
from ..geometry.hits import Hits
from ..prepare.compiled import CompiledScene
from ..shading.closures import ClosureHits, closures_at
from ..shading.interaction import Interaction
from ..shading.lamps import brought, lamps_met
from ..shading.spawn import share_out
from .fog import through_fog
from .whitted import add_escaped, add_light, trace_rays

RGB = tuple[float, float, float]

PARTS = ("light", "emission", "world", "lamps", "fog")
"""What a ray brings: the light of lamps and world that its surface sends on, what that emits by itself, the world that
it meets, lamps that it meets, and what fog on its way sends into it."""


@dataclass(eq=False)
class Node:
    """One ray and what it met.

    kind       : "camera", "reflected", "refracted" or "straight" (through a surface of matching IOR).
    throughput : what one unit of radiance that it finds adds to the pixel.
    distance   : metres to what it hit; inf: it left the scene.
    object, surface : numbers of the instance (spheres and planes follow the instances) and of the surface; -1: none.
    inside     : it met the surface from behind.   angle : degrees off the geometric normal.
    adds       : radiance that this node brings the pixel, all of `parts` together.
    parts      : of what it consists, by the names of PARTS; those that are nothing are missing.
    lamps      : names of the lamps that the ray meets on its way.
    fog        : the share of its light that fog on its way leaves.
    program    : the surface program that answered, "" if none did.
    cut        : not followed: beyond the depth, or cut because it would bring little.
    counts     : False for a camera ray that met nothing that the tracer is to show.
    """

    kind: str
    throughput: RGB
    distance: float = float("inf")
    object: int = -1
    surface: int = -1
    inside: bool = False
    angle: float = 0.0
    adds: RGB = (0.0, 0.0, 0.0)
    parts: dict[str, RGB] = field(default_factory=dict)
    lamps: tuple[str, ...] = ()
    fog: float = 1.0
    program: str = ""
    cut: bool = False
    counts: bool = True
    children: list[Node] = field(default_factory=list)


def explain(scene: CompiledScene, x: int, y: int) -> Node:
    """The tree of the ray through the centre of pixel (x, y) of the full frame, row 0 at the bottom."""
    settings, stats = scene.settings, Stats()
    with np.errstate(all="ignore"):
        rays = scene.camera_rays(np.array([x + 0.5]), np.array([y + 0.5]), stats, signed=True)
        tree = _Tree(scene, rays)
        sample_buffer = SampleBuffer.zeros(1, 1, settings.cutoff, depth=settings.max_depth)
        trace_rays(scene, [rays], scene.seen_by_camera, sample_buffer, stats, lambda: None, tree.watch)
    tree.root.distance += _skipped(scene, rays.origin, rays.direction)
    return tree.root


def _skipped(scene: CompiledScene, origin: Float32, direction: Array) -> float:
    """Metres from the camera, or for an orthographic one its plane, to where its ray begins."""
    matrix = scene.camera.matrix_world
    axis, eye = -matrix[:3, 2], matrix[:3, 3] - scene.geometry.center
    return float(axis @ (origin[:, 0] - eye) / (axis @ direction[:, 0]))


class _Tree:
    """Grows with each wave. A ray knows its way through the tree, and so its parent (Rays.path)."""

    def __init__(self, scene: CompiledScene, rays: Rays) -> None:
        self.scene = scene
        self.root = Node("camera", (1.0, 1.0, 1.0), counts=False)
        self.waiting = {int(rays.path[0, 0]): self.root}

    def watch(
        self, started: Rays, rays: Rays, hits: Hits, chosen: Index, at: Interaction | None, children: Rays
    ) -> None:
        """One wave: n rays as they start and as they end, their hits, which of them hit, what they know of it, and the
        next wave."""
        hit = np.arange(len(rays))[chosen] if at is not None else np.zeros(0, np.intp)
        place = {int(i): number for number, i in enumerate(hit)}
        coming = {}
        for i in range(len(rays)):
            node = self.waiting[int(rays.path[0, i])]
            only = np.array([i])
            first, ray = (replace(wave.take(only), sample=np.zeros(1, np.intp)) for wave in (started, rays))
            node.counts = True
            lamps, fog, light = (SampleBuffer.zeros(1) for _ in range(3))
            for lamp, seen, radiance in lamps_met(self.scene, first, hits.take(only), Stats()):
                node.lamps += (lamp.light.name,)
                lamps.add_radiance(seen.sample, brought(self.scene, seen, radiance))
            node.fog = self._fog(first, float(hits.t[i]), i in place, fog)
            found = {"lamps": lamps.radiance, "fog": fog.radiance}
            if at is not None and i in place:
                one = at.take(np.array([place[i]]))
                self._describe(node, one, float(hits.t[i]))
                closures = closures_at(self.scene, ray, one, hits.t[i : i + 1])
                if closures.at.answers is not None and closures.at.answers.here.any():
                    program = self.scene.surfaces.surfaces[node.surface].program
                    node.program = "" if program is None else program.name
                add_light(self.scene, closures, light, Stats())
                emission = np.minimum(_emission(closures), light.radiance)
                found |= {"emission": emission, "light": light.radiance - emission}
                for part in range(len(closures.rays)):
                    only = np.array([part])
                    coming.update(self._branches(node, closures.rays.take(only), closures.at.take(only), children))
            else:
                add_escaped(self.scene, ray, slice(None), light, Stats())
                found["world"] = light.radiance
            node.parts = {name: _rgb(found[name]) for name in PARTS if name in found and found[name].any()}
            node.adds = _rgb(sum(found.values(), np.zeros((3, 1))))
        self.waiting = coming

    def _fog(self, ray: Rays, t: float, hit: bool, light: SampleBuffer) -> float:
        """What fog leaves of a ray; what it sends into it is added to `light`."""
        if self.scene.fog is None:
            return 1.0
        where, is_hit = np.array([t]), np.array([hit])
        ray = self.scene.media.absorbed(ray, where, is_hit)
        left = through_fog(self.scene, ray, where, is_hit, light, Stats(), None)
        before, after = float(ray.throughput.sum()), float(left.throughput.sum())
        return after / before if before > 0 else 1.0

    def _describe(self, node: Node, at: Interaction, t: float) -> None:
        prim = int(at.prim[0])
        node.distance, node.object = t, int(self.scene.geometry.object[prim])
        node.surface, node.inside = int(self.scene.geometry.surface[prim]), not bool(at.entering[0])
        cosine = float((at.wo * at.n_geometric).sum())
        node.angle = float(np.degrees(elementary.arccos(min(1.0, abs(cosine)))))

    def _branches(self, node: Node, ray: Rays, at: Interaction, children: Rays) -> dict[int, Node]:
        """The rays that go on from this one."""
        found = {}
        split = share_out(self.scene, ray, at)
        kinds = ((REFLECTED, "reflected", split.reflected), (TRANSMITTED, "refracted", split.transmitted))
        for kind, name, weight in kinds:
            path = int(child_path(ray.path, kind)[0, 0])
            for j in np.flatnonzero(children.path[0] == np.uint32(path)).tolist():
                straight = name == "refracted" and children.straight[j] > ray.straight[0]
                child = Node("straight" if straight else name, _rgb(children.throughput[:, j]), counts=False)
                node.children.append(child)
                found[path] = child
            if path not in found and weight.any():
                name = name if name == "reflected" or split.bends[0] else "straight"
                node.children.append(Node(name, _rgb(weight), cut=True))
        return found


def _emission(closures: ClosureHits) -> Float64:
    """(3, 1) what the closures of one hit emit, as the pixel gets it; whole, where a clamp takes of the sum."""
    emission = closures.at.value("emission", slice(None))
    return np.asarray((closures.rays.throughput * emission).sum(axis=1, keepdims=True), np.float64)


def _rgb(values: np.ndarray) -> RGB:
    red, green, blue = (float(v) for v in np.ravel(values))
    return red, green, blue
