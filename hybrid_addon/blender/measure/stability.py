# SPDX-License-Identifier: GPL-3.0-or-later
"""The stability table from Blender: its own cases (cameras, instances, edits), and writing the page and the JSON.

The cases need no EEVEE: they go through the depsgraph and the translator into the tracer. Each builds a scene of its
own beside the open file and removes it again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...measure.stability import CASES, Case, Measured, Theme, page, run, to_json
from ...measure.stability.build import shoot
from ...measure.stability.compare import films_differ, largest
from ...scene import Film
from ...tracer.materials.textures import sample_texture
from .. import files
from ..errors import HybridError
from ..render import engine
from ..sync import translate
from ..sync.camera import view_plane

THEME = Theme("Through Blender: cameras, instances, edits")
SIZE = (48, 36)
COLLECTIONS = ("objects", "meshes", "cameras", "lights", "collections", "actions", "materials", "worlds")


def all_cases() -> tuple[Case, ...]:
    """The tracer's own cases, then Blender's."""
    return (*CASES, *THEME.cases)


def choose(names: Sequence[str]) -> list[Case]:
    """The cases of these names or themes, in the order of the table; all of them for no names."""
    cases = all_cases()
    known = {case.name for case in cases} | {case.theme for case in cases}
    for name in names:
        if name not in known:
            close = get_close_matches(name, sorted(known), n=1)
            raise HybridError(f"no case '{name}'" + (f"; did you mean '{close[0]}'?" if close else ""))
    return [case for case in cases if not names or case.name in names or case.theme in names]


def write(folder: Path, names: Sequence[str], say: Callable[[str], None]) -> int:
    """Run the cases, write stability.json and stability.html into the folder; returns how many did not pass."""
    results = []
    for case, result in run(choose(names)):
        say(page.line(case, result))
        results.append((case, result))
    known = engine.versions()
    versions = {
        "blender": known["blender"],
        "embree": known["embree"],
        "python": ".".join(map(str, sys.version_info[:3])),
        "numpy": np.__version__,
    }
    table = to_json(results, versions)
    html = page.render(results, versions)
    with files.atomic(folder / "stability.json") as data, files.atomic(folder / "stability.html") as text:
        Path(data).write_text(json.dumps(table, indent=1, allow_nan=False), encoding="utf-8")
        Path(text).write_text(html, encoding="utf-8")
    say(f"{page.summary(results)} in {table['seconds']:.0f} s: {folder / 'stability.html'}")
    return len(results) - int(table["passed"])


# ------------------------------------------------------------------------------------------------ a scene to play in


@contextmanager
def playground() -> Iterator[bpy.types.Scene]:
    """A new scene with a camera and a lamp; it and all that was made for it are removed afterwards."""
    before = {name: set(getattr(bpy.data, name)) for name in COLLECTIONS}
    b_scene = bpy.data.scenes.new("Hybrid Stability")
    try:
        b_scene.world = bpy.data.worlds.new("Hybrid Stability")
        b_lens = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        b_lens.matrix_world = Matrix.Translation((0, 0, 8))
        b_lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
        b_lamp.data.energy, b_lamp.location = 1000, (2, -3, 5)
        for b_object in (b_lens, b_lamp):
            b_scene.collection.objects.link(b_object)
        b_scene.camera = b_lens
        yield b_scene
    finally:
        bpy.data.scenes.remove(b_scene)
        for name, kept in before.items():
            b_made = set(getattr(bpy.data, name)) - kept
            bpy.data.batch_remove(list(b_made))


def seen(b_scene: bpy.types.Scene) -> Film:
    """The scene as it is now, translated afresh and traced."""
    b_layer = b_scene.view_layers[0]
    b_layer.update()
    scene = translate(b_layer.depsgraph, b_scene, SIZE, (0, 0, *SIZE), sample=sample_texture).scene
    return shoot(scene, max_depth=3)


def add_mesh(
    b_scene: bpy.types.Scene, matrix: Matrix | None = None, b_collection: bpy.types.Collection | None = None
) -> bpy.types.Object:
    """A lopsided tetrahedron; a matrix is applied to its vertices, turned right side out if it mirrors."""
    corners = [(-1, -1, -1), (1, 1, -1), (1, -1, 1), (-1, 2, 1)]
    faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]
    if matrix is not None:
        corners = [tuple(matrix @ Matrix.Translation(c).translation) for c in corners]
        faces = [f[::-1] for f in faces] if matrix.determinant() < 0 else faces
    b_mesh = bpy.data.meshes.new("Thing")
    b_mesh.from_pydata(corners, [], faces)
    b_object = bpy.data.objects.new("Thing", b_mesh)
    (b_collection or b_scene.collection).objects.link(b_object)
    return b_object


# ------------------------------------------------------------------------------------------------ the cases


@THEME.case(
    31,
    "sensor-fit-and-shift",
    "100 random cameras: projection, lens, sensor, fit, shift up to 10, pixel aspect, frame",
    "the frame of Object.calc_matrix_camera",
    1e-4,
    "of the frame",
)
def _() -> Measured:
    rng, worst = np.random.default_rng(31), 0.0
    with playground() as b_scene:
        b_lens = b_scene.camera.data
        for _ in range(100):
            b_lens.type = str(rng.choice(["PERSP", "ORTHO"]))
            b_lens.sensor_fit = str(rng.choice(["AUTO", "HORIZONTAL", "VERTICAL"]))
            b_lens.sensor_width, b_lens.sensor_height = rng.uniform(5, 80, 2)
            b_lens.lens, b_lens.ortho_scale = rng.uniform(10, 200), 10.0 ** rng.uniform(-4, 6)
            b_lens.shift_x, b_lens.shift_y = rng.uniform(-10, 10, 2)
            aspect = float(rng.uniform(1, 1.5)), float(rng.uniform(1, 1.5))
            # In a long strip of a frame a shift is of so many frame heights that Blender's float32 fails.
            width, height = (int(n) for n in rng.integers(2000, 4000, 2))
            b_scene.view_layers[0].update()
            b_depsgraph = b_scene.view_layers[0].depsgraph
            m = np.array(
                b_scene.camera.calc_matrix_camera(b_depsgraph, x=width, y=height, scale_x=aspect[0], scale_y=aspect[1])
            )
            left, right, bottom, top = view_plane(b_lens, (width, height), aspect)
            size = np.array([right - left, top - bottom])
            column = 2 if b_lens.type == "PERSP" else 3
            sign = 1 if b_lens.type == "PERSP" else -1
            middle = np.array([left + right, bottom + top]) / size * sign
            worst = max(worst, largest(np.array([m[0, 0], m[1, 1]]) * size / 2, 1.0))
            worst = max(worst, largest(m[:2, column] - middle, 0) / 2)
    return Measured(worst, "Blender's own matrix is float32")


@THEME.case(
    24,
    "nested-mirrored-collections",
    "a collection instance, scale -1, in another one, turned and moved",
    "the realised mesh",
    2e-6,
)
def _() -> Measured:
    outer = Matrix.Translation((0.5, -0.25, 0.25)) @ Matrix.Rotation(0.7, 4, (1.0, 2.0, 3.0))
    inner = Matrix.Diagonal((-0.75, 0.5, 1.0, 1.0))
    with playground() as b_scene:
        b_first, b_second = (bpy.data.collections.new(f"Level {n}") for n in (1, 2))
        add_mesh(b_scene, None, b_first)
        for b_shown, b_home, matrix in ((b_first, b_second, inner), (b_second, b_scene.collection, outer)):
            b_empty = bpy.data.objects.new("Instancer", None)
            b_empty.instance_type, b_empty.instance_collection = "COLLECTION", b_shown
            b_empty.matrix_world = matrix
            b_home.objects.link(b_empty)
        instanced = seen(b_scene)
    with playground() as b_scene:
        add_mesh(b_scene, outer @ inner)
        realised = seen(b_scene)
    if not instanced.radiance.any():
        return Measured(np.nan, "nothing was seen")
    return Measured(films_differ(instanced, realised), "", instanced.radiance)


@THEME.case(35, "frame-and-back", "frames 1, 2, 1 of a moving object", "frame 1 both times, bit by bit", 0)
def _() -> Measured:
    with playground() as b_scene:
        b_thing = add_mesh(b_scene)
        for frame, x in ((1, 0.0), (2, 1.0)):
            b_thing.location.x = x
            b_thing.keyframe_insert("location", frame=frame)
        pictures = []
        for frame in (1, 2, 1):
            b_scene.frame_set(frame)
            pictures.append(seen(b_scene))
        b_scene.frame_set(2)
        b_thing.animation_data_clear()
        b_thing.location.x = 1.0
        static = seen(b_scene)  # frame 2 without an animation
    if films_differ(pictures[0], pictures[1]) == 0:
        return Measured(np.nan, "the motion does not show")
    return Measured(max(films_differ(pictures[0], pictures[2]), films_differ(pictures[1], static)))


@THEME.case(
    35,
    "edit-hide-show",
    "move, hide, show, flag and unflag, delete and make again, in one scene",
    "as in a new scene, bit by bit",
    0,
)
def _() -> Measured:
    with playground() as b_scene:
        b_thing = add_mesh(b_scene)
        first = seen(b_scene)
        b_thing.location.y = 0.5
        moved = seen(b_scene)
        b_thing.location.y, b_thing.hide_render, b_thing.hide_viewport = 0.0, True, True
        hidden = seen(b_scene)
        b_thing.hide_render = b_thing.hide_viewport = False
        shown = seen(b_scene)
        b_thing.hybrid.ray_traced, b_thing.hybrid.surface, b_thing.hybrid.reflectivity = True, "CUSTOM", 1.0
        ray_traced = seen(b_scene)
        b_thing.hybrid.ray_traced, b_thing.hybrid.surface = False, "MATERIAL"
        unflagged = seen(b_scene)
        bpy.data.objects.remove(b_thing)
        add_mesh(b_scene)
        again = seen(b_scene)
    if np.max(hidden.radiance) == np.max(first.radiance) or not all(
        films_differ(f, first) for f in (moved, ray_traced)
    ):
        return Measured(np.nan, "an edit does not show")
    return Measured(max(films_differ(film, first) for film in (shown, unflagged, again)))


@THEME.case(
    23,
    "odd-scales",
    "objects with scale 0 on one, two and three axes, 1e-3 : 1e3, and -1",
    "finite pixels",
    0,
    "pixels",
)
def _() -> Measured:
    wrong = 0
    for scale in ((1, 1, 0), (1, 0, 0), (0, 0, 0), (1e-3, 1, 1e3), (-1, -1, -1)):
        with playground() as b_scene:
            add_mesh(b_scene).scale = scale
            film = seen(b_scene)
            wrong += int(np.count_nonzero(~np.isfinite(film.radiance).all(-1)))
    return Measured(wrong, "five scales")
