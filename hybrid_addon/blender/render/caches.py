"""What the renders of a scene leave for its next one: one scene's at a time, until another file is loaded or Hybrid is
switched off."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..sync import MeshCache

if TYPE_CHECKING:
    from ...tracer import SceneCache


def _trees() -> SceneCache:
    from ...tracer import SceneCache  # a missing library must not keep Blender from loading the add-on

    return SceneCache()


@dataclass(eq=False)
class FrameCaches:
    """What the translator and what the tracer have left."""

    scene: str
    meshes: MeshCache = field(default_factory=MeshCache)
    trees: SceneCache = field(default_factory=_trees)

    def skipped(self) -> list[dict[str, Any]]:
        """What of it the frame in work could use, as a report says it."""
        counts = {"meshes": self.meshes.meshes, "images": self.meshes.images}
        return [{"what": w, "why": "kept from the last frame", "count": n} for w, n in counts.items() if n]


_last: FrameCaches | None = None


def of(scene: str) -> FrameCaches:
    """What the last render of this scene has left; that of any other is let go of."""
    global _last
    if _last is None or _last.scene != scene:
        _last = FrameCaches(scene)
    return _last


def forget() -> None:
    """Let go of everything."""
    global _last
    _last = None
