# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene holds, without rendering it: what would be traced (plan), what should be (advise), and why (explain)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from .. import memory
from ..scene import Raster, Scene, Settings
from .errors import HybridError, TooLarge, require_tracer
from .pipeline import evaluated, scene_setup, transmission
from .render import eevee_half
from .render.settings import body_warnings, public_settings, tracer_settings

if TYPE_CHECKING:
    from .sync import Translation
    from .sync.light import Falloff


NAMED = 5  # objects that one warning names


def plan(scene: bpy.types.Scene | None = None) -> dict[str, Any]:
    """What a render of this scene would trace and what it would leave out, with the reason for each. Traces nothing."""
    require_tracer()
    from ..tracer.prepare.footprint import expected, of_textures, require_memory
    from ..tracer.prepare.tables import describe

    scene = scene or bpy.context.scene
    translation = translated(scene)
    mode = scene_setup.effective_mode(scene)
    settings, (width, height) = tracer_settings(scene), full_size(scene)
    textures = of_textures(translation.scene)
    needed = {**expected(translation.scene, settings, width * height), "textures": sum(textures.values())}
    planned, refused = None, list[str]()
    try:
        if mode != "RASTER":
            require_memory(translation.scene, settings, width * height, None)
            planned = describe(_with_raster(scene, translation), settings)
    except memory.NotEnoughMemory as error:
        refused = [f"this scene cannot be rendered here: {error}"]
    return {
        "scene": scene.name,
        "mode": mode,
        "why": "" if mode == scene.hybrid.mode else "no object is ray traced",
        "ray_traced": [ob.name for ob in scene_setup.ray_traced_objects(scene)],
        "ray_traced_materials": [b_material.name for b_material in scene_setup.ray_traced_materials(scene)],
        "settings": public_settings(scene),
        "counts": dict(translation.counts),
        "skipped": [] if planned is None else list(planned.skipped),
        "prunings": [] if planned is None else planned.table(),
        "memory": {"expected": needed, "by_texture": textures, "free": memory.available()},
        "warnings": [*refused, *translation.warnings, *body_warnings(translation.scene)],
    }


def _with_raster(scene: bpy.types.Scene, translation: Translation) -> Scene:
    """The translated scene as a render has it: with a raster where one backs hits, here an empty one."""
    found = translation.scene
    if not scene_setup.needs_raster(scene) or eevee_half.unfit_to_back(scene):
        return found
    x0, y0, x1, y1 = found.camera.window
    nothing = np.zeros((), np.float32)
    shape = (y1 - y0, x1 - x0)
    return replace(found, raster=Raster(np.broadcast_to(nothing, (*shape, 4)), np.broadcast_to(nothing, shape)))


def advise(scene: bpy.types.Scene | None = None) -> dict[str, Any]:
    """Which objects of this scene need rays, why, how much of the picture they cover, and what rays would cost.

    Traces a coarse picture of about 20 000 pixels, and small ones as a render would; renders nothing, changes nothing.
    Keys: scene, objects (those that need rays, or are ray traced: see `report.advice.advice`), others (the same of all
    others in view), notes (what other settings would bring), shadows (seconds for the shadows of these objects on what
    EEVEE draws, 0 if they are not traced), build (seconds), basis (how the cost was estimated), warnings. Raises
    HybridError.
    """
    require_tracer()
    from ..report.advice import advice, is_worth, rough_note, shared_out
    from ..tracer.integrator.survey import survey

    scene = scene or bpy.context.scene
    translation = translated(scene)
    settings = tracer_settings(scene)
    blended = {m.name for m in bpy.data.materials if m.surface_render_method == "BLENDED"}
    with _in_one_line():
        found = survey(translation.scene, settings, frozenset(blended))
    ray_traced = {ob.name for ob in scene_setup.ray_traced_objects(scene)}
    width, height = full_size(scene)
    everything = advice(
        found, translation.owners, ray_traced,
        pixels=width * height, samples=settings.samples, threads=settings.threads or os.cpu_count() or 1,
        surfaces=[surface.name for surface in translation.scene.surfaces],
        materials=[b_material.name for b_material in scene_setup.ray_traced_materials(scene)],
    )  # fmt: skip
    notes, shadows, chosen = [rough_note(everything)], 0.0, [entry for entry in everything if is_worth(entry)]
    if chosen:
        choice, clear = _shadows(scene, chosen)
        with _in_one_line():
            seconds, shadows = _rehearsed(translation, settings, found.front, chosen, choice != "OFF" or clear)
        everything = shared_out(everything, seconds)
        if choice == "OFF":
            notes += [TRACED_SHADOWS.format(shadows)] if clear else []
            shadows = 0.0
    return {
        "scene": scene.name,
        "objects": [entry for entry in everything if is_worth(entry)],
        "others": [entry for entry in everything if not is_worth(entry)],
        "notes": [note for note in notes if note],
        "shadows": shadows,
        "build": found.build,
        "basis": f"an estimate for {width} x {height} with {settings.samples} samples, from small pictures traced here",
        "warnings": list(translation.warnings),
    }


TRACED_SHADOWS = "EEVEE draws the shadows of what is clear black: Traced Shadows let light through, about {:.2g} s"

REHEARSAL_SECONDS, LEAST_REHEARSAL, MOST_SAMPLES = 0.3, 500, 16
"""How long a rehearsal should take, by the survey's rays; pixels that it has at least; samples, at most."""


def _shadows(scene: bpy.types.Scene, chosen: list[dict[str, Any]]) -> tuple[str, bool]:
    """ON or OFF: whether a render traces the shadows of these on what EEVEE draws; whether any of them is clear."""
    objects = [ob for entry in chosen if (ob := scene.objects.get(entry["object"])) is not None]
    clear = transmission.transmit(scene, objects, scene_setup.ray_traced_materials(scene))
    choice = scene.hybrid.traced_shadows
    if scene.hybrid.mode != "HYBRID":
        return "OFF", False
    if choice == "AUTO":
        choice = "ON" if clear or scene.hybrid.caustics != "NONE" else "OFF"
    return choice, clear


def _rehearsed(
    translation: Translation, settings: Settings, front: np.ndarray, chosen: list[dict[str, Any]], shadows: bool
) -> tuple[float, float]:
    """Seconds that a render takes to trace these, and for their shadows: small pictures are traced as it traces.

    Two of them tell what a pixel costs, and what a picture costs beside. front: the survey's.
    """
    from ..tracer import trace
    from ..tracer.integrator.survey import coarse

    names, parts = {e["object"] for e in chosen if not e["materials"]}, {m for e in chosen for m in e["materials"]}
    ours, owners = translation.scene, translation.owners
    pairs = zip(ours.instances, owners, strict=False)  # spheres and planes, of which Blender has none, come after
    flagged = replace(
        ours,
        instances=tuple(replace(each, ray_traced=each.ray_traced or owner in names) for each, owner in pairs),
        surfaces=tuple(replace(s, ray_traced=s.ray_traced or s.name in parts) for s in ours.surfaces),
    )  # fmt: skip
    shown = np.append([owner in names | {e["object"] for e in chosen} for owner in owners], False)[front]
    pixels, samples = ours.camera.resolution[0] * ours.camera.resolution[1], min(settings.samples, MOST_SAMPLES)
    known = sum(entry["seconds"] for entry in chosen) * samples / settings.samples
    wanted = pixels * REHEARSAL_SECONDS / known if known > 0 else pixels
    size = min(max(wanted, LEAST_REHEARSAL), front.size, pixels)

    def take(size: float, shadows: bool) -> tuple[int, float]:
        camera = coarse(ours.camera, size)
        width, height = camera.resolution
        rows, columns = (np.arange(n) * m // n for n, m in zip((height, width), front.shape, strict=True))
        mask = None if settings.camera_sees == "ALL" else shown[np.ix_(rows, columns)].astype(np.float32)
        if shadows:  # alone
            mask = np.zeros((height, width), np.float32)
        small = replace(settings, samples=samples, raster_shadows=shadows, passes=frozenset(), fill=False)
        film = trace(replace(flagged, camera=camera), small, mask)
        return width * height, film.time["trace"]["wall"]

    def whole(shadows: bool) -> float:
        (few, short), (many, long) = take(size / 4, shadows), take(size, shadows)
        each = max(long - short, 0.25 * long) / max(many - few, 1)  # a clock that jumps must not make pixels free
        return max(long - each * many, 0.0) + each * pixels * settings.samples / samples

    return whole(False), whole(True) if shadows else 0.0


def explain(x: int, y: int, scene: bpy.types.Scene | None = None) -> str:
    """Why pixel (x, y) of the frame, (0, 0) at the bottom left, looks as it does: the ray tree of its centre, as text.

    Each line is a ray: its share of the pixel, what it met and where, what that brought, what was not followed. Raises
    HybridError.
    """
    return explained(x, y, scene or bpy.context.scene)


def explained(x: int, y: int, scene: bpy.types.Scene, say: Callable[[str], str] = str) -> str:
    """The same, in a language. say: puts the words of `report.pixel` into it."""
    require_tracer()
    from ..report.pixel import pixel_text
    from ..tracer import CompiledScene
    from ..tracer.integrator.explain import explain as tree
    from ..tracer.prepare.validate import validate

    width, height = full_size(scene)
    if not (0 <= x < width and 0 <= y < height):
        raise HybridError(f"pixel {x}, {y} lies outside the frame of {width} x {height}")
    ours, settings = translated(scene).scene, tracer_settings(scene)
    with _in_one_line():
        validate(ours, settings, None)
        compiled = CompiledScene(ours, settings)
    return pixel_text(ours, tree(compiled, x, y), x, y, say)


@contextmanager
def _in_one_line() -> Iterator[None]:
    """The tracer's errors as HybridError."""
    try:
        yield
    except HybridError:
        raise
    except ValueError as error:
        raise HybridError(str(error)) from error
    except MemoryError as error:
        raise TooLarge(str(error) or memory.REFUSED) from error


def translated(
    scene: bpy.types.Scene, size: tuple[int, int] | None = None, light_falloff: Falloff | None = None
) -> Translation:
    """The whole frame of a scene as it stands, without rendering it.

    size, light_falloff : others than the scene's.   Raises HybridError, UnsupportedError.
    """
    from ..tracer.materials.textures import sample_texture
    from .sync import translate

    width, height = size or full_size(scene)
    falloff = light_falloff or scene.hybrid.light_falloff

    def work(depsgraph: bpy.types.Depsgraph) -> Translation:
        window = (0, 0, width, height)
        return translate(depsgraph, scene, (width, height), window, light_falloff=falloff, sample=sample_texture)

    with _in_one_line():
        found, other = evaluated.look(scene, work), evaluated.differs(scene)
    if other:
        names = ", ".join(other[:NAMED]) + (f" and {len(other) - NAMED} more" if len(other) > NAMED else "")
        found = replace(found, warnings=(*found.warnings, f"seen as the viewport shows it, not as it renders: {names}"))
    return found


def full_size(scene: bpy.types.Scene) -> tuple[int, int]:
    """Width and height of a frame in pixels."""
    own = scene.render  # whole numbers throughout, as Blender: 100 * 0.29 is less than 29
    width, height = (n * own.resolution_percentage // 100 for n in (own.resolution_x, own.resolution_y))
    return max(1, width), max(1, height)
