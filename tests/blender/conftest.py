# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for tests that need the bpy module: the add-on registered once, a clean factory file for each test."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="needs the bpy module")

import hybrid_addon  # noqa: E402
from tests.blender.kit import small_worlds  # noqa: E402


@pytest.fixture(scope="session", autouse=True)
def addon():
    bpy.app.handlers.load_factory_startup_post.append(small_worlds)
    hybrid_addon.register()
    yield hybrid_addon
    hybrid_addon.unregister()
    bpy.app.handlers.load_factory_startup_post.remove(small_worlds)


@pytest.fixture
def scene(addon):
    """Blender's factory scene (cube, camera, light)."""
    bpy.ops.wm.read_factory_settings()
    return bpy.context.scene
