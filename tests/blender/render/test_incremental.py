# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene, frame after frame: a render that keeps what has not changed looks like one from a fresh start."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hybrid_addon.blender import session
from hybrid_addon.blender.api import disable, mark, render
from hybrid_addon.blender.sync import MeshCache, translate
from hybrid_addon.blender.sync.cache import MAX_BYTES, same
from hybrid_addon.scene import Expression

pytestmark = pytest.mark.blender


@pytest.fixture
def still_life(scene, tmp_path):
    """A glass cube that moves, a subdivided ball whose shape is keyed, a floor with an image; 32 x 24, traced."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 32, 24, 100
    scene.hybrid.mode, scene.hybrid.samples = "FULL", 2
    cube = bpy.data.objects["Cube"]
    mark(cube, opacity=0.2, ior=1.4)
    for frame in (1, 4):
        cube.location.x = 0.4 * frame
        cube.keyframe_insert("location", frame=frame)
    bpy.ops.mesh.primitive_uv_sphere_add(location=(-2, 0, 0))
    ball = bpy.context.object
    ball.name = "Ball"
    cast = ball.modifiers.new("Cast", "CAST")
    for frame in (1, 2, 4):
        cast.factor = 0.0 if frame < 3 else 0.7
        cast.keyframe_insert("factor", frame=frame)
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -1))
    bpy.context.object.name = "Floor"
    paint(tmp_path / "paint.png", 0.2)
    material = bpy.data.materials.new("Paint")
    material.use_nodes = True
    image = material.node_tree.nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.load(str(tmp_path / "paint.png"))
    shader = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.links.new(shader.inputs["Base Color"], image.outputs["Color"])
    bpy.context.object.data.materials.append(material)
    session.forget()
    yield scene
    session.forget()


def paint(path, red):
    picture = bpy.data.images.new("paint", 4, 4)
    picture.pixels.foreach_set(np.tile(np.array([red, 0.5, 0.1, 1], np.float32), 16))
    picture.filepath_raw, picture.file_format = str(path), "PNG"
    picture.save()
    bpy.data.images.remove(picture)


def kept(result):
    """What the report says was kept, by what it is."""
    return {e["what"]: e["count"] for e in result.report["skipped"] if "last frame" in str(e["why"])}


def both(scene, frame=None):
    """The frame after all before it, which must be the one of a fresh start."""
    incremental, own = render(scene, frame=frame), session.of(scene.name)
    left, own.caches = own.caches, None
    fresh = render(scene, frame=frame)
    own.caches = left
    assert not kept(fresh)
    np.testing.assert_array_equal(incremental.image, fresh.image)
    assert incremental.report["rays"] == fresh.report["rays"]
    return incremental


def test_an_animation_translates_and_builds_only_what_changes(still_life):
    first = both(still_life, 1)
    assert not kept(first)
    second = both(still_life, 2)  # the cube moves, the modifier rests
    assert kept(second)["meshes"] == 3 and kept(second)["images"] == 1
    assert kept(second)["triangles prepared"] == second.report["triangles"] - 12
    assert next(row for row in second.report["plan"] if row["name"] == "unchanged")["applies"]
    assert kept(both(still_life, 4))["meshes"] == 2  # the modifier has changed the ball
    assert kept(both(still_life, 2))["meshes"] == 2  # backwards
    assert not np.array_equal(first.image, second.image)


def change_material(_scene):
    bpy.data.materials["Paint"].node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0


def reload_texture(_scene):
    b_image = bpy.data.images["paint.png"]
    paint(bpy.path.abspath(b_image.filepath), 0.9)
    b_image.reload()


def pack_texture(_scene):
    bpy.data.images["paint.png"].pack()


def paint_texture(_scene):
    """In Blender, as with a brush: in no file, packed or not."""
    b_image = bpy.data.images["paint.png"]
    b_image.pixels[:4] = (0.0, 1.0, 1.0, 1.0)
    b_image.update()


def change_colour_space(_scene):
    """What Blender has of the picture stays as it is; what it means does not."""
    bpy.data.images["paint.png"].colorspace_settings.name = "Non-Color"


def flag_on(_scene):
    mark(bpy.data.objects["Ball"], reflectivity=0.7)


def flag_off(_scene):
    bpy.data.objects["Ball"].hybrid.ray_traced = False


def edit_mesh(_scene):
    bpy.data.objects["Floor"].data.vertices[0].co.z += 0.5
    bpy.data.objects["Floor"].data.update()


def hide_collection(scene):
    collection, ball = bpy.data.collections.new("Extra"), bpy.data.objects["Ball"]
    scene.collection.children.link(collection)
    for other in list(ball.users_collection):
        other.objects.unlink(ball)
    collection.objects.link(ball)
    collection.hide_render = True


def delete(_scene):
    bpy.data.objects.remove(bpy.data.objects["Torus"])


def add(_scene):
    bpy.ops.mesh.primitive_torus_add(location=(0, 2, 0))


def move(_scene):
    bpy.data.objects["Floor"].location.z -= 0.25


CHANGES = (
    *(change_material, reload_texture, pack_texture, paint_texture, change_colour_space, flag_on, flag_off, edit_mesh),
    *(move, add, hide_collection, delete),
)


def test_every_edit_is_seen(still_life):
    """One after the other; each changes the picture (a flag alone does not in mode Full), and finds the rest."""
    before = both(still_life, 1)
    for change in CHANGES:
        change(still_life)
        after = both(still_life, 1)
        assert change in (flag_off, pack_texture) or not np.array_equal(before.image, after.image), change.__name__
        assert kept(after).get("meshes", 0) >= 1, change.__name__
        before = after


def test_a_flag_on_and_off_again_leaves_the_picture_as_it_was(still_life):
    before = both(still_life, 1)
    settings = bpy.data.objects["Ball"].hybrid
    settings.ray_traced = True
    both(still_life, 1)
    settings.ray_traced = False
    np.testing.assert_array_equal(both(still_life, 1).image, before.image)


def test_what_is_kept_is_let_go_of(still_life):
    render(still_life)
    assert session.of(still_life.name).caches.meshes._meshes[1]
    disable(still_life)
    assert session.of(still_life.name).caches is None
    render(still_life)
    bpy.ops.wm.read_factory_settings()
    assert not session.everyone()


@pytest.mark.parametrize("change", [pack_texture, paint_texture])
def test_a_picture_that_lives_in_blender_is_kept_until_it_changes(still_life, change):
    change(still_life)
    assert "images" not in kept(both(still_life, 1))
    assert kept(both(still_life, 2))["images"] == 1
    paint_texture(still_life)
    bpy.data.images["paint.png"].pixels[4:8] = (1.0, 0.0, 1.0, 1.0)
    assert "images" not in kept(both(still_life, 3))


def test_what_is_kept_of_meshes_and_images_is_bounded(still_life):
    left = MeshCache()
    left.keep_image("large", np.broadcast_to(np.float32(0), (MAX_BYTES // 4 + 1,)))
    left.end()
    left.begin()
    assert left.image("large") is None


def test_a_preview_learns_what_moves(still_life):
    def moving():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        scene = translate(depsgraph, still_life, (8, 8), (0, 0, 8, 8), kept=left).scene
        return {instance.name for instance in scene.instances if instance.moves}

    left = MeshCache(learns=True)
    assert moving() == {"Cube", "Ball"}  # they have keyframes
    bpy.data.objects["Floor"].location.z -= 0.25
    assert moving() == {"Cube", "Ball", "Floor"} == moving()


def test_what_expressions_share_is_compared_once():
    """40 nodes, each read twice by the next one: 2 ** 40 ways through them."""

    def tree(leaf):
        value = Expression("held", (leaf,))
        for _ in range(40):
            value = Expression("add", (value, value))
        return value

    assert same(tree(1.0), tree(1.0))
    assert not same(tree(1.0), tree(2.0))


def test_a_long_chain_of_nodes_is_compared():
    """Longer than Python calls may nest."""

    def chain(leaf):
        value = leaf
        for _ in range(3000):
            value = Expression("held", (value,))
        return value

    assert same(chain(1.0), chain(1.0))
    assert not same(chain(1.0), chain(2.0))
