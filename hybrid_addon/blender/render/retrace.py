# SPDX-License-Identifier: GPL-3.0-or-later
"""Trace again over the picture that EEVEE has drawn already: after a change of samples, bounces, reflectivity, IOR, ...

It is a render as any other, by Blender's own pipeline: a job with progress and Esc, the compositor, the render slot
that is chosen. Only, for its duration the compositor takes EEVEE's half from our engine, too, as its pass *Raster*, and
its Render Layers nodes are muted; a scene whose compositor asks for none of its own layers Blender does not draw.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ...scene import Instance, Scene, TriangleMesh
from .. import session
from ..errors import HybridError
from ..pipeline import nodes, scene_setup, transmission
from ..session import EeveeHalf, Half
from ..sync.cache import same
from ..view_layers import part, source_layers
from .snapshot import Snapshot

PASS = "Raster"


# ------------------------------------------------------------------------------------------------ the render tells


def begins(scene: bpy.types.Scene) -> None:
    """A render of this scene begins: remember what it looks like now."""
    own = session.of(scene.name)
    if not own.retracing and scene_setup.is_active(scene):
        own.eevee_halves = {}
        if bpy.app.background:
            scene.view_layers[0].update()  # its first update tells of everything
        own.snapshot = Snapshot(scene)


def hold(scene: bpy.types.Scene, window: tuple[int, int, int, int], half: Half) -> EeveeHalf | None:
    """Keep EEVEE's half, that has just been read. None: the render began without our hearing of it."""
    own = session.of(scene.name)
    if own.snapshot is None:
        return None
    shadows = scene_setup.traces_shadows(scene) if own.traces_shadows is None else own.traces_shadows
    held = own.eevee_halves[part(scene)] = EeveeHalf(window, half, scene.frame_current, shadows, own.snapshot)
    return held


def held(scene: bpy.types.Scene) -> EeveeHalf | None:
    """EEVEE's half, if the render that runs is a retrace."""
    own = session.of(scene.name)
    return own.eevee_halves.get(part(scene)) if own.retracing else None


def check_drawn(known: EeveeHalf, scene: Scene) -> None:
    """Raise HybridError if EEVEE would draw anything else now; the first time only remember what it drew."""
    meshes = [scene.meshes[instance.mesh] for instance in scene.instances]
    drawn = (_places(scene), meshes)
    if known.drawn is None:
        known.drawn = drawn
        return
    changed = [name for name, value in drawn[0].items() if known.drawn[0].get(name) != value]
    changed += [m.name for old, m in zip(known.drawn[1], meshes, strict=False) if not _same_shape(old, m)]
    if changed or len(known.drawn[0]) != len(drawn[0]):
        what = repr(changed[0]) if changed else "what is there"
        raise HybridError(f"{what} has changed since the last render: render with F12")


def _places(scene: Scene) -> dict[str, list[object]]:
    """The camera, the lights, and what is where, by names; as much as is seen by all."""
    camera = scene.camera
    view = (
        repr(camera.panorama), camera.matrix_world.tobytes(), camera.view_plane, camera.resolution, camera.window,
        camera.projection,
    )  # fmt: skip
    found: dict[str, list[object]] = {"the camera": [view]}
    for i in scene.instances:
        found.setdefault(i.name, []).append(
            (i.matrix_world.tobytes(), i.ray_traced, _traced_slots(scene, i), repr(i.visibility))
        )
    for body in scene.fog.bodies:
        found.setdefault(body.name, []).append((body.matrix_world.tobytes(), repr(body.medium)))
    for light in scene.lights:
        found.setdefault(light.name, []).append(repr(light))
    return found


def _traced_slots(scene: Scene, instance: Instance) -> list[int]:
    return [slot for slot, number in enumerate(instance.surfaces) if scene.surfaces[number].ray_traced]


def _same_shape(a: TriangleMesh, b: TriangleMesh) -> bool:
    """Whether two meshes look the same in one material; what their materials read of them depends on our values."""
    names = ("vertices", "triangles", "normals", "surface_slots")
    return a is b or all(same(getattr(a, name), getattr(b, name)) for name in names)


def touched(depsgraph: bpy.types.Depsgraph) -> None:
    """The dependency graph of a viewport has been updated."""
    if depsgraph.mode != "VIEWPORT":
        return
    held = [half.snapshot for own in session.everyone() for half in own.eevee_halves.values()]
    snapshots = {id(s): s for s in (*held, *(own.snapshot for own in session.everyone() if own.snapshot))}
    if not snapshots:
        return
    for b_update in depsgraph.updates:
        for snapshot in snapshots.values():
            snapshot.touch(b_update)


# ------------------------------------------------------------------------------------------------ doors


def why_not(scene: bpy.types.Scene, thorough: bool = False) -> str:
    """Why this scene's last render cannot be traced again, as one line for people; "" if it can.

    thorough: look at all that could have changed, not only at what Blender says has.
    """
    if not scene.hybrid.enabled or scene_setup.why_inactive(scene):
        return scene_setup.why_inactive(scene) or "switch Hybrid on and render first"
    if scene_setup.effective_mode(scene) != "HYBRID":
        return "only where chosen objects are traced, and there are some, there is a picture of EEVEE to trace over"
    halves = session.of(scene.name).eevee_halves
    known = next(iter(halves.values()), None)
    if known is None:
        return "there is no render to trace over: press F12 first"
    if known.frame != scene.frame_current:
        return f"the last render shows frame {known.frame}: go there, or press F12"
    changed = known.snapshot.reason(scene, thorough)
    if changed:
        return f"{changed} since the last render: press F12"
    missing = {
        "Traced Shadows has": known.shadows != _traces_shadows(scene, thorough),
        "Use EEVEE Pixels has": scene_setup.needs_raster(scene) and known.half.depth is None,
        "Caustics has": scene_setup.needs_albedo(scene) and known.half.albedo is None,
    }
    what = next((name for name, is_missing in missing.items() if is_missing), "")
    return f"{what} changed what EEVEE draws: press F12" if what else _other_layers(scene)


def _traces_shadows(scene: bpy.types.Scene, thorough: bool) -> bool:
    """`scene_setup.traces_shadows`; not thorough: what it was at Blender's last update."""
    if thorough:
        return scene_setup.traces_shadows(scene)
    key = ("shadows", scene.session_uid)
    return bool(transmission.until_changed(key, lambda: scene_setup.traces_shadows(scene)))


def _other_layers(scene: bpy.types.Scene) -> str:
    """Whether the user's compositor shows more of EEVEE than its picture."""
    tree, hybrid = nodes.compositor_tree(scene), [layer.name for layer in source_layers(scene)]
    for node in tree.nodes if tree is not None else ():
        if node.type == "CRYPTOMATTE_V2" and not node.mute:
            return "the compositor uses Cryptomatte, which EEVEE draws: press F12"
        if node in nodes.render_layers(tree, scene, None) and (node.layer not in hybrid or nodes.other_outputs(node)):
            return f"the compositor uses more of EEVEE than its picture, in node '{node.name}': press F12"
    return ""


def frame_of(scene: bpy.types.Scene) -> int | None:
    """The frame of its last render, if there is one to trace over."""
    known = next(iter(session.of(scene.name).eevee_halves.values()), None)
    return known.frame if known else None


def begin(scene: bpy.types.Scene) -> None:
    """Let the scene's next render be a retrace, until `end`. Raises HybridError with the reason if it cannot be."""
    reason = why_not(scene, thorough=True)
    if reason:
        raise HybridError(f"cannot retrace: {reason}")
    session.of(scene.name).retracing = True
    scene_setup.sync(scene)


def end(name: str) -> None:
    """The next render of the scene of this name is a whole one again."""
    own = session.of(name)
    own.retracing = False
    scene = bpy.data.scenes.get(name)
    if scene is not None:
        scene_setup.sync(scene)
        if own.error:
            own.eevee_halves = {}


@contextmanager
def retracing(scene: bpy.types.Scene) -> Iterator[None]:
    """`begin`, and `end` whatever happens."""
    begin(scene)
    try:
        yield
    finally:
        end(scene.name)


# ------------------------------------------------------------------------------------------------ with a window


def finished(name: str) -> None:
    """A retrace's job is over: put the compositor back as soon as Blender lets go of it."""

    def again() -> float | None:
        if bpy.app.is_job_running("RENDER"):
            return 0.05
        end(name)
        return None

    if session.of(name).retracing and not bpy.app.background:
        bpy.app.timers.register(again, first_interval=0.0)
