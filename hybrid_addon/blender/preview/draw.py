# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced pictures on the screen, through Blender's gpu module."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix
from numpy.typing import NDArray

from ...scene import Float32, Float64
from .job import Picture
from .reproject import Surface
from .view import Rect

VERTEX = """
void main()
{
  uv = texCoord;
  gl_Position = matrix * vec4(pos, 1.0);
}
"""

FRAGMENT = """
void main()
{
  ivec2 place = clamp(ivec2(gl_FragCoord.xy) - ivec2(origin), ivec2(0), textureSize(overlays, 0) - 1);
  float over = texelFetch(overlays, place, 0).a;
  float there = float(all(greaterThanEqual(uv, vec2(0.0))) && all(lessThanEqual(uv, vec2(1.0))));
  vec4 color = texture(image, uv);
  vec3 encoded = color.rgb / max(color.a, 1e-6);
  vec3 curve = pow((encoded + 0.055) / 1.055, vec3(2.4));
  vec3 linear = mix(encoded / 12.92, curve, greaterThan(encoded, vec3(0.04045)));
  fragColor = vec4(linear * color.a, color.a) * there * (1.0 - clamp(over, 0.0, 1.0));
}
"""
"""What is drawn in a viewport goes into a picture in sRGB, as which the graphics card encodes what a shader gives."""


def _texture(pixels: Any) -> Any:
    height, width = pixels.shape[:2]
    data = gpu.types.Buffer("FLOAT", pixels.size, np.ascontiguousarray(pixels, np.float32).reshape(-1))
    return gpu.types.GPUTexture((width, height), format="RGBA16F", data=data)


def _to_clip(size: tuple[int, int]) -> Matrix:
    """From the pixels of a region of this size."""
    width, height = size
    return Matrix(((2 / width, 0, 0, -1), (0, 2 / height, 0, -1), (0, 0, 1, 0), (0, 0, 0, 1)))


class Quad:
    """A picture as a texture and the rectangle that it fills; the drawing is over whatever is there."""

    def __init__(self, picture: Picture, *, sharp: bool = False) -> None:
        """sharp: enlarged, its pixels are squares (Blender 5; 4.5 has no choice)."""
        self._texture = _texture(picture.pixels)
        if sharp and hasattr(self._texture, "filter_mode"):
            self._texture.filter_mode(False)
        x0, y0, x1, y1 = picture.rect
        self._shader = gpu.shader.from_builtin("IMAGE")
        self._batch: Any = batch_for_shader(
            self._shader,
            "TRI_FAN",
            {
                "pos": ((x0, y0), (x1, y0), (x1, y1), (x0, y1)),
                "texCoord": ((0, 0), (1, 0), (1, 1), (0, 1)),
            },
        )

    def draw(self, size: tuple[int, int]) -> None:
        """Draw over a region of this size in pixels."""
        with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            gpu.matrix.load_matrix(Matrix.Identity(4))
            gpu.matrix.load_projection_matrix(_to_clip(size))
            gpu.state.depth_test_set("NONE")
            gpu.state.blend_set("ALPHA_PREMULT")
            self._shader.uniform_sampler("image", self._texture)
            self._batch.draw(self._shader)
            gpu.state.blend_set("NONE")


class Layer:
    """A picture of a view, to be drawn in the viewport over EEVEE's but under Blender's overlays.

    Blender has drawn these into a picture of their own before our handlers are called, and lays it over the scene's:
    what is opaque there stays. While the view moves the picture is drawn on the surfaces that it showed.
    """

    def __init__(self, picture: Picture, surface: Surface | None) -> None:
        self._texture, self._rect, self._surface = _texture(picture.pixels), picture.rect, surface
        x0, y0, x1, y1 = picture.rect
        corners = np.array(((x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)), np.float32)
        places = np.array(((0, 0), (1, 0), (1, 1), (0, 1)), np.float32)
        self._flat = _batch(corners, places, np.array(((0, 1, 2), (0, 2, 3)), np.int32))
        if surface is not None:
            size = np.array((x1 - x0, y1 - y0), np.float32)
            self._places = (surface.pixels - np.array((x0, y0), np.float32)) / size

    def draw(self, size: tuple[int, int]) -> None:
        """Where it was traced, in a region of this size in pixels."""
        self._draw(self._flat, _to_clip(size), self._rect, size)

    def draw_moved(self, size: tuple[int, int], view: Matrix) -> None:
        """What it showed as it is seen now, the nearest last. view: from the world to clip coordinates."""
        if self._surface is not None:
            points, matrix = self._surface.points, np.array(view, np.float64)
            triangles = self._surface.triangles[far_to_near(points, self._surface.triangles, matrix)]
            self._draw(_batch(points, self._places, triangles), view, seen_part(points, matrix, size), size)

    def _draw(self, batch: Any, matrix: Matrix, rect: Rect, size: tuple[int, int]) -> None:
        """rect: the part of the region in which the batch lies. What overlays cover there is read back, not more."""
        width, height = size
        x0, y0, x1, y1 = max(rect[0], 0), max(rect[1], 0), min(rect[2], width), min(rect[3], height)
        if x0 >= x1 or y0 >= y1:
            return
        buffer = gpu.state.active_framebuffer_get().read_color(x0, y0, x1 - x0, y1 - y0, 4, 0, "FLOAT")
        buffer.dimensions = (x1 - x0) * (y1 - y0) * 4
        overlays = gpu.types.GPUTexture((x1 - x0, y1 - y0), format="RGBA16F", data=buffer)
        shader = _shader()
        gpu.state.depth_test_set("NONE")
        gpu.state.blend_set("ALPHA_PREMULT")  # the shader has left out what overlays cover
        shader.uniform_float("matrix", matrix)
        shader.uniform_float("origin", (x0, y0))
        shader.uniform_sampler("image", self._texture)
        shader.uniform_sampler("overlays", overlays)
        batch.draw(shader)
        gpu.state.blend_set("NONE")


def far_to_near(points: Float32, triangles: NDArray[np.int32], view: Float64) -> NDArray[np.intp]:
    """(m,) the order in which triangles (m, 3) of points (n, 3) hide one another, as 4 x 4 `view` sees them."""
    depth = points @ view[3, :3] + view[3, 3]
    if np.ptp(depth) == 0:  # without perspective it is not in w
        depth = points @ view[2, :3]
    return np.argsort(-depth[triangles].sum(axis=1), kind="stable")


def seen_part(points: Float32, view: Float64, size: tuple[int, int]) -> Rect:
    """The pixels of a region of this size in which points (n, 3) of the world lie; all, if one is behind the eye.

    view : 4 x 4, from the world to clip coordinates.
    """
    x, y, _, w = view @ np.vstack([points.T, np.ones(len(points))])
    if not (w > 0).all():
        return (0, 0, *size)
    low, high = [], []
    for values, pixels in zip((x / w, y / w), size, strict=True):
        ends = np.clip((np.array((values.min(), values.max())) + 1) / 2 * pixels, 0, pixels)
        low.append(int(ends[0]))
        high.append(math.ceil(ends[1]))
    return (low[0], low[1], high[0], high[1])


def _batch(points: Any, places: Any, triangles: Any) -> Any:
    return batch_for_shader(_shader(), "TRIS", {"pos": points, "texCoord": places}, indices=triangles)


@cache
def _shader() -> Any:
    """Of a picture below what the active framebuffer has."""
    info, passed = gpu.types.GPUShaderCreateInfo(), gpu.types.GPUStageInterfaceInfo("hybrid_preview")
    passed.smooth("VEC2", "uv")
    info.push_constant("MAT4", "matrix")
    info.push_constant("VEC2", "origin")
    info.sampler(0, "FLOAT_2D", "image")
    info.sampler(1, "FLOAT_2D", "overlays")
    info.vertex_in(0, "VEC3", "pos")
    info.vertex_in(1, "VEC2", "texCoord")
    info.vertex_out(passed)
    info.fragment_out(0, "VEC4", "fragColor")
    info.vertex_source(VERTEX)
    info.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(info)


def line(start: Any, end: Any, color: tuple[float, ...], width: float, size: tuple[int, int]) -> None:
    """A straight line in a region of this size in pixels, so many pixels wide, over whatever is there."""
    (x0, y0), (x1, y1) = start, end
    length = max(((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5, 1e-6)
    right, up = (y1 - y0) / length * width / 2, (x0 - x1) / length * width / 2
    corners = ((x0 - right, y0 - up), (x1 - right, y1 - up), (x1 + right, y1 + up), (x0 + right, y0 + up))
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.load_matrix(Matrix.Identity(4))
        gpu.matrix.load_projection_matrix(_to_clip(size))
        gpu.state.depth_test_set("NONE")
        gpu.state.blend_set("ALPHA")
        shader.uniform_float("color", color)
        batch_for_shader(shader, "TRI_FAN", {"pos": corners}).draw(shader)
        gpu.state.blend_set("NONE")
