# SPDX-License-Identifier: GPL-3.0-or-later
"""Every threshold of the tracer: its name, its reason and its scale. None of them is a length: that would tie the
picture to the unit of the scene, and scaling a scene by a power of two must not change one bit."""

import numpy as np

FLOAT32_ULP = 2.0**-23
"""Spacing of float32 numbers just above 1: the relative unit of all rounding bounds below."""

ORIGIN_OFFSET = 5 * FLOAT32_ULP
"""A new ray starts this far off its surface, times the largest coordinate of the primitive or of the hit point.

Embree's own error in the plane of a triangle is about one ulp of its largest coordinate; 4 ulp (rounded away from the
surface) gave no self hit and no leak for scales 1e-4 .. 1e7. Rounding the origin to the *nearest* float32 costs at most
sqrt(3)/2 ulp, so 5 ulp rounded to nearest are never closer to the surface than that.
"""

SHADOW_REACH = 1 - 2.0**-20
"""A shadow ray stops this fraction of the way to its light: Embree counts a hit at exactly t_max."""

EMBREE_LIMIT = 1.0e18
"""Embree silently ignores vertices beyond 1.844e18: they are dropped here, where they are counted. So far
away ends fog, too, that ends nowhere: no fog times an infinite distance is a number."""

MAX_STRAIGHT_CROSSINGS = 256
"""A ray goes unbent through at most so many index-matched (IOR 1) surfaces; the rest goes to the residual."""

MOST_RAYS = 1 << 8
"""A sample becomes at most so many rays, or 1 / cutoff if that is more: rays worth less than the cutoff, evenly spread.

Between panes, in shells and half mirrors rays multiply, and no share of the light is small: 32 bounces would be 2^32
rays. Of ordinary glass a sample takes 10 to 100 (measured: 1.6 % of those in the sample scenes would take more).
"""

MOST_FIRST_CLOSURES, MOST_CLOSURES = 16, 4
"""Closures of a sum that a camera ray's hit answers with, and a later one's; of more some are drawn."""

RAYS_AHEAD = 8
"""Of the rays that a sample has left, one in so many are for its next bounce.

What is left then shrinks by an eighth a bounce at most, and lasts for the 32 of the default. Fewer at once would spare
rays for bounces that mostly do not come; with more the last ones would have to stand for too much (simulated: 12 panes,
standard deviation of a sample with 4, 8, 12: 0.3, 0.09, 0.07; but then already 130 rays in all could be too many).
"""

MAX_BRANCHES = 1 << 10
"""Without a cutoff at most so many rays of one sample are followed at once."""

LONGEST_WAVE = 1 << 17
"""A wave of more rays is followed in parts, some pixels after the others: 20 MB each."""

BUDGET_BITS = 40
BUDGET_UNIT = 2.0**-BUDGET_BITS
"""The cutoff's budget is counted in whole units of this share of a sample: sums of integers are exact in any order."""

LIGHT_BUDGET = 1 / 16
"""Share of the cutoff that a sample may lose by light that it does not ask for; the rest by rays."""

FAINT_LIGHT = 1 / 256
"""And of that, what one hit may lose. Most hits on glass and mirrors are this far from their highlights' peaks."""

MAX_HIDDEN_FACES = 256
"""A ray looks through at most so many back faces that are not there; the next one is."""

MAX_SHADOW_CROSSINGS = 64
"""A shadow ray crosses at most so many non-opaque surfaces; then it counts as blocked."""

LARGE_TRIANGLE = 256.0
"""An edge is too long near a ray traced object if it is so many times the object's diameter.

Embree's error in a triangle's plane is about an ulp of the distance to its corners: measured on a 2 mm ball 20 um above
a tilted ground, 20 km wide, every shadow ray of the ground missed it.
"""

GRADING = 2.0
"""Split towards an object: an edge stays whole if it is shorter than so many times its distance from the object."""

SMALLEST_EDGE = 2.0**-4
"""But no edge is split that is shorter than this share of its own largest coordinate.

The middle of an edge is rounded to float32: shorter parts would fold the plane by more than a millionth, which tangent
rays meet, and Embree's error over such an edge is already far less than the rounding of its ends.
"""

MAX_SMALL_OBJECTS = 64
"""Large triangles are split towards at most so many ray traced objects, the smallest."""

MAX_SPLITS = 1 << 18
"""Splitting ends at so many new triangles."""

MAX_PROBE_CROSSINGS = 256
"""To find the solids around the camera, a ray crosses at most so many of their surfaces."""

WELD = 32 * FLOAT32_ULP
"""Vertices of open edges that are no further apart than this share of their mesh's largest coordinate are one.

Importers, lathes and mirrors leave a few ulp between the two sides of a seam; what is modelled apart is further apart.
"""

MAX_MEDIA = 64
"""A ray is inside of at most so many solids at once; one more is not tracked, and counted. 4 bytes a ray for each that
may be there in fact."""

NEAR = 24 * FLOAT32_ULP
"""Surfaces of different parts are near one another if they come nearer than this share of the largest coordinate.

That is as far as an origin may be moved: ORIGIN_OFFSET, and on, past one surface or a few that are nearer.
"""

CLEAR_OF = 4 * FLOAT32_ULP
"""A new ray starts at least this far from near surfaces: Embree's error is about one ulp, and rounding the origin costs
another."""

PUSHES = 8
"""So often an origin is moved on at most; of more surfaces, each just behind the other, one may be lost."""

MOST_NEAR, MOST_ASKED = 1 << 22, 1 << 26
"""If more pairs of triangles come near one another, 64 MB of them, or so many had to be compared, some seconds, none is
looked at when rays hit them."""

RANK_BITS = 22
"""Of the 32 bits of a row of media those that tell the solid: 4 million. The others tell how often a ray is inside of
it: up to 511 times, where a body goes through itself or its parts overlap."""

FAINT = 2.0**-20
"""What transmits no more than this share of light is no solid: swelling it would show more than its light does."""

MAX_PILE = 1024
"""Among more transmitting solids than this it is not asked which of them touch."""

THIN_WALL = 16 * FLOAT32_ULP
"""A body whose mean thickness is less than this share of its largest coordinate is a thin wall.

A ray that enters starts ORIGIN_OFFSET inside: measured, back faces nearer than 8 ulp are lost.
"""

THIN_CLEARANCE = np.float32(8)
"""Rays leave a thin wall so many times further off than other surfaces: beyond both of its faces, 40 ulp > 16 + 5."""

SWELLING = 64 * FLOAT32_ULP
"""By how much a solid swells into one that it may touch, relative to the largest coordinate of both.

More than two origin offsets (10 ulp) even at a corner of a cube, where faces move by 1 / sqrt(3) of it.
"""

NEIGHBOUR_SWELLING = 8 * FLOAT32_ULP
"""A solid swells by this much more, relative to the largest coordinate of the other things that it touches."""

TOUCH_PAIRS = 1 << 22
"""So many pairs of a vertex and a plane are compared at once: 32 MB."""

MAX_SWELLING = 2.0**-10
"""But by no more than this share of its own diagonal."""

MAX_RETRACES = 12
"""A hit behind its own ray is a rounding error of Embree; the ray is advanced and traced again, at most so often."""

RETRACE_STEP = 8 * FLOAT32_ULP
"""First step past a spurious hit, relative to the largest coordinate of the origin; grows by RETRACE_GROWTH."""

RETRACE_GROWTH = 8.0

WIDE_LENS = 16.0
"""Camera rays keep a float64 direction if the frame reaches so far off the axis (a secant: 86 degrees).

There a float32 direction's error of 2^-25 is magnified by the square of the secant on the film.
"""

GRAZING_COSINE = 1.0e-2
"""Below this |cos| Embree's t and barycentrics lose digits (error 1e-7 / cos): there the hit is verified in float64."""

BARYCENTRIC_SLACK = 1.0e-3
"""A verified hit whose float64 barycentrics lie further outside its triangle than this is counted."""

MIN_OUTER_COSINE = 0.01
"""Least cosine of a reflected ray, or 0.9 of the viewing one if less (Cycles, ensure_valid_specular_reflection)."""

OUTER_COSINE_SHARE = 0.9

MIN_ROUGHNESS = 0.05
"""The highlight of a smoother surface would be narrower than a pixel: sparks, different in each sample."""

LEAST_LAMP = 1.0e-4
"""In a highlight a lamp has at least this radius, as a share of its distance: a twentieth of the narrowest lobe's."""

LTC_FADE = 0.1
"""Sine of the angle over which EEVEE fades the highlight of a lamp that sinks below the horizon."""

TRACED_ROUGHNESS = 0.25
"""A dielectric's or coat's reflection is followed by a ray below this roughness; above, the world's blurred image."""

COSINES = 8 * 31 + 1
"""Steps of cosine at which layered surfaces are worked out; every 8th is one of the table of albedos (layers)."""

MIRROR_ROUGHNESS = 0.04
"""A surface that is no rougher is a mirror: its lobe is a tenth of a degree wide. Its rays meet lamps; what is rougher
shows them in its highlight, which at this roughness is as sharp."""

FROSTED_ROUGHNESS = 2 * MIRROR_ROUGHNESS
"""Rougher glass shows lamps in a highlight where light leaves it. Refraction turns a ray by less than reflection does,
at normal incidence on glass by a quarter: what is smoother is near enough to clear for rays to meet the lamps."""

MICROFACET_TRIES = 4
"""So often a microfacet is drawn: of roughness 0.5 one in 10 reflections is caught by another, of 1 nearly half."""

BUMP_STEP = 1.0e-3
"""A height is differentiated over this share of the ray's length: about a pixel."""

STEEPEST_FACET = 0.02
"""Cosine between a displaced facet and the undisplaced normal, below which heights are not followed down the facet."""

SPOT_BLEND_FLOOR = 1.0e-8
"""EEVEE's guard for a spot without blend: max(1e-8, (1 - cos) blend); dimensionless."""

REACH_MARGIN = 2.0**-16
"""A light is out of reach only if it is by this share of the coordinates: 128 ulp, more than its own rounding."""

NEAR_MARGIN = 2.0**-16
"""By this share of the coordinates the box around where rays start is larger: 128 ulp, more than their rounding."""

FLAT = 2.0**-20
"""A matrix flattens if it leaves no more than this share of the box that its columns would make at right angles."""

FAR_AREA_RATIO = 64.0
"""An area light further away than so many half diagonals is a point to 2e-4; its edge sum would cancel in float32."""

LEAST_COSINE = 1.0e-6
"""Guards a division: where a cosine is not above 0 the quotient is not used."""

LEAST_RADIUS = 1.0e-30
"""Guards a division: so near to the middle of a disk of radius 1 all directions are the same place."""

NEAR_BALL = 1.0e-4
"""A point nearer to a ball light than this share of its squared distance sees it as from there."""

FILTER_SIGMA = 0.284
"""EEVEE's Gaussian pixel filter: standard deviation over radius (eevee_film.cc)."""

MAX_TEXTURE_COORDINATE = 2.0**31
"""Beyond this a texture coordinate says nothing about a texel: (0, 0) is read, and integers do not overflow."""

FIRST_SAMPLES = 2
"""Adaptive sampling looks at so many samples of every pixel, and of its neighbours, before it decides on the others."""

SECOND_LOOK = 8
"""And at so many of a pixel, and at each doubling from there, before it decides on the rest: the halves of fewer agree
too often by chance (measured: looking at 4, too, doubles the error that is left)."""

AUDIT_SHARE = 0.01
"""This share of the pixels that adaptive sampling leaves alone is sampled in full, to see what was missed,"""

AUDIT_PIXELS = 500
"""or so many of them if that is more: none wrong among 500 says, with 95 % confidence, at most 0.6 % wrong."""

AUDIT_AT_MOST = 0.05
"""But no larger share than this: checking a small picture must not cost more than rendering it."""

SAMPLING_SLOPE = -0.75
"""Error of a mean over n samples falls like n^-0.75: stratified samples of a pixel with edges (Mitchell 1996)."""

HALVES_TO_ERROR = 0.5**0.5 / (4 * (2 - 0.5**0.5))
"""Squared error of a mean over the squared difference of its halves' means: 0.137.

Halves whose error variance is v and correlation c differ by 2 v (1 - c) and have a mean of variance v (1 + c) / 2. With
the slope -0.75 the mean has v 2^-1.5, so c = 2^-0.5 - 1. (For random samples c = 0, and the factor is 1/4.)
"""

ENDED = 1 / 8
"""A sample is dark if so much of its light was cut off: an eighth darker is seen beside its neighbours."""

COARSEST = 8
"""A picture against a deadline begins with every 8th pixel across and up: 1/64 of the work of one sample."""

FILL_SAMPLES = (8, 56)
"""Extra camera rays for a masked pixel in which no sample met a ray traced object; more where none of these did."""

FAILED_PIXEL = (1.0, 0.0, 1.0)
"""The colour, distinct pink, of a pixel whose computation did not give finite numbers."""

MISS = np.int32(-1)
"""Primitive id of a ray that hits nothing."""

SURVEY_PIXELS = 20000
"""A survey's picture has about so many pixels: what is smaller than a pixel of it covers less than 0.005 %."""

SURVEY_CUTOFF = 1 / 255
"""A survey follows no rays that could not change an 8 bit picture."""

SAME_PLACE = 0.05
"""A point that a mirror shows counts as on screen if the picture shows a place this near, as a share of its depth: more
than the coarse pixels' footprint on a slope, less than the distance between things that hide one another."""

SIMPLE_CAUSTIC_FROM = 0.01
"""The simple caustic leaves out what hardly refracts: an IOR above 1 by no more (as in the original system)."""

CASTER_BALLS = 8
"""Where shadows on the raster may lie is told by so many balls around what casts them; each costs time a pixel."""

MATTE_HIGHLIGHT = 0.02
"""A surface looks the same from all sides if its highlight's peak adds no more than this to a white diffuser under the
same light: F0 / (4 alpha^2), the GGX lobe at its centre. A plastic (F0 0.04) is matte from roughness 0.84."""

BACKED_DEPTH = 1.0e-3
"""A hit is what the raster shows if their depths agree to this share, after the surface's slope: far more than a depth
buffer rounds, far less than things that hide one another are apart."""

BACKED_ALPHA = 0.5
"""A pixel of the raster of which less than this is not held out is not asked: its depth is likely that of the rest."""

BACKED_OFFSET = 0.5
"""EEVEE's depth is that of one place in each pixel, so far from its centre at most, in pixels across and up."""

BACKED_SLOPE = 0.05
"""A surface whose depth changes by more than this share over BACKED_OFFSET is too oblique for the raster to show."""

FILTER_SPILL = 1.0
"""The pixel filter carries colour over an edge to pixels nearer than its radius less this, in pixels, but to those that
touch it in any case."""

NO_DEPTH = 1e10
"""In a depth pass: nothing there. What EEVEE and Cycles write."""

MOST_STRETCH = 12.0
"""An instance is flattened if the norms of its matrix and of the inverse multiply to more: about a stretch by 8 in one
direction. Embree inverts matrices in float32, with an error that grows with this number (measured: at 4, rays from
surfaces met these as seldom as flattened ones; at 50 and more 7 times as often)."""

MAX_KEPT_TRIANGLES = 4_000_000
"""A scene with more leaves nothing for the next frame: what is kept takes about 500 bytes each, so 2 GB at most."""

BUILD_SECONDS = 1.0e-6
"""What a search tree costs to build for each triangle; measured, Embree 4.4, on one core."""

QUERY_SECONDS = 0.2e-6
"""What a ray costs that has a second tree to ask; measured likewise."""

RAYS_PER_SAMPLE = 4
"""Of a sample of a pixel, those that may hit anything, in the middle of the sample scenes."""

STEADY_SCENE = 500
"""Where ray traced objects move, the centre of coordinates follows them in steps of about their size, so that what
stands still keeps its coordinates from frame to frame: in scenes no larger than this many times their size. In larger
ones the steps would cost digits where shadows and contacts of small objects need them."""

FOG_FLATNESS = 1e-5
"""A body flatter than this share of its size holds no fog: its two sides lie within an offset of each other."""

MAX_FOG_CROSSINGS = 64
"""Surfaces of bodies of fog that a ray crosses; behind them it meets no more."""
