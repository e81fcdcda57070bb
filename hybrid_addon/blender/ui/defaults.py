# SPDX-License-Identifier: GPL-3.0-or-later
"""Which defaults a scene's settings were made with: Blender saves only what has been set, not what is at its default.

`Scene.hybrid.version` says so. It is written when Hybrid is switched, and to every scene with settings of ours that is
saved. A scene with such settings and no version is from before there was one: what it never set is set as it was then.
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..pipeline.guard import guard

VERSION = 1

FIRST = {"adaptive": 0.0, "rough_samples": 0, "traced_shadows": "OFF", "preview_budget": 3.0}
"""Of version 0, where they were not as today's."""


def pin(scenes: Iterable[bpy.types.Scene]) -> None:
    """Keep the looks of scenes that were made with other defaults."""
    for scene in scenes:
        if not _is_ours(scene) or scene.hybrid.version:
            continue
        with guard():  # no callback of a property need do anything
            for name, value in FIRST.items():
                if not scene.hybrid.is_property_set(name):
                    setattr(scene.hybrid, name, value)
        scene.hybrid.version = VERSION


def stamp(*scenes: bpy.types.Scene) -> None:
    """Say of scenes that have settings of ours that they are of today."""
    for scene in scenes:
        if _is_ours(scene) and scene.hybrid.version != VERSION:
            scene.hybrid.version = VERSION


def _is_ours(scene: bpy.types.Scene) -> bool:
    """Whether it can be written to, and anything of ours has been set in it."""
    settings = scene.hybrid
    names = (
        p.identifier
        for p in settings.bl_rna.properties
        if p.identifier not in {"rna_type", "name", "version"} and not p.is_skip_save  # ticks hold nothing themselves
    )
    return scene.library is None and any(settings.is_property_set(name) for name in names)
