# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole pictures: kernels change no bit of them, in this process, in its threads, and in processes that it forks."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest

from hybrid_addon import accelerated
from hybrid_addon.scene import PointLight, Settings, SunLight, World
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.parallel import forks
from hybrid_addon.tracer.sampling import tiles

HOW = Settings(samples=4, camera_sees="ALL", threads=1, adaptive=0.05, cutoff=1 / 255, chunk=2048, processes=False)


@pytest.fixture(scope="module")
def scene(build):
    """Glass, a rough mirror and a floor under two lights, seen from within the world's middle distance."""
    floor = build.quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)])
    lights = PointLight("lamp", (3, 2, 6), (400, 400, 300), radius=0.5), SunLight("sun", (0.3, 0.2, -1), (1, 1, 1))
    rough = build.mirror(0.8, roughness=0.3)
    return build.scene(
        (build.icosphere(3, smooth=True), build.glass()), (build.box((1.2, -1, -1), (2, 0, 1)), rough),
        (floor, build.matte()), camera=build.camera((0, -6, 3), up=(0, 0, 1), size=(80, 64)), lights=lights,
        world=World((0.4, 0.5, 0.8)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def by_numpy(scene, loaded):
    return trace(scene, HOW)


def same(film, other) -> None:
    for name in ("radiance", "coverage", "residual"):
        np.testing.assert_array_equal(getattr(film, name), getattr(other, name))
    assert film.rays == other.rays


@pytest.mark.parametrize("threads", [1, 3])
def test_kernels_change_no_bit_of_a_picture(kernels, scene, by_numpy, threads: int) -> None:
    same(trace(scene, replace(HOW, threads=threads)), by_numpy)
    assert not accelerated.failed()


@pytest.mark.skipif(not forks.AVAILABLE, reason="this system does not fork")
def test_forked_processes_draw_with_kernels(kernels, scene, by_numpy, monkeypatch) -> None:
    monkeypatch.setattr(tiles, "WORTH_IT", 0)
    twins, calls, own = (
        accelerated.ALL["tracer.geometry.aggregate.refine"],
        forks.shared_zeros((2,), np.int64),
        os.getpid(),
    )
    kernel = twins.kernel
    assert kernel is not None

    def counted(*args):
        calls[int(os.getpid() != own)] += 1
        return kernel(*args)

    monkeypatch.setattr(twins, "kernel", counted)
    same(trace(scene, replace(HOW, threads=2, processes=True)), by_numpy)
    assert calls[1] > 0
