# SPDX-License-Identifier: GPL-3.0-or-later
"""How the cost grows: with the mask, triangles, lights, bounces and pixels. The tracer alone."""

from __future__ import annotations

import tracemalloc
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from hybrid_addon.scene import Float32, Scene, Settings
from hybrid_addon.tracer import SceneCache

from . import files, models
from .measure import Bench
from .table import Goal, Table

SHARES = (0.0, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0)
LATER = "a later frame"
TILE = 8  # pixels; tiles are far larger than what one pixel's neighbours share


def coverage(bench: Bench) -> list[Table]:
    """Cost against the share of the picture that is masked: tiles of the washroom, everything in it ray traced."""
    size = (256, 192) if bench.quick else (1024, 768)
    scene, settings = files.translated("complex", size)
    scene, settings = files.all_flagged(scene), replace(settings, samples=4)
    masks = {f"{share:.0%}": tiles(size, share) for share in SHARES}
    candidates = {name: partial(files.traced, scene, settings, mask) for name, mask in masks.items()}
    everything = replace(settings, camera_sees="ALL")
    candidates["full"] = partial(files.traced, scene, everything)
    candidates[f"10%, {LATER}"] = partial(files.traced, scene, settings, masks["10%"], SceneCache())
    candidates[f"full, {LATER}"] = partial(files.traced, scene, everything, None, SceneCache())
    timings = bench.side_by_side(candidates)
    table = Table(
        f"Mask coverage: complex, {size[0]}x{size[1]}, 4 samples",
        ["masked", "s", "of full tracing", "of it build s", "million rays"],
        note="Full: no mask, camera rays see everything. Building the tree, which no mask shrinks, is counted. A later "
        "frame finds what has not changed, here tree, tables and the world's light.",
    )
    shares = {}
    for name, timing in timings.items():
        full = timings[f"full, {LATER}" if name.endswith(LATER) else "full"]
        rays, shares[name] = count(timing.last["rays"]) / 1e6, timing.wall / full.wall
        table.rows.append((name, timing.wall, f"{shares[name]:.1%}", timing.phase("build"), rays))
    table.goals.append(Goal("10 % coverage / full tracing", shares["10%"], 0.15))
    table.goals.append(Goal(f"10 % coverage / full tracing, {LATER}", shares[f"10%, {LATER}"], 0.15))
    table.goals.append(Goal("empty mask / full tracing", shares["0%"], 0.01))
    return [table]


def tiles(size: tuple[int, int], share: float) -> Float32:
    """A mask (h, w) of whole tiles, spread evenly over the picture."""
    across, up = -(-size[0] // TILE), -(-size[1] // TILE)
    order = np.random.default_rng(1).permutation(across * up)
    chosen = np.zeros(across * up, np.float32)
    chosen[order[: round(share * len(order))]] = 1
    return np.kron(chosen.reshape(up, across), np.ones((TILE, TILE), np.float32))[: size[1], : size[0]]


def triangles(bench: Bench) -> list[Table]:
    """1e3 to 1e6 triangles: a ball of glass on a floor."""
    size = (128, 96) if bench.quick else (512, 384)
    levels = (3, 5) if bench.quick else (3, 4, 5, 6, 7, 8)
    how = Settings(samples=4, camera_sees="ALL")
    work = {f"{20 * 4**n + 2:,}": models.ball_on_floor(n, models.GLASS, size) for n in levels}
    return [_grow(bench, "Triangles: a glass ball", size, "triangles", {name: (s, how) for name, s in work.items()})]


def lights(bench: Bench) -> list[Table]:
    """1 to 32 point lights with shadows: a matte ball on a floor."""
    size = (128, 96) if bench.quick else (512, 384)
    how = Settings(samples=4, camera_sees="ALL")
    numbers = (1, 4) if bench.quick else (1, 2, 4, 8, 16, 32)
    work = {str(n): (models.ball_on_floor(5, models.MATTE, size, n), how) for n in numbers}
    return [_grow(bench, "Lights: a matte ball", size, "lights", work)]


def depth(bench: Bench) -> list[Table]:
    """0 to 64 bounces between two mirrors, nothing cut off."""
    size = (128, 96) if bench.quick else (512, 384)
    depths = (0, 4) if bench.quick else (0, 1, 2, 4, 8, 16, 32, 64)
    scene = models.between_mirrors(size)
    work = {str(n): (scene, Settings(samples=1, camera_sees="ALL", max_depth=n)) for n in depths}
    return [_grow(bench, "Bounces: two mirrors face to face", size, "bounces", work)]


def resolution(bench: Bench) -> list[Table]:
    """From 160x120 to 2560x1920: time and memory."""
    sizes = ((80, 60), (160, 120)) if bench.quick else ((160, 120), (320, 240), (640, 480), (1280, 960), (2560, 1920))
    how = Settings(samples=4, camera_sees="ALL")
    work = {f"{s[0]}x{s[1]}": (models.ball_on_floor(5, models.GLASS, s), how) for s in sizes}
    table = _grow(bench, "Resolution: a glass ball", None, "pixels", work)
    table.columns = [*table.columns, "arrays MB"]
    table.rows = [(*row, _peak(*work[str(row[0])])) for row in table.rows]
    table.note = "Arrays: the most memory that arrays took while tracing, the film included, without Embree's tree."
    return [table]


def _grow(
    bench: Bench, title: str, size: tuple[int, int] | None, what: str, work: Mapping[str, tuple[Scene, Settings]]
) -> Table:
    """One row for each scene: seconds in all and to build, rays, nanoseconds a ray."""
    table = Table(
        f"{title}, {size[0]}x{size[1]}" if size else title,
        [what, "s", "relative", "of it build s", "million rays", "ns a ray"],
        note="ns a ray: tracing alone, all threads at work.",
    )
    timings = bench.side_by_side({name: partial(files.traced, *one) for name, one in work.items()})
    first = next(iter(timings.values())).wall
    for name, timing in timings.items():
        rays, ns = count(timing.last["rays"]), timing.phase("trace") * 1e9
        table.rows.append((name, timing.wall, timing.wall / first, timing.phase("build"), rays / 1e6, ns / rays))
    return table


def _peak(scene: Scene, settings: Settings) -> float:
    """Megabytes that Python and numpy held at most."""
    tracemalloc.start()
    try:
        files.traced(scene, settings)
        return tracemalloc.get_traced_memory()[1] / (1 << 20)
    finally:
        tracemalloc.stop()


def count(rays: Mapping[str, int]) -> int:
    """All rays that were traced."""
    return sum(number for kind, number in rays.items() if kind != "dropped")
