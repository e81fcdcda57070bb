# SPDX-License-Identifier: GPL-3.0-or-later
"""The Whitted ray tracer: `trace(scene, settings) -> Film`. Pure numpy; only `geometry.embree` talks to Embree.

Several pictures of one scene: `compiled = CompiledScene(scene, settings)` once, then `trace_compiled(compiled)`, or of
another camera `trace_compiled(compiled.seen_from(camera, settings))`. Of a scene that changes from frame to frame:
`cache = SceneCache()` once, then `trace(scene, settings, mask, cache=cache)`.
"""

from __future__ import annotations

from .core.cache import SceneCache
from .prepare.compiled import CompiledScene
from .render import Cancelled, trace, trace_compiled

__all__ = ["Cancelled", "CompiledScene", "SceneCache", "trace", "trace_compiled"]
