# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tracer renders: plain, frozen data with no behaviour and no Blender handles.

Conventions, stated here once and valid in every pure module of the package:

* **Units**: metres, radians, watts. Radiance W/(sr m^2), radiant intensity W/sr, irradiance W/m^2, each as
  linear RGB in the file's scene-linear working space (no constant assumes Rec.709).
* **Axes**: right handed, world +Z up. A camera looks along its local -Z with +Y up; a sun, spot or area light
  shines along its local -Z. Triangle winding is counter-clockwise seen from outside.
* **Images**: (height, width, channels) float32, row 0 at the *bottom*, pixel (i, j) covers [i, i+1) x [j, j+1),
  its centre is (i + .5, j + .5). Alpha is *associated* (premultiplied) in every picture of the pipeline.
* **Rays and other per-ray data**: structure of arrays, (3, n) float32. Per-vertex data that Embree and Blender share
  keeps their layout, (n, 3).
* **Matrices**: (4, 4) float64, column vectors (P' = M P), so that a scene far from the origin keeps its digits until
  the tracer has recentred it.
* **Directions** `wi`, `wo` point away from the surface; `eta` is transmitted over incident IOR.

    camera.py surfaces.py values.py programs.py texels.py media.py fog.py geometry.py lights.py film.py
                                                                      the dataclasses, all here, too
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .camera import Camera, Lens, Panorama
from .film import Film, Raster, Settings
from .fog import Fog, FogBody, VoxelGrid
from .geometry import Instance, Plane, Sphere, TriangleMesh, Visibility
from .lights import AreaLight, Arriving, Light, PlacedLight, PointLight, SpotLight, SunLight, World, WorldSun
from .media import Medium
from .numbers import BLACK, RGB, WHITE, Bools, Float32, Float64, Int32
from .programs import SurfaceAnswer, SurfaceHits, SurfaceProgram
from .surfaces import Closure, Surface, Texture
from .texels import Texels
from .values import Color, Expression, Number, Value

__all__ = [
    "BLACK",
    "RGB",
    "WHITE",
    "AreaLight",
    "Arriving",
    "Bools",
    "Camera",
    "Closure",
    "Color",
    "Expression",
    "Film",
    "Float32",
    "Float64",
    "Fog",
    "FogBody",
    "Instance",
    "Int32",
    "Lens",
    "Light",
    "Medium",
    "Number",
    "Panorama",
    "PlacedLight",
    "Plane",
    "PointLight",
    "Raster",
    "Scene",
    "Settings",
    "Sphere",
    "SpotLight",
    "SunLight",
    "Surface",
    "SurfaceAnswer",
    "SurfaceHits",
    "SurfaceProgram",
    "Texels",
    "Texture",
    "TriangleMesh",
    "Value",
    "Visibility",
    "VoxelGrid",
    "World",
    "WorldSun",
]


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that one frame needs. raster: the other half of the picture, if there is one to look at."""

    camera: Camera
    meshes: tuple[TriangleMesh, ...] = ()
    instances: tuple[Instance, ...] = ()
    spheres: tuple[Sphere, ...] = ()
    planes: tuple[Plane, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    lights: tuple[Light, ...] = ()
    world: World = field(default_factory=World)
    arriving: Arriving = field(default_factory=Arriving)
    fog: Fog = field(default_factory=Fog)
    raster: Raster | None = None

    @property
    def ray_traced_surfaces(self) -> Bools:
        """(s,) which surfaces are ray traced whichever object wears them."""
        return np.array([surface.ray_traced for surface in self.surfaces], bool)

    def is_ray_traced(self, thing: Instance | Sphere | Plane) -> bool:
        """Whether any of it is: all of it, or what wears one of its surfaces."""
        worn = thing.surfaces if isinstance(thing, Instance) else (thing.surface,)
        return thing.ray_traced or any(self.surfaces[number].ray_traced for number in worn)

    @property
    def names(self) -> list[str]:
        """Of all objects: instances, then spheres, then planes."""
        return [*(i.name for i in self.instances), *(s.name for s in self.spheres), *(p.name for p in self.planes)]
