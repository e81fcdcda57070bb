# SPDX-License-Identifier: GPL-3.0-or-later
"""What is random is denoised, and nothing else changes by a bit."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from hybrid_addon.scene import AreaLight, Lens, Settings, Surface, World
from hybrid_addon.scene.film import NOTHING_RANDOM
from hybrid_addon.tracer import trace
from hybrid_addon.tracer.film import denoised as module
from hybrid_addon.tracer.film import denoiser
from hybrid_addon.tracer.film.shutter import OpenShutter
from hybrid_addon.tracer.prepare import footprint

WIDTH, HEIGHT = 48, 40
PLAIN = Settings(samples=4, camera_sees="ALL", rough_samples=1, threads=1)
CLEAN = replace(PLAIN, denoise=True)


@pytest.fixture(scope="module", autouse=True)
def library():
    """Open Image Denoise, from where Blender's module keeps it."""
    spec = find_spec("bpy")
    denoiser.look_in(Path(folder) / "lib" for folder in spec.submodule_search_locations)
    assert denoiser.library() is not None


@pytest.fixture(scope="module")
def plates(build):
    """A mirror on the left and rough metal on the right; both show bright and dark panels behind the camera."""
    left = build.quad([(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0)])
    right = build.quad([(0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0)])
    panels = [build.quad([(x, -9, 8), (x, 9, 8), (x + 1, 9, 8), (x + 1, -9, 8)]) for x in range(-6, 6, 2)]
    metal = Surface(layered=True, reflectivity=1.0, roughness=0.35)
    parts = [(left, build.mirror()), (right, metal), *((panel, build.emitter(1.0, 0.6, 0.2)) for panel in panels)]
    view = build.camera(eye=(0, 0, 4), size=(WIDTH, HEIGHT), half=0.22)
    return build.scene(*parts, camera=view, world=World(radiance=(0.1, 0.1, 0.2)))


@pytest.fixture(scope="module")
def reference(plates):
    return trace(plates, replace(PLAIN, samples=200))


@pytest.fixture(scope="module")
def shade(build):
    """A strip that hangs over a striped floor, below a lamp that has a size."""
    floor = build.quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)])
    stripes = [
        build.quad([(x, -4, 0.001), (x + 0.1, -4, 0.001), (x + 0.1, 4, 0.001), (x, 4, 0.001)]) for x in (-1.2, 0.5)
    ]
    strip = build.quad([(-0.4, -4, 1), (0.4, -4, 1), (0.4, 4, 1), (-0.4, 4, 1)])
    parts = [(floor, build.matte()), (strip, build.matte(), {"visibility": hidden()})]
    parts += [(stripe, build.matte((0.2, 0.5, 0.1))) for stripe in stripes]
    lamp = AreaLight("lamp", (0, 0, 3), direction=(0, 0, -1), axis_u=(0.5, 0, 0), axis_v=(0, 0.5, 0), radiance=(9,) * 3)
    view = build.camera(eye=(0, 0, 5), size=(WIDTH, HEIGHT), half=0.25)
    return build.scene(*parts, camera=view, lights=(lamp,))


def hidden():
    from hybrid_addon.scene import Visibility

    return Visibility(camera=False)


def rmse(film, other, pixels):
    return float(np.sqrt(np.mean(np.square(film.radiance[pixels] - other.radiance[pixels]))))


def test_noise_falls_and_what_is_not_finite_is_refused():
    noisy = np.random.default_rng(1).gamma(4.0, 0.25, (40, 56, 3)).astype(np.float32)
    with denoiser.Denoiser(threads=1) as work:
        clean = work(noisy)
        assert clean.std() < 0.2 * noisy.std() and clean.mean() == pytest.approx(1, abs=0.05)
        assert np.array_equal(clean, work(noisy, None))
        assert work(noisy[:0]).shape == (0, 56, 3)
        assert work.version.startswith("2.")
        noisy[3, 4, 1] = np.nan
        with pytest.raises(denoiser.DenoiserError, match="not finite"):
            work(noisy)


def test_the_caller_can_stop_it():
    def check():
        raise KeyboardInterrupt

    with denoiser.Denoiser(1, check) as work, pytest.raises(KeyboardInterrupt):
        work(np.ones((64, 64, 3), np.float32))


def test_every_system_has_names_and_a_folder_is_searched(tmp_path, monkeypatch):
    assert set(denoiser.NAMES) == {"Linux", "Windows", "Darwin"}
    (tmp_path / "OpenImageDenoise.dll").write_bytes(b"none")
    monkeypatch.setattr(denoiser, "_folders", [tmp_path])
    tried = []
    monkeypatch.setattr(denoiser, "_load", lambda file: tried.append(file))
    assert denoiser.library("Windows") is None
    assert tried == ["OpenImageDenoise.dll", str(tmp_path / "OpenImageDenoise.dll")]


def test_rough_light_of_a_quarter_of_the_samples_has_the_same_error_and_a_mirror_keeps_its_bits(plates, reference):
    plain, clean, more = (trace(plates, s) for s in (PLAIN, CLEAN, replace(PLAIN, samples=16)))
    left, right = np.s_[:, : WIDTH // 2 - 2], np.s_[:, WIDTH // 2 + 2 : -1]
    assert np.array_equal(clean.radiance[left], plain.radiance[left])
    assert rmse(clean, reference, right) < rmse(more, reference, right)
    assert clean.radiance[right].mean() == pytest.approx(reference.radiance[right].mean(), rel=0.03)
    assert not clean.passes and clean.denoising["why_not"] == ""
    assert clean.denoising["pixels"] == np.count_nonzero((clean.radiance != plain.radiance).any(axis=2))


def test_penumbras_are_denoised_and_lit_and_dark_places_keep_their_bits(shade):
    reference = trace(shade, replace(PLAIN, samples=100, shadow_samples=4))
    plain, clean, more = (trace(shade, s) for s in (PLAIN, CLEAN, replace(PLAIN, samples=16)))
    assert rmse(clean, reference, np.s_[:]) < rmse(more, reference, np.s_[:]) < 0.7 * rmse(plain, reference, np.s_[:])
    same = (clean.radiance == plain.radiance).all(axis=2)
    assert 0.2 < same.mean() < 0.9
    assert same[:, WIDTH // 2 - 1].all() and same[:, 0].all()  # below the strip; beside all


def test_the_parts_add_up(plates, shade, monkeypatch):
    """One sample is not filtered: then a denoiser that changes nothing leaves the picture as it was."""

    class Nothing:
        version = "0"

        def __init__(self, *_):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def __call__(self, color, *_):
            return color

    monkeypatch.setattr(module, "Denoiser", Nothing)
    lens = replace(plates, camera=replace(plates.camera, lens=Lens(0.1, 2.0)))
    for scene in (plates, shade, lens):
        for settings in (PLAIN, replace(PLAIN, occlusion_samples=1, occlusion_distance=2.0)):
            one = replace(settings, samples=1)
            assert np.allclose(
                trace(scene, replace(one, denoise=True)).radiance, trace(scene, one).radiance, rtol=1e-5, atol=1e-6
            )


def test_workers_strips_and_adaptive_sampling_change_nothing(plates, monkeypatch):
    whole = trace(plates, replace(CLEAN, adaptive=0.05, samples=16))
    monkeypatch.setattr(footprint, "DENOISED_STRIP", WIDTH * 12)
    cut = trace(plates, replace(CLEAN, adaptive=0.05, samples=16, threads=2, chunk=1 << 8))
    assert np.array_equal(whole.radiance, cut.radiance)


def test_only_the_mask_is_denoised_and_what_lies_beyond_does_not_darken_its_edge(plates):
    mask = np.zeros((HEIGHT, WIDTH), np.float32)
    mask[10:30, WIDTH // 2 + 4 :] = 1
    part, whole = (trace(plates, replace(CLEAN, camera_sees="RAY_TRACED"), m) for m in (mask, np.ones_like(mask)))
    assert (part.radiance[mask == 0] == 0).all()
    edge = np.s_[10:30, WIDTH // 2 + 4]
    assert part.radiance[edge].mean() == pytest.approx(whole.radiance[edge].mean(), rel=0.05)


def test_moments_are_denoised_together(plates, reference):
    shutter = OpenShutter()
    for first in (0, 2):
        film = trace(plates, replace(CLEAN, samples=2, first=first, fill=False))
        assert "drawn" in film.passes and not film.denoising
        shutter.add(film, 1)
    plain = shutter.result(None, False)
    clean = module.denoised(plain)
    right = np.s_[:, WIDTH // 2 + 2 : -1]
    assert rmse(clean, reference, right) < 0.5 * rmse(plain, reference, right)


def test_a_lens_leaves_what_is_sharp(plates):
    near = replace(plates, camera=replace(plates.camera, lens=Lens(0.05, 4.0)))
    plain, clean = trace(near, PLAIN), trace(near, CLEAN)
    left = np.s_[:, 4 : WIDTH // 2 - 2]
    assert np.array_equal(clean.radiance[left], plain.radiance[left])
    far = replace(plates, camera=replace(plates.camera, lens=Lens(0.05, 2.0)))
    assert not np.array_equal(trace(far, CLEAN).radiance[left], trace(far, PLAIN).radiance[left])


def test_where_nothing_is_random_or_nothing_is_found_the_picture_is_the_same(plates, monkeypatch):
    smooth = replace(plates, surfaces=tuple(replace(s, roughness=0.0) for s in plates.surfaces))
    found = trace(smooth, CLEAN)
    assert found.denoising == {"pixels": 0, "why_not": NOTHING_RANDOM}
    assert np.array_equal(found.radiance, trace(smooth, PLAIN).radiance)
    monkeypatch.setattr(denoiser, "_loaded", [None])
    found = trace(plates, CLEAN)
    assert "not found" in found.denoising["why_not"] and not found.passes
    assert np.array_equal(found.radiance, trace(plates, PLAIN).radiance)


def test_soft_shadows_on_the_raster_are_denoised_too(shade):
    parts = tuple(replace(i, ray_traced=n == 1) for n, i in enumerate(shade.instances))
    scene, caught = replace(shade, instances=parts), replace(PLAIN, raster_shadows=True, camera_sees="RAY_TRACED")
    nothing = np.zeros((HEIGHT, WIDTH), np.float32)
    right, plain, more, clean = (
        trace(scene, replace(caught, **settings), nothing).shadow
        for settings in ({"samples": 100}, {}, {"samples": 16}, {"denoise": True})
    )
    error = [float(np.sqrt(np.mean(np.square(shadow - right)))) for shadow in (plain, more, clean)]
    assert error[2] < error[1] < error[0]
    same = (clean == plain).all(axis=2)
    assert same[:, WIDTH // 2 - 1].all() and same[:, 0].all() and not same.all()
