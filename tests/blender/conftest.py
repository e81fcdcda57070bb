"""Fixtures for tests that need the bpy module: the add-on registered once, a clean factory file for each test."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module")

import hybrid_addon  # noqa: E402


@pytest.fixture(scope="session", autouse=True)
def addon():
    hybrid_addon.register()
    yield hybrid_addon
    hybrid_addon.unregister()


@pytest.fixture
def scene(addon):
    """Blender's factory scene (cube, camera, light), tiny and quick to render."""
    bpy.ops.wm.read_factory_settings()
    return small(bpy.context.scene)


def small(scene, width=64, height=48, samples=1):
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.eevee.taa_render_samples = samples
    return scene
