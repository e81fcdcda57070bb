# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced pictures on the screen, through Blender's gpu module."""

from __future__ import annotations

from functools import cache
from typing import Any

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix

from .job import Picture
from .reproject import Surface

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
  float over = texelFetch(overlays, ivec2(gl_FragCoord.xy), 0).a;
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
        self._texture = _texture(picture.pixels)
        x0, y0, x1, y1 = picture.rect
        corners = np.array(((x0, y0, 0), (x1, y0, 0), (x1, y1, 0), (x0, y1, 0)), np.float32)
        places = np.array(((0, 0), (1, 0), (1, 1), (0, 1)), np.float32)
        self._flat = _batch(corners, places, np.array(((0, 1, 2), (0, 2, 3)), np.int32))
        self._held: Any = None
        if surface is not None:
            size = np.array((x1 - x0, y1 - y0), np.float32)
            places = (surface.pixels - np.array((x0, y0), np.float32)) / size
            self._held = _batch(surface.points, places, surface.triangles)

    def draw(self, size: tuple[int, int]) -> None:
        """Where it was traced, in a region of this size in pixels."""
        self._draw(self._flat, _to_clip(size), size)

    def draw_moved(self, size: tuple[int, int], view: Matrix) -> None:
        """What it showed as it is seen now. view: from the world to clip coordinates."""
        if self._held is not None:
            self._draw(self._held, view, size)

    def _draw(self, batch: Any, matrix: Matrix, size: tuple[int, int]) -> None:
        width, height = size
        buffer = gpu.state.active_framebuffer_get().read_color(0, 0, width, height, 4, 0, "FLOAT")
        buffer.dimensions = width * height * 4
        overlays = gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer)
        shader = _shader()
        gpu.state.depth_test_set("NONE")
        gpu.state.blend_set("ADDITIVE_PREMULT")  # the shader has left out what overlays cover
        shader.uniform_float("matrix", matrix)
        shader.uniform_sampler("image", self._texture)
        shader.uniform_sampler("overlays", overlays)
        batch.draw(shader)
        gpu.state.blend_set("NONE")


def _batch(points: Any, places: Any, triangles: Any) -> Any:
    return batch_for_shader(_shader(), "TRIS", {"pos": points, "texCoord": places}, indices=triangles)


@cache
def _shader() -> Any:
    """Of a picture below what the active framebuffer has."""
    info, passed = gpu.types.GPUShaderCreateInfo(), gpu.types.GPUStageInterfaceInfo("hybrid_preview")
    passed.smooth("VEC2", "uv")
    info.push_constant("MAT4", "matrix")
    info.sampler(0, "FLOAT_2D", "image")
    info.sampler(1, "FLOAT_2D", "overlays")
    info.vertex_in(0, "VEC3", "pos")
    info.vertex_in(1, "VEC2", "texCoord")
    info.vertex_out(passed)
    info.fragment_out(0, "VEC4", "fragColor")
    info.vertex_source(VERTEX)
    info.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(info)
