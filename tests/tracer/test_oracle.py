"""The fast tracer against a slow, obvious one: recursive, float64, one ray at a time, no acceleration structure."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hybrid_addon.scene import PointLight, Settings, Surface, World
from hybrid_addon.tracer import trace

TINY = 1e-9  # float64: scenes are about 10 m, errors about 1e-15 of that


class Oracle:
    def __init__(self, scene, max_depth):
        self.scene, self.max_depth = scene, max_depth
        triangles, surfaces = [], []
        self.body, self.size = [], []  # of each triangle: its instance; of each instance: its size if it is a solid
        for i in scene.instances:
            mesh, m = scene.meshes[i.mesh], np.asarray(i.matrix_world)
            v = mesh.vertices.astype(float) @ m[:3, :3].T + m[:3, 3]
            triangles.append(v[mesh.triangles])
            self.body += [len(self.size)] * len(mesh.triangles)
            s = scene.surfaces[i.surfaces[0]]
            clear = s.opacity < 1 and s.reflectivity < 1 and len(mesh.vertices) == 8  # a box, not a sheet
            self.size.append(np.linalg.norm(v.max(0) - v.min(0)) if clear else None)
            surfaces += [scene.surfaces[i.surfaces[0]]] * len(mesh.triangles)
        self.surfaces = surfaces
        t = np.concatenate(triangles)
        self.v0, self.e1, self.e2 = t[:, 0], t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]

    def hits(self, o, d):
        """All crossings (t, triangle), nearest first: Moeller & Trumbore 1997."""
        p = np.cross(d, self.e2)
        det = (self.e1 * p).sum(1)
        with np.errstate(all="ignore"):
            s = o - self.v0
            u = (s * p).sum(1) / det
            q = np.cross(s, self.e1)
            v = (q @ d) / det
            t = (self.e2 * q).sum(1) / det
            found = np.flatnonzero((det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > TINY))
        return sorted((t[k], k) for k in found)

    @staticmethod
    def fresnel(c, eta):
        if eta == 1:
            return 0.0
        s2 = (1 - c * c) / eta**2
        if s2 >= 1:
            return 1.0
        ct = np.sqrt(1 - s2)
        return (((c - eta * ct) / (c + eta * ct)) ** 2 + ((eta * c - ct) / (eta * c + ct)) ** 2) / 2

    def visible(self, p, light):
        d = np.array(light) - p
        distance = np.linalg.norm(d)
        through = np.ones(3)
        for t, k in self.hits(p, d / distance):
            if t < distance:
                s = self.surfaces[k]
                n = np.cross(self.e1[k], self.e2[k])
                cos = abs(n @ d) / np.linalg.norm(n) / distance
                through = through * (1 - s.reflectivity) * (1 - s.opacity) * (1 - self.fresnel(cos, s.ior))
                through = through * s.transmission_tint
        return through

    def ior(self, body):
        return 1.0 if body is None else self.scene.surfaces[self.scene.instances[body].surfaces[0]].ior

    def medium(self, bodies):
        """The smallest of the bodies that a point is inside of; None for vacuum."""
        return min(bodies, key=lambda b: self.size[b], default=None)

    def radiance(self, o, d, depth=0, inside=frozenset()):
        hits = self.hits(o, d)
        if not hits:
            return np.array(self.scene.world.radiance)
        t, k = hits[0]
        s, p = self.surfaces[k], o + t * d
        n = np.cross(self.e1[k], self.e2[k])
        n /= np.linalg.norm(n)
        entering = n @ d < 0
        n = n if entering else -n
        cos = -(n @ d)
        result = np.array(s.emission, float)
        local = s.ambient * np.array(s.base_color) * self.scene.world.radiance
        for light in self.scene.lights:
            to = np.array(light.position) - p
            d2 = to @ to
            cos_i = max(n @ to / np.sqrt(d2), 0)
            e = np.array(light.intensity) * cos_i / (d2 + light.radius**2)
            if cos_i > 0:
                local = local + s.diffuse * np.array(s.base_color) / np.pi * e * self.visible(
                    p + n * TINY, light.position
                )
        result += (1 - s.reflectivity) * s.opacity * local
        body = self.body[k]
        beyond = inside
        if self.size[body] is None:
            eta = s.ior if entering else 1 / s.ior
        else:
            assert entering != (body in inside)
            beyond = inside | {body} if entering else inside - {body}
            eta = self.ior(self.medium(beyond)) / self.ior(self.medium(inside))
        f = self.fresnel(cos, eta)
        share = (1 - s.reflectivity) * (1 - s.opacity)
        reflected = s.reflectivity * np.array(s.reflection_tint) + share * f
        if reflected.any() and depth < self.max_depth:
            result += reflected * self.radiance(p + n * TINY, d + 2 * cos * n, depth + 1, inside)
        passed = share * (1 - f) * np.array(s.transmission_tint)
        if passed.any() and (depth < self.max_depth or eta == 1):
            wt = d / eta + (cos / eta - np.sqrt(1 - (1 - cos * cos) / eta**2)) * n
            result += passed * self.radiance(p - n * TINY, wt, depth + (eta != 1), beyond)
        return result

    def picture(self):
        cam = self.scene.camera
        m, (left, right, bottom, top), (w, h) = cam.matrix_world, cam.view_plane, cam.resolution
        image = np.zeros((h, w, 3))
        for j in range(h):
            for i in range(w):
                x, y = left + (right - left) * (i + 0.5) / w, bottom + (top - bottom) * (j + 0.5) / h
                d = m[:3, :3] @ (x, y, -1)
                image[j, i] = self.radiance(m[:3, 3], d / np.linalg.norm(d))
        return image


def random_scene(build, seed):
    """Three to six tilted boxes and sheets of random surfaces around the origin."""
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(rng.integers(3, 7)):
        q, _r = np.linalg.qr(rng.normal(size=(3, 3)))
        m = np.eye(4)
        m[:3, :3], m[:3, 3] = q * rng.uniform(0.4, 1.5), rng.uniform(-1.5, 1.5, 3)
        surface = Surface(
            base_color=tuple(rng.random(3)),
            emission=tuple(rng.random(3) * (rng.random() < 0.3)),
            reflectivity=float(rng.choice([0, 0.25, 1])),
            reflection_tint=tuple(rng.random(3)),
            opacity=float(rng.choice([0, 0.5, 1])),
            transmission_tint=tuple(rng.random(3)),
            ior=float(rng.choice([1.0, 0.8, 1.33, 1.5])),
        )
        shape = build.box() if rng.random() < 0.6 else build.quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
        parts.append((shape, surface, {"matrix": m}))
    lights = tuple(
        PointLight("p", tuple(rng.uniform(-4, 4, 3)), tuple(rng.random(3) * 20), radius=0.1) for _ in range(2)
    )
    eye = rng.normal(size=3)
    eye = 5 * eye / np.linalg.norm(eye)
    cam = build.camera(eye, up=(0, 0, 1), size=(10, 8), half=0.4)
    return build.scene(*parts, camera=cam, lights=lights, world=World((0.2, 0.3, 0.4)))


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_random_scenes(build, seed):
    compare(build, seed)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_known_scenes(build, seed):
    compare(build, seed)


def compare(build, seed):
    scene = random_scene(build, seed)
    film = trace(scene, Settings(samples=1, see="ALL", threads=1, max_depth=3, shadow_samples=0))
    assert not any(film.invariants.values())
    expected = Oracle(scene, 3).picture()
    off = np.abs(film.radiance - expected).max(2) > 1e-4 * (1 + expected.max())
    # A ray within rounding of an edge may go either way; 80 pixels with 3 bounces see few of them.
    assert np.count_nonzero(off) <= 2, (seed, np.argwhere(off), film.radiance[off], expected[off])
