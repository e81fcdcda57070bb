# SPDX-License-Identifier: GPL-3.0-or-later
"""What every kind of light promises (`emitters.light.CompiledLight`), and a new kind that is made of those alone.

The new kind is a flat ring. It is a disk less a smaller one, so pictures under it are known: those under two area
lights, of which the smaller takes light away.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import ClassVar

import numpy as np
import pytest

from hybrid_addon.scene import (
    AreaLight,
    Light,
    PlacedLight,
    PointLight,
    Settings,
    SpotLight,
    SunLight,
    Surface,
    World,
    lights,
)
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.core.sampler import r2
from hybrid_addon.tracer.core.vectors import dot, normalize, orthonormal_basis
from hybrid_addon.tracer.emitters.form_factors import ellipse_form_factor
from hybrid_addon.tracer.emitters.light import KINDS, Illumination, register
from hybrid_addon.tracer.emitters.lights import compile_lights, kind_of
from hybrid_addon.tracer.emitters.located import LocatedLight

# ------------------------------------------------------------------------------------------------ a new kind


@dataclass(frozen=True, eq=False)
class RingLight(PlacedLight):
    """A flat ring that shines along `direction`."""

    color_field: ClassVar[str] = "radiance"

    direction: tuple[float, float, float]
    radiance: tuple[float, float, float]
    inner: float
    outer: float


@dataclass(frozen=True, eq=False)
class CompiledRingLight(LocatedLight):
    is_delta = False
    color_over_radiance = 1.0

    @property
    def axis(self):
        return np.array(self.light.direction, np.float64)

    @property
    def area(self):
        return np.pi * (self.light.outer**2 - self.light.inner**2)

    def half_size(self, toward):
        return self.light.outer

    def validate(self):
        super().validate()
        self.require(bool(np.isfinite(self.light.direction).all()), "its direction must be finite")
        self.require_finite("inner", "outer")
        self.require_not_negative("inner", "outer")

    def _share(self, toward, turn):
        """Of the half space around +Z, of vectors turned into that frame."""
        tangents = [np.broadcast_to(t, toward.shape) for t in orthonormal_basis(self.axis[:, None])]
        radii = (self.light.outer, self.light.inner)
        whole, hole = (ellipse_form_factor(turn(toward), *(turn(t * r) for t in tangents)) for r in radii)
        return (whole - hole) * (dot(self.axis, toward) < 0)

    def illuminate(self, point, normal, least_distance):
        wi, d2 = self.nearness(point, least_distance)
        cosine = np.maximum(dot(wi, normal), np.float32(0))
        frame = (*orthonormal_basis(normal.astype(np.float64)), normal.astype(np.float64))
        share = self._share(wi * np.sqrt(d2).astype(np.float64), lambda a: np.stack([dot(e, a) for e in frame]))
        front = np.maximum(-dot(self.axis.astype(np.float32), wi), 0)
        specular = np.float32(self.area) * front / (d2 + np.float32(self.area / (2 * np.pi)))
        diffuse = np.maximum(np.pi * share, 0).astype(np.float32)
        return Illumination(wi, cosine, self.fade(diffuse, point, d2), self.fade(specular, point, d2), d2)

    def offset(self, toward, square):
        inner2, outer2 = self.light.inner**2, self.light.outer**2
        r, phi = np.sqrt(inner2 + (outer2 - inner2) * square[0]), 2 * np.pi * square[1]
        u, v = (t.astype(np.float32) for t in orthonormal_basis(self.axis[:, None]))
        return u * (r * np.cos(phi)) + v * (r * np.sin(phi))

    def lobe_share(self, lobe, toward, d2):
        return self._share(toward, lobe.untransformed), np.array([self.light.outer])

    def met_by(self, origin, direction):
        toward = self.position.astype(np.float64) - origin
        against = -dot(self.axis, direction)
        t = -dot(self.axis, toward) / against
        place = direction * t - toward
        r = np.sqrt(dot(place, place))
        return (against > 0) & (t > 0) & (self.light.inner <= r) & (r <= self.light.outer), t

    def emission_toward(self, direction):
        return self.area * np.maximum(dot(self.axis, direction), 0)


@pytest.fixture(autouse=True, scope="module")
def ring_is_registered():
    register(RingLight)(CompiledRingLight)
    yield
    del KINDS[RingLight]


RING = RingLight("ring", (0, 0, 4), (0, 0, -1), (3, 2, 1), 0.5, 1.0)
PLACE, DOWN, STRONG = (0.2, -0.1, 4.0), (0, 0, -1), (9.0, 6.0, 3.0)
POINT = PointLight("point", PLACE, STRONG)
LIGHTS = {
    "point": POINT,
    "disk": replace(POINT, radius=0.3),
    "ball": replace(POINT, radius=0.3, soft_falloff=False),
    "near point": replace(POINT, range=6.0),
    "spot": SpotLight("spot", PLACE, STRONG, 0.2, cos_cone=0.6),
    "near spot": SpotLight("spot", PLACE, STRONG, 0.2, range=6.0, cos_cone=0.2, blend=1.0),
    "sun": SunLight("sun", (0.05, 0.0, 1.0), STRONG),
    "soft sun": SunLight("sun", (0.0, 0.0, 1.0), STRONG, angle=0.1),
    "rectangle": AreaLight("area", PLACE, DOWN, (0.3, 0, 0), (0, 0.2, 0), STRONG),
    "ellipse": AreaLight("area", PLACE, DOWN, (0.3, 0, 0), (0, 0.2, 0), STRONG, "ELLIPSE", range=8.0),
    "ring": replace(RING, inner=0.2, outer=0.3, range=9.0),
}
every_light = pytest.mark.parametrize("name", LIGHTS)


def compiled(light):
    (result,) = compile_lights([light], np.zeros(3), np.zeros(1, np.intp))
    return result


def columns(*vectors):
    return np.array(vectors, np.float32).reshape(-1, 3).T


def numbers(n):
    return np.arange(n, dtype=np.uint32)


def squares(n, salt=1):
    return r2(np.array([salt], np.uint32), numbers(n))


def illuminate(light, point, normal):
    return light.illuminate(point, np.broadcast_to(normal, point.shape), np.full(point.shape[1], 1e-6, np.float32))


UP = columns((0, 0, 1))


class Cosine:
    """The lobe of a matt surface that faces up."""

    def untransformed(self, a):
        return a

    def reaches(self, toward, size):
        return ~(toward[2] <= -np.asarray(size))

    def take(self, _index):
        return self


# ------------------------------------------------------------------------------------------------ what all promise


def test_every_light_of_the_scene_has_its_kind_and_is_tried_here():
    of_scene = {kind for kind in vars(lights).values() if isinstance(kind, type) and issubclass(kind, Light)}
    assert of_scene - {Light, PlacedLight} == KINDS.keys() - {RingLight}
    assert {type(light) for light in LIGHTS.values()} == KINDS.keys()
    kinds = [kind_of(light) for light in LIGHTS.values()]
    assert not any(kind.__abstractmethods__ for kind in kinds)


def test_a_light_that_nobody_answers_for_is_refused_by_name(build):
    @dataclass(frozen=True)
    class Stranger:
        name: str = "stranger"

    with pytest.raises(ValueError, match="light 'stranger': no light is registered for Stranger"):
        trace(build.scene((build.box(), build.matte()), lights=(Stranger(),)), Settings(samples=1))


@every_light
def test_values_that_are_none_are_refused_by_name(name):
    """Each number of each field, in turn."""
    light, tried = LIGHTS[name], 0
    kind_of(light)(light).validate()
    for field in fields(light):
        value = getattr(light, field.name)
        if isinstance(value, (bool, str)) or value is None:
            continue
        wrong = np.full(np.shape(value), np.nan)
        wrong = float(wrong) if wrong.ndim == 0 else tuple(wrong) if wrong.ndim == 1 else wrong
        changed = replace(light, **{field.name: wrong})
        with pytest.raises(ValueError, match=f"light '{light.name}'"):
            kind_of(changed)(changed).validate()
        tried += 1
    assert tried >= 5


@every_light
def test_all_that_it_says_is_finite(name):
    """At its own place, beside it, far away, behind it and in its plane."""
    light = compiled(LIGHTS[name])
    x, y, z = PLACE
    near = [(x, y, z), (x, y, z - 1e-6), (x + 1e-6, y, z), (x, y, z + 1e-6), (0, 0, 4)]
    far = [(x + 3, y, z), (x, y, z + 3), (x, y, -1e9), (1e9, 1e9, 1e9), (0, 0, 0)]
    point = columns(*near, *far)
    n = point.shape[1]
    least, square = np.full(n, 1e-6, np.float32), squares(n)
    for normal in (UP, -UP, columns((0.6, 0, 0.8))):
        normals = np.broadcast_to(normal, point.shape)
        lit = light.illuminate(point, normals, least)
        for part in (lit.wi, lit.cosine, lit.diffuse, lit.specular):
            assert np.isfinite(part).all() and part.dtype == np.float32
            assert part.shape[-1] == n
        assert min(lit.cosine.min(), lit.diffuse.min(), lit.specular.min()) >= 0
        np.testing.assert_allclose(np.linalg.norm(lit.wi[:, len(near) :], axis=0), 1, rtol=1e-5)
        glow = light.highlight(point, normals, Cosine(), least)
        assert np.isfinite(glow).all() and glow.dtype == np.float32 and glow.min() >= 0
        if not light.is_delta:
            offset = light.offset(light.toward(point[:, 5:]), squares(n - 5))
            assert np.isfinite(offset).all()
        wi, distance = light.shadow_rays(point[:, 5:], normals[:, 5:], None if light.is_delta else squares(n - 5))
        assert np.isfinite(wi).all() and (distance > 0).all()
        assert np.isinf(distance).all() == light.is_infinite
    with np.errstate(all="ignore"):
        meets, t = light.met_by(point, np.broadcast_to(UP, point.shape).astype(np.float64))
    assert meets.dtype == bool and meets.shape == t.shape == (n,) and (t[meets] >= 0).all()
    assert np.isfinite(light.fade(np.ones(n, np.float32), point)).all()
    assert np.isfinite(light.radiance()).all()
    for radius in (1e-6, 1.0, 100.0, np.inf):
        photons = light.emit_photons(np.zeros(3), radius, square, squares(n, 2))
        assert np.isfinite(photons.power).all() and photons.power.min() >= 0
        np.testing.assert_allclose(np.linalg.norm(photons.direction, axis=0), 1, rtol=1e-6)
    assert ((light.photon_fading(10.0 ** np.arange(-3, 9)) >= 0) & (light.photon_fading(np.ones(12)) <= 1)).all()


@every_light
def test_what_it_cannot_reach_gets_nothing(name):
    light, rng, unreached = compiled(LIGHTS[name]), np.random.default_rng(1), 0
    for _ in range(200):
        low = rng.uniform(-12, 10, 3)
        high = low + rng.uniform(0, 4, 3)
        if light.can_reach((low, high)):
            continue
        unreached += 1
        point = rng.uniform(low, high, (50, 3)).T.astype(np.float32)
        for normal in (UP, -UP):
            lit = illuminate(light, point, normal)
            assert lit.diffuse.max() == 0
            assert lit.specular.max() == 0
    everywhere = light.is_infinite or name in ("point", "disk", "ball")
    assert (unreached == 0) == everywhere


@every_light
def test_its_points_stay_within_its_size(name):
    light, rng = compiled(LIGHTS[name]), np.random.default_rng(2)
    if light.is_delta:
        return
    for _ in range(20):
        toward = light.toward(rng.uniform(-4, 3, (200, 3)).T.astype(np.float32))
        size = np.linalg.norm(light.offset(toward, squares(200)), axis=0)
        assert (size <= light.half_size(toward.astype(np.float64)) * (1 + 1e-5)).all()


@every_light
def test_rays_to_its_points_meet_it(name):
    light = compiled(LIGHTS[name])
    if light.is_delta:
        assert light.is_unseen
        return
    origin = np.broadcast_to(columns((0.5, -0.3, -1)), (3, 400))
    wi, distance = light.shadow_rays(origin, np.broadcast_to(UP, origin.shape), squares(400))
    meets, t = light.met_by(origin, wi.astype(np.float64))
    assert meets.mean() > 0.98  # the rest lies on its rim
    away = np.minimum(t, 1e9)[meets]
    assert (np.abs(away - np.minimum(distance, 1e9)[meets]) <= 0.35).all()  # a ball is met on its near side


@every_light
def test_what_rays_see_of_it_is_what_it_lights_with(name):
    """Irradiance is radiance over all directions that meet it: shape, radiance, range and cone agree."""
    light, n = compiled(LIGHTS[name]), 200_000
    if light.is_delta:
        return
    place = columns((0.4, 0.3, 0.5))
    lit = illuminate(light, place, UP)
    x, y = 2 * np.stack(squares(n)).astype(np.float64) - 1
    middle, half = (light.toward(place.astype(np.float64)))[:, 0], 0.4
    slope_x, slope_y = middle[0] / middle[2] + half * x, middle[1] / middle[2] + half * y
    cosine = 1 / np.sqrt(1 + slope_x**2 + slope_y**2)
    direction = np.stack([slope_x, slope_y, np.ones(n)]) * cosine
    with np.errstate(invalid="ignore"):
        meets, _ = light.met_by(np.broadcast_to(place, (3, n)), direction)
    seen = (meets * cosine**4).mean() * (2 * half) ** 2 * light.radiance()[0, 0]
    faded = light.fade(np.ones(1, np.float32), place)[0]
    assert lit.diffuse[0] * light.color[0, 0] == pytest.approx(seen * faded, rel=0.02)


@every_light
def test_a_matt_lobe_reflects_its_irradiance(name):
    light = compiled(LIGHTS[name])
    point = columns((0.4, 0.3, 0.5), (-1, 0.5, 0), (0, 0, -2), (0, 1, 1))
    lit = illuminate(light, point, UP)
    glow = light.highlight(point, np.broadcast_to(UP, point.shape), Cosine(), np.zeros(4, np.float32))
    np.testing.assert_allclose(glow * np.pi, lit.diffuse, rtol=2e-3, atol=1e-7)


@every_light
@pytest.mark.parametrize(
    ("center", "factor"), [((0.4, 0.3, 0.5), 1.0), ((1.6, -0.1, 2.6), 0.25)], ids=["ahead", "aside"]
)
def test_photons_carry_its_light(name, center, factor):
    """On a small ball their power sums to irradiance times pi r^2, and each is on a way that meets the ball."""
    light, n, radius = compiled(replace(LIGHTS[name], diffuse=factor)), 4096, 0.01
    center = np.array(center)
    photons = light.emit_photons(center, radius, squares(n), squares(n, 2))
    place = center[:, None].astype(np.float32)
    lit = illuminate(light, place, illuminate(light, place, UP).wi)
    fading = light.photon_fading(np.linalg.norm(center[:, None] - photons.origin, axis=0))
    expected = light.color[:, 0] * lit.diffuse[0] * factor * np.pi * radius**2
    np.testing.assert_allclose((photons.power * fading).mean(axis=1), expected, rtol=0.02)
    along = dot(photons.direction, center[:, None] - photons.origin)
    gap = center[:, None] - photons.origin - photons.direction * along
    assert (along > 0).all() and np.linalg.norm(gap, axis=0).max() <= radius * (1 + 1e-6)


@pytest.mark.parametrize("name", ["point", "disk", "ball", "near point"])
def test_photons_fade_as_the_light_of_a_point_does(name):
    light, distance = compiled(LIGHTS[name]), np.array([0.5, 1.0, 4.0, 7.0])
    point = np.array(PLACE)[:, None] - distance * UP
    lit = illuminate(light, point.astype(np.float32), UP)
    np.testing.assert_allclose(light.photon_fading(distance), lit.specular * distance**2, rtol=1e-5, atol=1e-7)


# ------------------------------------------------------------------------------------------------ its picture

ROUGH = Surface("rough", layered=True, base_color=(0.8, 0.7, 0.6), roughness=0.5)
MIRROR = Surface("mirror", layered=True, reflectivity=1.0, roughness=0.0)


def disks(ring):
    """The area lights whose difference is the ring."""

    def disk(r, sign):
        radiance = tuple(sign * np.array(ring.radiance))
        return AreaLight(
            "disk", ring.position, ring.direction, (r, 0, 0), (0, r, 0), radiance, "ELLIPSE", range=ring.range
        )

    return disk(ring.outer, 1), disk(ring.inner, -1)


def stage(build, *lights, floor=ROUGH, floor_is_traced=True, ball=None, **other):
    quad = build.quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)])
    ground = (quad, floor, {"ray_traced": floor_is_traced})
    parts = (build.icosphere(2, 0.6), ball or build.matte(), {"matrix": build.translation(0.7, 0.4, 1.2)})
    camera = build.camera(eye=(0, -5, 3), target=(0, 0, 0.5), up=(0, 0, 1), size=(40, 40), half=0.5)
    return build.scene(ground, parts, camera=camera, lights=lights, world=World((0, 0, 0)), **other)


ALL = Settings(samples=1, camera_sees="ALL", threads=1, shadow_samples=0)
CAUGHT = replace(ALL, camera_sees="RAY_TRACED", raster_shadows=True)


@pytest.mark.parametrize("floor", [ROUGH, MIRROR], ids=["lit", "met"])
@pytest.mark.parametrize("reach", [float("inf"), 6.0])
def test_a_new_light_lights_and_is_met(build, floor, reach):
    ring = replace(RING, range=reach)
    film = trace(stage(build, ring, floor=floor), ALL)
    other = trace(stage(build, *disks(ring), floor=floor), ALL)
    off = np.abs(film.radiance - other.radiance).max(axis=-1) > 1e-3 * other.radiance.max()
    assert off.mean() < 0.005  # a ray may just miss the rim
    assert film.radiance.max() > 0.1
    assert (film.rays.get("lamps", 0) > 0) == (other.rays.get("lamps", 0) > 0)


def test_a_new_light_casts_shadows_on_the_raster(build):
    film, other = (trace(stage(build, *lights, floor_is_traced=False), CAUGHT) for lights in ((RING,), disks(RING)))
    assert film.shadow.min() == 0
    np.testing.assert_allclose(film.shadow, other.shadow, atol=1e-5)
    soft = trace(stage(build, RING, floor_is_traced=False), replace(CAUGHT, shadow_samples=16)).shadow
    assert ((soft > 0.1) & (soft < 0.9)).mean() > ((film.shadow > 0.1) & (film.shadow < 0.9)).mean()


def test_a_new_light_sends_photons(build):
    settings = replace(CAUGHT, caustics="PHOTONS", photons=1 << 16)
    film, other = (
        trace(stage(build, *lights, floor_is_traced=False, ball=build.mirror()), settings)
        for lights in ((RING,), disks(RING))
    )
    assert film.caustic.max() > 0
    np.testing.assert_allclose(film.caustic.sum(axis=(0, 1)), other.caustic.sum(axis=(0, 1)), rtol=0.05)


def test_a_new_light_is_culled_where_it_reaches_nothing(build):
    away = replace(RING, direction=(0, 0, 1))
    film = trace(stage(build, away), ALL)
    assert film.radiance.max() == 0
    assert any("turned away" in entry["why"] for entry in film.skipped)


def test_a_new_light_is_validated(build):
    with pytest.raises(ValueError, match="light 'ring': outer must not be negative"):
        trace(stage(build, replace(RING, outer=-1.0)), ALL)


@every_light
def test_fog_gets_what_a_plane_that_faces_the_light_gets(name):
    """Large lamps less, by up to a fifth; at the lamp's own place it is finite, too."""
    light = compiled(LIGHTS[name])
    point = (np.array(PLACE)[:, None] + np.array([[0.0, 0.5], [0.0, 0.2], [-4.0, -3.0]])).astype(np.float32)
    facing = normalize(light.toward(point))
    expected = light.illuminate(point, facing, np.zeros(2, np.float32)).specular
    found = light.into_fog(point)
    assert (found <= expected * 1.01).all() and (found >= 0.8 * expected).all() and found.any()
    here = light.into_fog(np.array(PLACE, np.float32)[:, None])
    assert np.isfinite(here).all() and (here >= 0).all()
