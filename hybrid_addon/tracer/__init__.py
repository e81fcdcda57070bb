"""The Whitted ray tracer: `trace(scene, settings) -> Film`. Pure numpy; only `accel` talks to Embree."""

from __future__ import annotations

from .render import Cancelled, trace

__all__ = ["Cancelled", "trace"]
