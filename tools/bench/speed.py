# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays a second, against bare Embree, ray by ray and in packets, and over threads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from hybrid_addon import accelerated
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.integrator import tiles as integrator_tiles
from hybrid_addon.tracer.integrator.tile_obstacles import why_not
from hybrid_addon.tracer.kernels import loading
from hybrid_addon.tracer.prepare.compiled import CompiledScene

from . import files
from .bare import recorded
from .measure import Bench, Work, cores
from .table import Goal, Table

PICTURES_A_SECOND = 15.0  # asked of a machine with 16 cores
MANY_CORES = 16


def rays(bench: Bench) -> list[Table]:
    """The tracer alone on the thesis' scenes: pictures and rays a second, and the same rays in bare embreex calls."""
    size = (128, 96) if bench.quick else (1024, 768)
    n = cores()
    table = Table(
        f"The tracer alone, {size[0]}x{size[1]}, {n} threads",
        [
            "scene",
            "samples",
            "million rays",
            "build s",
            "trace s",
            "bare s",
            "trace / bare",
            "packets s",
            "trace / packets",
            "Mray/s a core",
            "fps",
        ],
        note="Every pixel traced. Bare: the very same rays in embreex calls from as many threads, answers dropped. "
        "Packets: the same in packets of eight. "
        "fps: pictures a second with the tree built anew for each, and in brackets with it kept.",
    )
    for name in files.THESIS:
        scene, settings = files.translated(name, size)
        for samples in (1, 4):
            if bench.is_over(table):
                return [table]
            bench.say(f"{name}, {samples} samples")
            how = replace(settings, samples=samples, camera_sees="ALL", threads=n)
            with recorded() as recording:
                trace(scene, replace(how, processes=False))
            candidates: dict[str, Work] = {
                "tracer": partial(files.traced, scene, how),
                "bare": partial(recording.replay, n),
            }
            if recording.has_packets:
                candidates["packets"] = partial(recording.replay, n, True)
            timings = bench.side_by_side(candidates)
            bare, build = timings["bare"].wall, timings["tracer"].phase("build")
            traced = timings["tracer"].phase("trace")
            rate = recording.rays / traced / n / 1e6
            fps = f"{1 / timings['tracer'].wall:.3g} ({1 / traced:.3g})"
            packets = timings["packets"].wall if "packets" in timings else None
            over = None if packets is None else traced / packets
            million = recording.rays / 1e6
            table.rows.append((name, samples, million, build, traced, bare, traced / bare, packets, over, rate, fps))
            if (name, samples) == ("intermediate", 4):
                table.goals.append(Goal("intermediate: tracer / the same rays in bare embreex", traced / bare, 2.5))
            if (name, samples) == ("simple", 1):
                table.goals.append(Goal("simple: million rays a second a core", rate, 2.0, at_least=True))
                if n >= MANY_CORES:
                    goal = Goal("simple: traced pictures a second", 1 / traced, PICTURES_A_SECOND, at_least=True)
                    table.goals.append(goal)
    return [table]


def threads(bench: Bench) -> list[Table]:
    """One thread to all of them (forked processes from two on): the tracer, and bare embreex calls, its limit."""
    size = (128, 96) if bench.quick else (1024, 768)
    steps = [t for t in (1, 2, 4, 8, 16, 32, 64, 128) if t < cores()] + [cores()]
    table = Table(
        f"Threads, or processes, {size[0]}x{size[1]}",
        ["scene", "samples", "threads", "trace s", "speed-up", "efficiency", "bare embreex s", "its speed-up"],
        note="Tracing only: the tree is built before. Bare: the rays of 1 sample.",
    )
    for name, samples in (("simple", 1 if cores() < MANY_CORES else 8), ("intermediate", 1)):
        if bench.is_over(table):
            break
        scene, settings = files.translated(name, size)
        how = replace(settings, samples=samples, camera_sees="ALL")
        bench.say(f"{name}, {samples} samples, threads {steps}")
        with recorded() as recording:
            trace(scene, replace(how, samples=1, processes=False))
        tracer = bench.side_by_side({str(t): partial(files.traced, scene, replace(how, threads=t)) for t in steps})
        bare = bench.side_by_side({str(t): partial(recording.replay, t) for t in steps})
        seconds = [timing.phase("trace") for timing in tracer.values()]
        for t, wall, other in zip(steps, seconds, bare.values(), strict=True):
            gain = seconds[0] / wall
            table.rows.append(
                (name, samples, t, wall, gain, f"{gain / t:.0%}", other.wall, bare["1"].wall / other.wall)
            )
        if steps[-1] >= 2:
            least = 1.8 if steps[-1] == 2 else 9 / 16 * steps[-1]
            what = f"{name}: speed-up from 1 to {steps[-1]} threads"
            table.goals.append(Goal(what, seconds[0] / seconds[-1], least, at_least=True))
    return [table]


def tiles(bench: Bench) -> list[Table]:
    """Tiles, which hold no lock, against waves on one thread; and their threads, 1 to all."""
    size = (128, 96) if bench.quick else (1024, 768)
    steps = [t for t in (1, 2, 4, 8, 16, 32, 64, 128) if t < cores()] + [cores()]
    loading.load()
    twins = accelerated.ALL[integrator_tiles.NAME]
    loading.load({integrator_tiles.NAME})
    if twins.compiled is None:
        raise RuntimeError("there is no kernel of tiles")
    table = Table(
        f"Tiles and waves, {size[0]}x{size[1]}, 1 sample",
        ["scene", "waves s", *(f"{t} threads s" for t in steps), "speed-up", "bare s", "1 thread / bare"],
        note="Tracing only, every pixel, seconds. Bare: the same rays in embreex calls on one thread.",
    )
    try:
        for name in files.THESIS:
            if bench.is_over(table):
                break
            scene, settings = files.translated(name, size)
            how = replace(settings, samples=1, camera_sees="ALL", processes=False)
            compiled = CompiledScene(scene, replace(how, threads=1))
            obstacle = why_not(compiled, compiled.seen_by_camera, [])
            if obstacle:
                table.rows.append((name, *["-"] * (len(steps) + 3), f"in waves: {obstacle}"))
                continue
            bench.say(f"{name}, threads {steps}")
            twins.kernel = None
            with recorded() as recording:
                trace(scene, replace(how, threads=1))

            def traced(kernel: Any, threads: int, scene: Any = scene, how: Any = how) -> dict[str, Any]:
                twins.kernel = kernel
                return files.traced(scene, replace(how, threads=threads))

            work: dict[str, Callable[[], Any]] = {
                "waves": partial(traced, None, 1),
                "bare": partial(recording.replay, 1),
            }
            work |= {str(t): partial(traced, twins.compiled, t) for t in steps}
            timings = bench.side_by_side(work)
            waves, *seconds = (timings[k].phase("trace") for k in ("waves", *map(str, steps)))
            bare = timings["bare"].wall
            table.rows.append((name, waves, *seconds, seconds[0] / seconds[-1], bare, seconds[0] / bare))
            if steps[-1] >= 2:
                least = 1.8 if steps[-1] == 2 else (9 if name == "intermediate" else 7) / 16 * steps[-1]
                what = f"{name}: tiles, speed-up from 1 to {steps[-1]} threads"
                table.goals.append(Goal(what, seconds[0] / seconds[-1], least, at_least=True))
    finally:
        twins.kernel = twins.compiled
    return [table]
