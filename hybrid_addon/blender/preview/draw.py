# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced pictures on the screen, through Blender's gpu module."""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix

from .job import Picture


class Quad:
    """A picture as a texture and the rectangle that it fills; the drawing is over whatever is there."""

    def __init__(self, picture: Picture, *, sharp: bool = False) -> None:
        """sharp: enlarged, its pixels are squares (Blender 5; 4.5 has no choice)."""
        height, width = picture.pixels.shape[:2]
        data = gpu.types.Buffer("FLOAT", picture.pixels.size, np.ascontiguousarray(picture.pixels).reshape(-1))
        self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=data)
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
        width, height = size
        to_clip = Matrix(((2 / width, 0, 0, -1), (0, 2 / height, 0, -1), (0, 0, 1, 0), (0, 0, 0, 1)))
        with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            gpu.matrix.load_matrix(Matrix.Identity(4))
            gpu.matrix.load_projection_matrix(to_clip)
            gpu.state.depth_test_set("NONE")
            gpu.state.blend_set("ALPHA_PREMULT")
            self._shader.uniform_sampler("image", self._texture)
            self._batch.draw(self._shader)
            gpu.state.blend_set("NONE")
