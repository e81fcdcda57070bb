# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory of what the pipeline changed in the user's scene, kept in the file itself so that it survives a save."""

from __future__ import annotations

import contextlib
import json
from typing import Any

import bpy

OF_RENDER = frozenset({"use_single_layer", "compositor_device"})
"""Plain values of `Scene.render`."""


class Restore:
    """First values win: `remember` keeps what the user had, however often the pipeline runs."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene
        self._values = _read(scene.hybrid.restore) if scene.hybrid.restore else {}

    def remember(self, name: str, value: Any) -> None:
        """Keep the user's value unless one is already kept. value: anything JSON can hold."""
        self._values.setdefault(name, value)

    def get(self, name: str, default: Any = None) -> Any:
        """The user's value, or the default."""
        return self._values.get(name, default)

    def forget(self, *names: str) -> None:
        """Let what the pipeline made of these stand."""
        for name in names:
            self._values.pop(name, None)

    def save(self) -> None:
        """Write to the scene, if anything changed."""
        text = json.dumps(self._values, sort_keys=True)
        if self._scene.hybrid.restore != text:
            self._scene.hybrid.restore = text

    def clear(self) -> None:
        """Put the settings back that are plain values of the scene, and forget everything."""
        for name in self._values.keys() & OF_RENDER:
            with contextlib.suppress(TypeError):  # not a value that it can have: somebody else wrote it
                setattr(self._scene.render, name, self._values[name])
        self._values = {}
        self._scene.hybrid.property_unset("restore")


def _read(text: str) -> dict[str, Any]:
    """What an earlier session wrote, or somebody else: a file is untrusted, and what is no memory of ours is none."""
    try:
        values = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return values if isinstance(values, dict) else {}
