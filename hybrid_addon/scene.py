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
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
RGB = tuple[float, float, float]

WHITE: RGB = (1.0, 1.0, 1.0)
BLACK: RGB = (0.0, 0.0, 0.0)


# ------------------------------------------------------------------------------------------------ camera


@dataclass(frozen=True, eq=False)
class Lens:
    """A thin lens: what is not at the distance of focus is blurred.

    radius         : metres, of its opening across the axis; > 0.
    focus_distance : metres along the view axis to the plane that is sharp; > 0.
    blades         : corners of the opening, which lie on that radius; less than 3: it is round.
    rotation       : radians, counter-clockwise as the camera looks, of the middle of its first edge from local +X.
    ratio          : how much narrower than high the opening is (2 = anamorphic bokeh).
    """

    radius: float
    focus_distance: float
    blades: int = 0
    rotation: float = 0.0
    ratio: float = 1.0


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective or orthographic camera, and the window of its frame that is rendered.

    matrix_world : (4, 4) float64, camera to world, without scale.
    view_plane   : (left, right, bottom, top) of the *full* frame, shift and pixel aspect included: on the plane z = -1
                   for PERSP (so unitless tangents), in metres for ORTHO.
    resolution   : (width, height) of the full frame in pixels.
    window       : (x0, y0, x1, y1), half open, in pixels of the full frame: the render border, or the whole frame.
    clip_start, clip_end : metres along the view axis; they limit camera rays only.
    lens         : None is a pinhole, all is sharp.
    """

    projection: Literal["PERSP", "ORTHO"]
    matrix_world: Float64
    view_plane: tuple[float, float, float, float]
    resolution: tuple[int, int]
    window: tuple[int, int, int, int]
    clip_start: float = 0.1
    clip_end: float = 1000.0
    lens: Lens | None = None


# ------------------------------------------------------------------------------------------------ surfaces


@dataclass(frozen=True, eq=False)
class Texture:
    """An image: (height, width, 4) float32, scene-linear, straight alpha, row 0 at the bottom.

    uv_transform : (2, 3) float64, applied to (u, v, 1) first (Blender's Mapping node).
    uv_map       : name of the mesh's UV map, "" for the one that is active for rendering.
    extension    : "SPHERE" goes around in u and ends in v, as an equirectangular image does.
    tiles        : of a tiled image (UDIM), (column, row) -> pixels of the unit square of texture coordinates that
                   begins there; `pixels` is what is seen everywhere else.
    """

    name: str
    pixels: Float32
    extension: Literal["REPEAT", "EXTEND", "CLIP", "MIRROR", "SPHERE"] = "REPEAT"
    interpolation: Literal["LINEAR", "CLOSEST"] = "LINEAR"
    uv_map: str = ""
    uv_transform: Float64 = field(default_factory=lambda: np.eye(2, 3))
    tiles: Mapping[tuple[int, int], Float32] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Expression:
    """A number or colour that varies over a surface; expressions.py has the operations and works it out at each hit.

    operation : its name there: "image", "attribute", "multiply", "ramp", ...
    inputs    : numbers, colours and expressions.
    data      : what the operation needs besides: the Texture of an image, the key of an attribute, a ramp's table.
    """

    operation: str
    inputs: tuple[Value, ...] = ()
    data: Any = None


Value = float | RGB | Expression
Number = float | Expression
Color = RGB | Expression


@dataclass(frozen=True, eq=False)
class Surface:
    """How a surface answers light (Whitted, energy conserving; docs/reference/surface-model.md).

    L = r Lr + (1 - r) [ o Llocal + (1 - o) (F Lr + (1 - F) Lt) ] + Le

    with r `reflectivity` (Lr tinted by `reflection_tint`), o `opacity`, F the exact unpolarised Fresnel reflectance for
    `ior`, Lt the refracted radiance tinted by `transmission_tint` at each crossing, and
    Llocal = ambient base_color E_world / pi + sum over lights (diffuse base_color / pi + Phong specular) E_light.

    Numbers and colours may be constants or an `Expression`. With `layered` the surface answers as EEVEE's
    Principled does, and r, o, F above are the shares of what lies under its layers (tracer/materials/principled.py):
    sheen, then coat, then the metal's or the dielectric's own reflection, whose Fresnel weight is taken from what is
    below it.

    base_color         : linear RGB albedo; of an image, Expression("image", (), Texture(...)).
    ambient, diffuse   : weights of the world's diffuse light and of the lights' diffuse light, 0..1.
    specular           : RGB reflectance at normal incidence of the Phong highlight (0 switches it off).
    roughness          : 0..1 as in Principled (alpha = roughness^2); it sets the Phong exponent.
    emission           : RGB radiance, added whatever the other weights are.
    ior                : refractive index inside, against vacuum, > 0. Closed bodies that transmit nest: where some
                         overlap the smallest displaces the others (an air bubble in water has IOR 1). An open
                         sheet bends light once, by ior, whatever it lies in.
    interface_tint     : tint of F Lr.
    normal             : shading normal by a normal map or bump, or None: the mesh's.
    edge_tint          : of a metal, at 82 degrees (F82), where `reflection_tint` holds at normal incidence; None: it
                         reflects the same at all angles.
    thin               : it transmits as a thin pane: straight on, both of its faces at once.
    coat, coat_*       : weight 0..1, roughness, IOR of a clear coat, and the tint it gives to what is below.
    sheen, sheen_*     : weight, roughness and colour of the fuzz on top.
    absorption         : RGB, 1/m, >= 0: light that goes d metres through the solid keeps exp(-absorption d) of itself
                         (Beer-Lambert). Only closed bodies that transmit have an inside; where some overlap, the
                         smallest one's counts, as with ior.
    culled             : its back faces are not there: rays pass as through nothing. Those of closed bodies that bend or
                         absorb light are there: by them rays leave.
    shadow_culled      : the same for shadow rays: what a light sees the back of is not in its way.
    approximate        : the translator could not follow all that it is made of: what the raster shows of it is nearer.
    """

    name: str = ""
    base_color: Color = (0.8, 0.8, 0.8)
    ambient: float = 1.0
    diffuse: float = 1.0
    specular: Color = BLACK
    roughness: Number = 0.5
    emission: Color = BLACK
    reflectivity: Number = 0.0
    reflection_tint: Color = WHITE
    opacity: Number = 1.0
    transmission_tint: Color = WHITE
    ior: float = 1.45
    interface_tint: Color = WHITE
    normal: Expression | None = None
    layered: bool = False
    edge_tint: Color | None = None
    thin: bool = False
    coat: Number = 0.0
    coat_roughness: Number = 0.03
    coat_ior: float = 1.5
    coat_tint: Color = WHITE
    sheen: Number = 0.0
    sheen_roughness: Number = 0.5
    sheen_tint: Color = WHITE
    absorption: RGB = BLACK
    culled: bool = False
    shadow_culled: bool = False
    approximate: bool = False


# ------------------------------------------------------------------------------------------------ geometry


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles in local space; shared by its instances.

    vertices         : (nv, 3) float32.
    triangles        : (nt, 3) int32, vertex index of each corner.
    corners          : (nt, 3) int32, index of each corner into `normals` and `uv_maps`.
    normals          : (nc, 3) float32 shading normals, or None: flat shaded throughout.
    uv_maps          : name -> (nc, 2) float32; "" is the map active for rendering.
    surface_slots    : (nt,) int32, which of the instance's surfaces each triangle wears.
    attributes       : other data of the corners, key -> (nc, width) float32. "color:NAME" (4), "generated" (3, 0..1
                       over the bounds), "object" (3, local position), "tangent:UV MAP" (4, local direction and the
                       sign of the bitangent).
    """

    name: str
    vertices: Float32
    triangles: Int32
    corners: Int32
    normals: Float32 | None = None
    uv_maps: Mapping[str, Float32] = field(default_factory=dict)
    surface_slots: Int32 | None = None
    attributes: Mapping[str, Float32] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Visibility:
    """Which rays an object exists for: camera rays, shadow rays, and all others (reflected and refracted)."""

    camera: bool = True
    shadow: bool = True
    secondary: bool = True


@dataclass(frozen=True, eq=False)
class Instance:
    """One appearance of a mesh in the world.

    mesh, surfaces : indices into `Scene.meshes` and `Scene.surfaces` (one for each slot).
    matrix_world   : (4, 4) float64; mirrored, sheared and singular matrices are allowed.
    ray_traced     : ray traced by the artist; in hybrid mode only ray traced objects are seen by camera rays.
    moves          : it is likely to be elsewhere in the next frame: a hint, by which search trees are divided.
    """

    name: str
    mesh: int
    matrix_world: Float64
    surfaces: tuple[int, ...]
    ray_traced: bool = False
    visibility: Visibility = Visibility()
    moves: bool = False


@dataclass(frozen=True, eq=False)
class Sphere:
    """An analytic sphere: exact normals, no tessellation."""

    name: str
    center: tuple[float, float, float]
    radius: float
    surface: int
    ray_traced: bool = False
    visibility: Visibility = Visibility()


@dataclass(frozen=True, eq=False)
class Plane:
    """An analytic, unbounded plane through `point`; `normal` (any length) is its outer side."""

    name: str
    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    surface: int
    ray_traced: bool = False
    visibility: Visibility = Visibility()


# ------------------------------------------------------------------------------------------------ lights and world

# Every light has `receivers`, what it lights, and `blockers`, what casts shadows in its light: numbers that count the
# scene's instances, then its spheres, then its planes. None: all.


@dataclass(frozen=True, eq=False)
class PointLight:
    """Radiates `intensity` (W/sr, RGB) in all directions.

    range        : metres; EEVEE's window (1 - (d^2/range^2)^2)^2 fades the light, which ends there. inf = physical.
    radius       : metres, of the emitting ball; 0 = a point, with hard shadows.
    soft_falloff : a disk that faces the receiver, not a ball: EEVEE's factor d^2 / (d^2 + radius^2).
    diffuse, specular, transmission : weights of this light where it is scattered, mirrored, and seen through glass.
    receivers, blockers : numbers of the objects that it lights and that cast shadows in its light; None: all.
    """

    color_field: ClassVar[str] = "intensity"

    name: str
    position: tuple[float, float, float]
    intensity: RGB
    radius: float = 0.0
    range: float = float("inf")
    soft_falloff: bool = True
    cast_shadow: bool = True
    diffuse: float = 1.0
    specular: float = 1.0
    transmission: float = 1.0
    receivers: frozenset[int] | None = None
    blockers: frozenset[int] | None = None


@dataclass(frozen=True, eq=False)
class SpotLight(PointLight):
    """A point light within a cone.

    world_to_light : (3, 3) float64; takes (P - position) to light space, scale included; the cone opens along -Z.
    cos_cone       : cosine of half the cone's angle.
    blend          : 0 (hard rim) .. 1; EEVEE's smoothstep over (1 - cos_cone) blend.
    """

    world_to_light: Float64 = field(default_factory=lambda: np.eye(3))
    cos_cone: float = 0.7071067811865476
    blend: float = 0.15


@dataclass(frozen=True, eq=False)
class SunLight:
    """Parallel light: `irradiance` (W/m^2, RGB) on a plane facing it; `direction` (unit) points *to* the sun.

    angle : radians, the diameter of its disk in the sky; 0 = hard shadows.
    """

    color_field: ClassVar[str] = "irradiance"

    name: str
    direction: tuple[float, float, float]
    irradiance: RGB
    angle: float = 0.0
    cast_shadow: bool = True
    diffuse: float = 1.0
    specular: float = 1.0
    transmission: float = 1.0
    receivers: frozenset[int] | None = None
    blockers: frozenset[int] | None = None


@dataclass(frozen=True, eq=False)
class AreaLight:
    """A one-sided flat emitter of uniform `radiance` (RGB).

    axis_u, axis_v : half edges (RECTANGLE) or half axes (ELLIPSE), in metres.
    direction      : unit, the way it shines (its local -Z).
    """

    color_field: ClassVar[str] = "radiance"

    name: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    axis_u: tuple[float, float, float]
    axis_v: tuple[float, float, float]
    radiance: RGB
    shape: Literal["RECTANGLE", "ELLIPSE"] = "RECTANGLE"
    range: float = float("inf")
    cast_shadow: bool = True
    diffuse: float = 1.0
    specular: float = 1.0
    transmission: float = 1.0
    receivers: frozenset[int] | None = None
    blockers: frozenset[int] | None = None


Light = PointLight | SpotLight | SunLight | AreaLight
"""Each has `name`, `cast_shadow`, `diffuse`, `specular`, `transmission`, `receivers`, `blockers` with the meanings that
`PointLight` gives them, and `color_field`, the name of the field that says how strong it is."""


@dataclass(frozen=True, eq=False)
class WorldSun:
    """What of the world is brighter than `threshold` (its largest channel) lights as one sun does, as in EEVEE.

    angle    : radians, the diameter that this sun is given, for soft shadows and highlights.
    strength : what its light is multiplied by.
    """

    threshold: float
    angle: float = 0.0
    cast_shadow: bool = True
    strength: float = 1.0


@dataclass(frozen=True, eq=False)
class World:
    """What a ray that leaves the scene sees: `radiance`, times the environment image if there is one.

    radiance    : or an `Expression` of the direction (attribute "generated"), without an environment image.
    environment : equirectangular, as Blender lays it out (centre +X, u = 0.25 is +Y, v up).
    rotation    : (3, 3) float64, world direction -> direction for the look-up.
    backdrop    : what camera rays see instead, and rays that passed straight through all; it gives no light.
    sun         : what is too bright becomes a light, and all but the backdrop is without it; None: nothing does.
    limit       : all but the backdrop is no brighter (largest channel), nor is its diffuse light. EEVEE's *Clamping*.
    dering      : how its diffuse light is kept from going below 0, as EEVEE of Blender 4.5 does, by the "AXES", or as
                  5's, by the "LENGTH".
    """

    radiance: Color = BLACK
    environment: Texture | None = None
    rotation: Float64 = field(default_factory=lambda: np.eye(3))
    backdrop: World | None = None
    sun: WorldSun | None = None
    limit: float = float("inf")
    dering: Literal["AXES", "LENGTH"] = "LENGTH"


# ------------------------------------------------------------------------------------------------ the whole


@dataclass(frozen=True, eq=False)
class Raster:
    """What the rasteriser has drawn of the same frame, over the camera's window: everything but the ray traced objects.

    pixels : (height, width, 4) float32, scene-linear, associated alpha. Alpha is 1 exactly where a pixel and what its
             filter reaches show nothing that is held out (and, over a transparent film, no sky).
    depth  : (height, width) float32, metres along the view axis, not filtered: of one place in each pixel, the same in
             all. NO_DEPTH where there is only sky. Held-out objects have depth, blended materials have none.
    albedo : (height, width, 3) float32, its diffuse colour, black where held out; None: no light will be added to it.
    """

    pixels: Float32
    depth: Float32
    albedo: Float32 | None = None


@dataclass(frozen=True)
class Arriving:
    """What becomes of light where it arrives at a surface; what is no radiance is left alone: emission, the backdrop.

    indirect       : what comes from the world, and by reflected and refracted rays, is multiplied by this, each time.
    direct_limit   : what a surface sends on of all lights together is no brighter (largest channel), the hue kept; nor
                     is the image of one in a mirror.
    indirect_limit : nor is what one surface sends into a reflected or refracted ray (for the world: `World.limit`).

    EEVEE's *Light Strength > Indirect* and *Clamping > Surface Direct, Surface Indirect*.
    """

    indirect: float = 1.0
    direct_limit: float = float("inf")
    indirect_limit: float = float("inf")


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
    arriving: Arriving = Arriving()
    raster: Raster | None = None

    @property
    def names(self) -> list[str]:
        """Of all objects: instances, then spheres, then planes."""
        return [*(i.name for i in self.instances), *(s.name for s in self.spheres), *(p.name for p in self.planes)]


@dataclass(frozen=True)
class Settings:
    """How to trace.

    samples       : camera rays for each pixel; 1 = one ray, not filtered (as EEVEE's one sample).
    max_depth     : number of bounces after the camera ray; 0 = local shading only.
    cutoff        : throughput that each camera sample may lose to rays that are not followed because they would bring
                    little, the smallest first; 0 = follow all. What is lost is in the residual. A sample becomes no
                    more than 256 rays, or 1 / cutoff if that is more: some of the lightest then stand for the others.
    filter_radius : of the pixel filter in pixels (Blender's Filter Size, EEVEE's Gaussian).
    see           : "RAY_TRACED": camera rays see `ray_traced` objects only (hybrid); "RASTER": everything else and the
                    world; "ALL": both.
    transparent   : where camera rays see the world, pixels where nothing is hit get alpha 0 (Film > Transparent).
    raster_shadows : work out, too, the shadows that ray traced objects cast on all others (`Film.shadow`).
    threads       : worker threads, 0 = all cores. chunk: camera rays a thread begins at once. Neither changes a pixel.
    processes     : as many forked processes do the work of the threads, where there are two or more, the system can
                    fork and the picture is worth it (`tracer.forks`). Changes no pixel.
    seed          : of the sampling pattern, together with the pixel's absolute position.
    shadow_samples : rays to each light that has a size, for each hit, spread over the light; 0 = hard shadows.
    rough_samples : rays for each reflection and refraction of a rough surface that a camera ray meets; further on they
                    take one. 0 = rough surfaces mirror sharply.
    occlusion_samples : rays for each hit that the world lights, to find how much of it is hidden; 0 = it is in sight.
    occlusion_distance : metres, > 0; what is further away hides nothing.
    adaptive      : 0 = all samples in every pixel; else pixels stop at 2 whose samples and neighbours agree in what
                    they met and, within this contrast, in colour, and at 8, 16, ... where, within it, the halves of
                    their samples and their neighbours' agree. What brings less than this share does not count.
    caustics      : "SIMPLE": shadows of what refracts are brighter in their middle, and darker at their rim, as if it
                    focused light (`scattering.simple_caustic`). "PHOTONS", with raster_shadows: such shadows are opaque
                    there, and `Film.caustic` has the light.
    photons       : how many.
    passes        : passes that are wanted: "depth", "normal", "samples"; "reflection" and "refraction", the light that
                    came by way of such a ray from the first surface; "raster_backed", the share of the light's way that
                    ended at raster-backed hits.
    """

    samples: int = 16
    max_depth: int = 8
    filter_radius: float = 1.5
    camera_sees: Literal["RAY_TRACED", "RASTER", "ALL"] = "RAY_TRACED"
    transparent: bool = False
    threads: int = 0
    processes: bool = False
    chunk: int = 7 << 13
    seed: int = 0
    cutoff: float = 0.0
    adaptive: float = 0.0
    passes: frozenset[str] = frozenset()
    shadow_samples: int = 1
    rough_samples: int = 0
    occlusion_samples: int = 0
    occlusion_distance: float = float("inf")
    raster_shadows: bool = False
    caustics: Literal["NONE", "SIMPLE", "PHOTONS"] = "NONE"
    photons: int = 1 << 19


@dataclass(frozen=True, eq=False)
class Film:
    """What was traced, over the camera's window.

    radiance   : (height, width, 3) float32, *not* multiplied by coverage: the mean over the samples that saw something.
    coverage   : (height, width) float32, the filtered share of samples that saw something (tracer's own mask).
    residual   : (height, width) float32, mean throughput of everything that was cut off (docs, Errors and plan).
    rays       : number of rays by kind: camera, reflected, refracted, shadow, dropped.
    time       : seconds by phase, wall and cpu: {"build": {"wall": s, "cpu": s}, ...}.
    invariants : counters that must be 0.
    skipped    : what the plan left out: [{"what", "why", "count"}].
    plan       : every pruning and whether it applied: [{"name", "class", "leaves_out", "when", "applies"}].
    sampling   : samples_mean, samples_max; rmse, the error to expect of them (None: unknown), and the slope that it
                 falls with; audit, of the pixels that adaptive sampling left alone.
    shadow     : (height, width, 3) float32, the light that the shadows of ray traced objects leave over on all that is
                 not ray traced, as a share of the light without them; exactly 1 where they take nothing. None: not
                 worked out.
    caustic    : (height, width, 3) float32, irradiance (W/m^2) of what is not ray traced by light that ray traced
                 objects bend or mirror there. None: not worked out.
    passes     : the passes that were asked for, by name: (height, width) or (height, width, 3) float32. Those of
                 light are means as radiance is.
    hits       : of secondary rays: "backed" by the raster, or "not_backed"; 0 both where nothing could be.
    ended      : what is missing because rays ended early: the share of the samples that lost more than `least` of their
                 light, what these lost in the mean, the mean radiance of what is around, what the cutoff took, and for
                 each object, by its number in `Scene.names`, the throughput that Max Bounces ended there.
    """

    radiance: Float32
    coverage: Float32
    residual: Float32
    rays: dict[str, int]
    time: dict[str, dict[str, float]]
    invariants: dict[str, int]
    skipped: list[dict[str, object]]
    sampling: dict[str, object] = field(default_factory=dict)
    plan: list[dict[str, object]] = field(default_factory=list)
    passes: dict[str, Float32] = field(default_factory=dict)
    shadow: Float32 | None = None
    caustic: Float32 | None = None
    hits: dict[str, int] = field(default_factory=dict)
    ended: dict[str, object] = field(default_factory=dict)
