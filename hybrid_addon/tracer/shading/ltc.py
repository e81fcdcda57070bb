"""Highlights of rough surfaces: GGX lobes over lamps that have a shape, by linearly transformed cosines.

A lobe is a clamped cosine that a matrix has stretched and turned (Heitz, Dupuy, Hill and Neubelt 2016, Real-Time
Polygonal-Light Shading with Linearly Transformed Cosines), and what it sees of a lamp is what the cosine sees of the
lamp under the inverse matrix (`form_factors`). EEVEE does the same, so both halves of a picture agree.

The table is our own (tools/fit_ltc.py): the lobe's mean direction as an angle off the mirror's, and the matrix, all
over alpha.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from ...scene import AreaLight, Float32, Float64, PointLight, SpotLight, SunLight
from ..core.constants import LEAST_COSINE, LEAST_LAMP, LTC_FADE
from ..core.vectors import Array, cross, dot, orthonormal_basis
from ..emitters.form_factors import ellipse_form_factor, form_factor
from ..emitters.lights import CompiledLight, disk_of_ball, range_window, spot_factor


@cache
def _table() -> Float64:
    """(4, roughness, cosine): tilt, m11, m22, m13 over alpha; steps of roughness and of sqrt(1 - cosine)."""
    table: Array = np.load(Path(__file__).with_name("ltc.npy"))
    return table.astype(np.float64)


@dataclass(frozen=True, eq=False)
class Lobe:
    """GGX lobes of n hits, as clamped cosines around the axis `z` of a frame, stretched by m11, m22, m13.

    x, y, z : (3, n) float64 unit vectors.   m11, m22, m13 : (n,) float64.
    """

    x: Float64
    y: Float64
    z: Float64
    m11: Float64
    m22: Float64
    m13: Float64

    def untransformed(self, a: Float64) -> Float64:
        """Vectors (3, n) where the lobe is a cosine around +Z."""
        z = dot(self.z, a)
        return np.stack([(dot(self.x, a) - self.m13 * z) / self.m11, dot(self.y, a) / self.m22, z])


def ggx_lobe(wo: Float32, n: Float32, roughness: Float32) -> Lobe:
    """Lobes of surfaces of normals n (3, n) and a roughness (n,) > 0, seen along wo (3, n); from below as edge on."""
    normal, eye = n.astype(np.float64), wo.astype(np.float64)
    cos = np.clip(dot(normal, eye), LEAST_COSINE, 1)
    across = eye - normal * dot(normal, eye)
    sin = np.sqrt(dot(across, across))
    any_tangent, _ = orthonormal_basis(normal)
    tangent = np.where(sin > LEAST_COSINE, across / np.maximum(sin, LEAST_COSINE), any_tangent)
    alpha = roughness.astype(np.float64) ** 2
    tilt, m11, m22, m13 = _look_up(cos, roughness) * alpha
    # From the mirror's direction, which is as far from the normal as the eye, on the other side.
    angle = np.arctan2(sin, cos) + tilt
    sin, cos = np.sin(angle), np.cos(angle)
    return Lobe(-cos * tangent - sin * normal, cross(normal, tangent), cos * normal - sin * tangent, m11, m22, m13)


def _look_up(cos: Float64, roughness: Float32) -> Float64:
    """(4, n) of the table, bilinear."""
    table = _table()
    last = table.shape[1] - 1
    x, y = np.sqrt(1 - cos) * last, np.clip(roughness, 0, 1).astype(np.float64) * last
    i, j = np.minimum(x.astype(np.intp), last - 1), np.minimum(y.astype(np.intp), last - 1)
    u, v = x - i, y - j
    flat, place = table.reshape(4, -1), j * (last + 1) + i
    low = flat.take(place, axis=1) * (1 - u) + flat.take(place + 1, axis=1) * u
    high = flat.take(place + last + 1, axis=1) * (1 - u) + flat.take(place + last + 2, axis=1) * u
    return np.asarray(low * (1 - v) + high * v)


def highlight(
    light: CompiledLight, point: Float32, n_geometric: Float32, lobe: Lobe, least_distance: Float32
) -> Float32:
    """What lobes of albedo 1 reflect of a light of colour 1: (n,) float32, >= 0; without its weight for highlights.

    n_geometric    : (3, n), on the side of the eye.
    least_distance : (n,), the points' own uncertainty: a light that is nearer counts as this far.
    """
    lamp = light.light
    place = light.position.astype(np.float64)
    if isinstance(lamp, SunLight):  # at distance 1, whatever the scene's scale
        toward = np.broadcast_to(place, point.shape)
        d2 = dot(toward, toward)
    else:
        toward = place - point
        d2 = np.maximum(dot(toward, toward), least_distance.astype(np.float64) ** 2)
    if isinstance(lamp, AreaLight):
        u, v = (np.array(a, np.float64)[:, None] for a in (lamp.axis_u, lamp.axis_v))
        radius = np.sqrt(dot(u, u) + dot(v, v))
        behind = dot(np.array(lamp.direction, np.float64), toward) >= 0
        seen = _of_area(lobe, toward, u, v, lamp.shape == "ELLIPSE") * ~behind
    else:
        seen, radius = _of_disk(lobe, lamp, toward, d2)
    seen = seen * _facing(toward, d2, radius, n_geometric)
    if not isinstance(lamp, SunLight) and np.isfinite(lamp.range):
        seen = seen * range_window(d2, lamp.range)
    if isinstance(lamp, SpotLight):
        seen = seen * spot_factor(lamp, point - light.position)
    return np.asarray(seen, np.float32)


def _facing(toward: Float64, d2: Float64, radius: Array, n: Float32) -> Float64:
    """EEVEE's fading (n,) of lamps that are below the horizon of a surface, where lobes leak: 1 until their upper end
    is there, 0 from LTC_FADE further (light_attenuation_facing in eevee_light_lib)."""
    d = np.sqrt(d2)
    return np.clip((radius / d + dot(n, toward) / d) / LTC_FADE + 1, 0, 1)


def _of_area(lobe: Lobe, toward: Float64, u: Float64, v: Float64, is_round: bool) -> Float64:
    """Share (n,) of the lobe that an area light fills, both sides of it."""
    center = lobe.untransformed(toward)
    u, v = (lobe.untransformed(np.broadcast_to(a, toward.shape)) for a in (u, v))
    if is_round:
        return ellipse_form_factor(center, u, v)
    corners = [center - u - v, center + u - v, center + u + v, center - u + v]
    return form_factor(corners, np.array([[0.0], [0.0], [1.0]]))


def _of_disk(lobe: Lobe, lamp: PointLight | SunLight, toward: Float64, d2: Float64) -> tuple[Float64, Float64]:
    """Of point, spot and sun: the share of the lobe over pi radius^2, as their colours are intensities or irradiance;
    and the radius (n,). One too small to tell counts as LEAST_LAMP of its distance."""
    distance = np.sqrt(d2)
    if isinstance(lamp, SunLight):
        radius = np.full(len(d2), max(np.tan(min(lamp.angle, np.pi) / 2), LEAST_LAMP))
        over = np.pi * radius**2 / (1 + radius**2)
    else:
        own = np.maximum(lamp.radius, LEAST_LAMP * distance)
        over = np.pi * own**2
        radius = own if lamp.soft_falloff else np.where(own < distance, disk_of_ball(1.0, d2 / own**2) * own, own)
    tangent, bitangent = orthonormal_basis(toward / distance)
    center, u, v = (lobe.untransformed(a) for a in (toward, tangent * radius, bitangent * radius))
    seen = ellipse_form_factor(center, u, v)
    if not isinstance(lamp, SunLight) and not lamp.soft_falloff:
        seen = np.where(own < distance, seen, 1.0)  # within a ball all is light
    return seen / over, radius
