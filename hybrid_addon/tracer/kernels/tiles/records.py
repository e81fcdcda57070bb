# SPDX-License-Identifier: GPL-3.0-or-later
"""What a tile is told of a scene: records of arrays, made once for each scene (`integrator/tile_records.py`).

All arrays lie row by row and are not written to. What a scene does not have is an array of no rows, never None: so the
types are the same for every scene, and nothing is compiled anew.
"""

from __future__ import annotations

from typing import NamedTuple

from ...core.vectors import Array


class Shapes(NamedTuple):
    """Of all primitives (np,), or triangles (nt,): see `geometry.flatten.Geometry`.

    normals, heights : no rows where nothing is smooth.   opaque : (np,) bool, ends a shadow ray.
    casts : (np,) bool, casts shadows.   identity : (np,) uint32 of `film.path_hash.Identities`, or no numbers.
    """

    facets: Array
    weights: Array
    extent: Array
    normals: Array
    heights: Array
    smooth: Array
    surface: Array
    object: Array
    ray_traced: Array
    opaque: Array
    casts: Array
    corners: Array
    identity: Array


class Trees(NamedTuple):
    """Embree's scenes: of what camera rays see first (FIRST), of what they see behind that (CAMERA), of what later rays
    see (LATER), of what casts shadows (SHADOW).

    address : (4, 2) uint64, of each a tree of all, or of what stands still, and one of what moves; 0: there is none.
    start   : (4, 2) int64, where in `ids` (all,) their triangles' numbers among all primitives begin; -1: these have
              the same numbers.
    """

    address: Array
    start: Array
    ids: Array


FIRST, CAMERA, LATER, SHADOW = range(4)


class Skins(NamedTuple):
    """Of the s surfaces: see `materials.surfaces.SurfaceTable` and `materials.tabulated.Tabulated`.

    values, more : (rows, c) float32, columns.   first, steps : (s,).   ior : (s,).   flags : (len(FLAGS), s) bool.
    images : (s, 9) int64, of base colour, emission and tint each the image (-1: none), where its coordinates begin in
    `Shapes.corners`, and what is made of it: 1 for the root of it within 0 .. 1.
    """

    values: Array
    more: Array
    first: Array
    steps: Array
    ior: Array
    flags: Array
    images: Array


FLAGS = (
    "emits", "shades_ambient", "shades_diffuse", "shades_specular", "reflects", "glossless", "transmits", "rough",
    "layered", "blurs", "refracts",
)  # fmt: skip
(
    EMITS, AMBIENT, DIFFUSE, SPECULAR, REFLECTS, GLOSSLESS, TRANSMITS, ROUGH, LAYERED, BLURS, REFRACTS,
) = range(len(FLAGS))  # fmt: skip


class Images(NamedTuple):
    """Of k images.

    address : (k,) uint64, of the first texel.   layout : (k, 5) int64: 0 of float32 and 1 of bytes, height, width,
    and how it goes on along u and v (`materials.textures.EXTENSIONS`).   mapping : (k, 6) float64, rows of
    `Texture.uv_transform`.   curves : (k, 256) float32, what bytes stand for.
    """

    address: Array
    layout: Array
    mapping: Array
    curves: Array


class World(NamedTuple):
    """Of the sky that lights, and of the one that cameras see.

    image : (2,) int64, its panorama, -1 for a uniform one.   factor : (2, 3), rotation : (2, 3, 3), limit : (2,).
    mean, linear : (3,) and (3, 3), or no rows: irradiance over pi.   blurred : (7, h, w, 4), what is not asked for 0,
    or no images.
    """

    image: Array
    factor: Array
    rotation: Array
    limit: Array
    mean: Array
    linear: Array
    blurred: Array


class Solids(NamedTuple):
    """Of closed bodies that transmit: see `media.nested.Media`. rank : (np,) int32, or no numbers.   ior :
    (count + 1,).   rows : (1,) int64."""

    rank: Array
    ior: Array
    rows: Array


class Lamps(NamedTuple):
    """Of l lights: kind : (l,) int64 of KINDS.   key : (l,) uint32.   flags : (l, 3) bool, of LAMP_FLAGS.
    numbers : (l, len(LAMP)) float64, of LAMP.   ltc : `shading.ltc`'s table."""

    kind: Array
    key: Array
    flags: Array
    numbers: Array
    ltc: Array


KINDS = "point", "spot", "sun", "area", "disk"
POINT, SPOT, SUN, AREA, DISK = range(len(KINDS))
CASTS, SOFT, FALLOFF = range(3)
LAMP = {
    "place": 3, "color": 3, "diffuse": 1, "specular": 1, "radius": 1, "over_range2": 1, "rows": 9, "cos_cone": 1,
    "rim": 1, "axis": 3, "u": 3, "v": 3, "area": 1, "far2": 1, "half_size": 1, "lobe_radius": 1, "transmission": 1,
    "radiance": 3, "over_u": 3, "over_v": 3,
}  # fmt: skip
"""What there is of a light, in the order of the numbers, and how many each takes: see `CompiledLight.as_numbers`."""


def _starts(widths: dict[str, int]) -> list[int]:
    found, start = [], 0
    for width in widths.values():
        found.append(start)
        start += width
    return [*found, start]


(
    PLACE, COLOR, OF_DIFFUSE, OF_SPECULAR, RADIUS, OVER_RANGE2, SPOT_ROWS, CONE, RIM, AXIS, AXIS_U, AXIS_V, AREA_SIZE,
    FAR2, HALF_SIZE, LOBE_RADIUS, OF_TRANSMISSION, RADIANCE, OVER_U, OVER_V, LAMP_WIDTH,
) = _starts(LAMP)  # fmt: skip

VIEW = {
    "x": 3, "y": 3, "z": 3, "eye": 3, "view_plane": 4, "resolution": 2, "clip_start": 1, "clip_end": 1, "radius": 1,
    "perspective": 1,
}  # fmt: skip
"""What there is of a camera, in the order of the numbers."""
VIEW_X, VIEW_Y, VIEW_Z, EYE, PLANE, RESOLUTION, CLIP_START, CLIP_END, BALL, PERSPECTIVE, CAMERA_WIDTH = _starts(VIEW)

SEES = "ALL", "RAY_TRACED", "RASTER"
SEES_ALL, SEES_RAY_TRACED, SEES_RASTER = range(len(SEES))


class Rules(NamedTuple):
    """Settings and the plan. whole : (len(WHOLE),) int64; ROUGH: as how many a camera ray's rough hit counts, 0 where
    nothing is rough.   real : (len(REAL),) float64.   camera : of CAMERA.
    released : see `film.error_budget.ErrorBudget`."""

    whole: Array
    real: Array
    camera: Array
    released: Array


WHOLE = (
    "camera_sees", "transparent", "world", "ambient", "diffuse", "specular", "shadows", "faint", "emission", "local",
    "draws", "shadow_samples", "unlit", "light_limit", "limit", "max_depth",
    "reflection", "refraction", "most_rays", "most_branches", "tints", "objects", "rough",
)  # fmt: skip
(
    CAMERA_SEES, TRANSPARENT, HAS_WORLD, HAS_AMBIENT, HAS_DIFFUSE, HAS_SPECULAR, HAS_SHADOWS, FAINT, EMISSION, LOCAL,
    DRAWS, SHADOW_SAMPLES, UNLIT, LIGHT_LIMIT, LIMIT, MAX_DEPTH,
    HAS_REFLECTION, HAS_REFRACTION, MOST_RAYS, MOST_BRANCHES, TINTS, OBJECTS, ROUGH,
) = range(len(WHOLE))  # fmt: skip
REAL = "indirect", "direct_limit", "indirect_limit", "importance"
INDIRECT, DIRECT_LIMIT, INDIRECT_LIMIT, IMPORTANCE = range(len(REAL))

COUNTERS = (
    "camera", "dropped", "self_hits", "barycentrics_out_of_range", "shadow", "shadow_not_needed", "shadow_cut",
    "any_hit", "weightless", "cut", "lost_to_cutoff", "crowded", "lost_media", "reflected", "refracted", "straight",
    "lamps", "shadow_steps", "shadow_crossings_exhausted",
)  # fmt: skip
"""Names of what tiles count, in their order (`core.stats.Stats`)."""
(
    N_CAMERA,
    N_DROPPED,
    N_SELF_HITS,
    N_GRAZING,
    N_SHADOW,
    N_NOT_NEEDED,
    N_CUT,
    N_ANY_HIT,
    N_WEIGHTLESS,
    N_ENDED,
    N_LOST,
    N_CROWDED,
    N_LOST_MEDIA,
    N_REFLECTED,
    N_REFRACTED,
    N_STRAIGHT,
    N_LAMPS,
    N_STEPS,
    N_EXHAUSTED,
) = range(len(COUNTERS))


class Scene(NamedTuple):
    """All of it. lamps : lights that can light anything.   met : those that rays can meet."""

    shapes: Shapes
    trees: Trees
    skins: Skins
    images: Images
    world: World
    solids: Solids
    lamps: Lamps
    met: Lamps
    rules: Rules


class Buffer(NamedTuple):
    """What the samples of some pixels add up to, and what may be taken from each: see `film.samples.SampleBuffer`.

    radiance : (3, n) float64.   seen, residual, stood_for : (n,) float64.   spent, unlit, scratch, followed : (n,)
    int64.   generation : (n,) int16.   signature : (n,) uint32, or no numbers: nobody asks.
    """

    radiance: Array
    seen: Array
    residual: Array
    stood_for: Array
    spent: Array
    unlit: Array
    scratch: Array
    followed: Array
    generation: Array
    signature: Array


class Pixels(NamedTuple):
    """The pixels (m,) of a pass: their keys (uint32), x and y (int64), and where in each the samples (count,) fall."""

    key: Array
    x: Array
    y: Array
    u: Array
    v: Array
