# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of images, however they are stored, and the nodes that place them on a surface."""

from __future__ import annotations

import math

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from hybrid_addon.blender.sync import MeshCache, Warnings
from hybrid_addon.blender.sync.image import Images, frame_path
from hybrid_addon.blender.sync.image_file import srgb_to_linear
from hybrid_addon.blender.sync.material import translate_material
from hybrid_addon.blender.sync.texture import FrameFacts
from hybrid_addon.expressions import walk

pytestmark = pytest.mark.blender

WIDTH, HEIGHT = 3, 2
LINEAR_HALF = ((128 / 255 + 0.055) / 1.055) ** 2.4  # of the byte 128


def write(path, pixels, kind="uint8", straight=True):
    """Write (height, width, channels) pixels, row 0 at the bottom, and load them as a Blender image."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.attribute("oiio:UnassociatedAlpha", int(straight))
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    out.write_image(np.ascontiguousarray(pixels[::-1], dtype=np.float32))
    out.close()
    return bpy.data.images.load(str(path))


def checks(alpha=1.0):
    """Red bottom left, green bottom right, blue top left, the rest half grey."""
    pixels = np.full((HEIGHT, WIDTH, 4), 128 / 255, np.float32)
    pixels[0, 0, :3], pixels[0, -1, :3], pixels[-1, 0, :3] = (1, 0, 0), (0, 1, 0), (0, 0, 1)
    pixels[..., 3] = alpha
    return pixels


def read(b_image, warn=None):
    return Images(warn or Warnings()).pixels(b_image).rgba()


def assert_checks(pixels, grey):
    assert pixels.shape == (HEIGHT, WIDTH, 4)
    assert pixels.dtype == np.float32
    assert pixels[0, 0, :3] == pytest.approx((1, 0, 0), abs=1e-4)
    assert pixels[0, -1, :3] == pytest.approx((0, 1, 0), abs=1e-4)
    assert pixels[-1, 0, :3] == pytest.approx((0, 0, 1), abs=1e-4)
    assert pixels[1, 1, :3] == pytest.approx((grey,) * 3, rel=1e-3)


@pytest.mark.parametrize("packed", [False, True], ids=["file", "packed"])
@pytest.mark.parametrize(
    ("name", "kind", "grey"),
    [
        ("bytes.png", "uint8", LINEAR_HALF),
        ("shorts.png", "uint16", LINEAR_HALF),
        ("halves.exr", "half", 128 / 255),
        ("plain.tif", "float", LINEAR_HALF),  # float, but Blender takes a TIFF for sRGB
    ],
)
def test_files_and_packed_images_are_linear_and_upright(scene, tmp_path, name, kind, grey, packed):
    b_image = write(tmp_path / name, checks(), kind)
    if packed:
        b_image.pack()
        (tmp_path / name).unlink()
    assert_checks(read(b_image), grey)


@pytest.mark.parametrize("packed", [False, True], ids=["file", "packed"])
@pytest.mark.parametrize("kind", ["uint8", "uint16"])
def test_alpha_is_straight_whatever_the_file_says(scene, tmp_path, kind, packed):
    alpha = 128 / 255
    b_image = write(tmp_path / "straight.png", checks(alpha), kind)
    b_associated = write(tmp_path / "associated.png", np.minimum(checks(alpha), alpha), kind)
    b_associated.alpha_mode = "PREMUL"
    for b_each in (b_image, b_associated):
        if packed:
            b_each.pack()
    assert read(b_image)[0, 0] == pytest.approx((1, 0, 0, alpha), abs=1e-4)
    assert read(b_image)[1, 1] == pytest.approx((LINEAR_HALF,) * 3 + (alpha,), rel=1e-3)
    assert read(b_associated)[1, 1] == pytest.approx((1, 1, 1, alpha), rel=1e-2)
    b_image.alpha_mode = "NONE"
    assert read(b_image)[0, 0] == pytest.approx((1, 0, 0, 1), abs=1e-4)


def test_an_exrs_associated_alpha_is_divided_out(scene, tmp_path):
    pixels = checks(0.5)
    pixels[..., :3] *= 0.5
    b_image = write(tmp_path / "a.exr", pixels, "float")
    assert read(b_image)[0, 0] == pytest.approx((1, 0, 0, 0.5))
    b_image.alpha_mode = "CHANNEL_PACKED"
    assert read(b_image)[0, 0] == pytest.approx((0.5, 0, 0, 0.5))


def test_grey_and_rgb_files_get_four_channels(scene, tmp_path):
    grey = read(write(tmp_path / "grey.exr", np.full((2, 3, 1), 0.25, np.float32), "half"))
    assert grey[1, 2].tolist() == [0.25, 0.25, 0.25, 1.0]
    rgb = read(write(tmp_path / "rgb.hdr", np.full((2, 3, 3), 4.0, np.float32), "float"))
    assert rgb[1, 2].tolist() == [4, 4, 4, 1]


def test_colour_spaces(scene, tmp_path):
    b_image = write(tmp_path / "a.png", checks())
    grey = 128 / 255
    found = {}
    for space in ("sRGB", "Non-Color", "Linear Rec.709", "Rec.1886"):
        b_image.colorspace_settings.name = space
        found[space] = float(read(b_image)[1, 1, 0])
    assert found["sRGB"] == pytest.approx(LINEAR_HALF, rel=1e-4)
    assert found["Non-Color"] == found["Linear Rec.709"] == pytest.approx(grey, rel=1e-6)
    assert found["Rec.1886"] == pytest.approx(grey**2.4, rel=1e-3)  # through Blender's own OpenColorIO configuration
    b_image.colorspace_settings.name = "Linear Rec.2020"
    assert read(b_image)[0, 0, 0] == pytest.approx(1.6605, rel=1e-3)  # BT.2020 red in Rec.709


def test_generated_and_painted_images(scene):
    b_image = bpy.data.images.new("Generated", 4, 2)
    b_image.generated_color = (128 / 255, 1, 0, 1)
    assert read(b_image)[1, 3] == pytest.approx((LINEAR_HALF, 1, 0, 1), rel=1e-4)
    b_image.pixels[0] = 1.0
    pixels = read(b_image)
    assert pixels.shape == (2, 4, 4)
    assert pixels[0, 0, 0] == pytest.approx(1.0)
    assert pixels[0, 1, 0] == pytest.approx(LINEAR_HALF, rel=1e-4)


@pytest.mark.parametrize("content", [None, b"not a picture"], ids=["gone", "broken"])
def test_an_unreadable_image_is_pink_and_named_with_its_path(scene, tmp_path, content):
    path = tmp_path / "lost.png"
    b_image = write(path, checks())
    b_image.buffers_free()
    path.unlink()
    if content:
        path.write_bytes(content)
    warn = Warnings()
    assert read(b_image, warn).tolist() == [[[1, 0, 1, 1]]]
    (line,) = warn
    assert "'lost.png'" in line
    assert str(path) in line


def test_a_packed_image_does_not_follow_its_file(scene, tmp_path):
    b_image = write(tmp_path / "a.png", checks())
    b_image.pack()
    bpy.data.images.remove(write(tmp_path / "a.png", np.zeros((5, 5, 4), np.float32)))
    assert_checks(read(b_image), LINEAR_HALF)


def test_each_image_is_read_once(scene, tmp_path):
    b_image, images = write(tmp_path / "a.png", checks()), Images(Warnings())
    first = images.pixels(b_image)
    (tmp_path / "a.png").unlink()
    assert images.pixels(b_image) is first


def test_frames_of_a_sequence():
    assert frame_path("/x/shot2_0007.png", 12) == "/x/shot2_0012.png"
    assert frame_path("/7/still.png", 12) == "/7/still.png"


def test_srgb_curve_has_its_published_values():
    values = srgb_to_linear(np.array([0.0, 0.04045, 0.5, 1.0], np.float32))
    assert values == pytest.approx([0, 0.0031308, 0.2140411, 1], rel=1e-4)


# ------------------------------------------------------------------------------------------------ nodes


class Textured:
    """A diffuse material whose colour comes from an Image Texture node."""

    def __init__(self, b_image):
        self.b_material = bpy.data.materials.new("Painted")
        if bpy.app.version < (5, 0, 0):
            self.b_material.use_nodes = True
        self.tree = self.b_material.node_tree
        self.tree.nodes.clear()
        self.b_output, self.b_shader, self.b_image = (
            self.tree.nodes.new(f"ShaderNode{kind}") for kind in ("OutputMaterial", "BsdfDiffuse", "TexImage")
        )
        self.b_image.image = b_image
        self.tree.links.new(self.b_shader.outputs[0], self.b_output.inputs["Surface"])
        self.tree.links.new(self.b_image.outputs["Color"], self.b_shader.inputs["Color"])
        self.warn = Warnings()

    def feed(self, kind, output=0, into=None, **inputs):
        b_node = self.tree.nodes.new(kind)
        for name, value in inputs.items():
            b_node.inputs[name].default_value = value
        self.tree.links.new(b_node.outputs[output], (into or self.b_image).inputs["Vector"])
        return b_node

    def surface(self):
        return translate_material(self.b_material, Images(self.warn), self.warn, FrameFacts())

    def expression(self):
        """The base colour, with the image at its root if it has any."""
        return self.surface().base_color

    def texture(self):
        return next(e.data for e in walk(self.expression()) if e.operation == "image")


@pytest.fixture
def textured(scene, tmp_path):
    return Textured(write(tmp_path / "a.png", checks()))


def test_the_image_node_becomes_the_base_colours_texture(textured):
    textured.b_image.extension, textured.b_image.interpolation = "MIRROR", "Closest"
    texture = textured.texture()
    assert (texture.name, texture.extension, texture.interpolation) == ("a.png", "MIRROR", "CLOSEST")
    assert texture.uv_map == ""
    assert texture.uv_transform.tolist() == [[1, 0, 0], [0, 1, 0]]
    assert_checks(texture.pixels.rgba(), LINEAR_HALF)
    assert list(textured.warn) == []


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR"])
def test_mapping_moves_uvs_as_blender_documents(textured, kind):
    angle, scale, move = 0.5, (2.0, 4.0, 1.0), (0.25, -1.0, 0.0)
    b_mapping = textured.feed("ShaderNodeMapping", Rotation=(0, 0, angle), Scale=scale)
    b_mapping.vector_type = kind
    if kind != "VECTOR":
        b_mapping.inputs["Location"].default_value = move
    u, v = 0.3, 0.7
    cos, sin = math.cos(angle), math.sin(angle)
    if kind == "TEXTURE":
        x, y = u - move[0], v - move[1]
        expected = (cos * x + sin * y) / scale[0], (-sin * x + cos * y) / scale[1]
    else:
        x, y = u * scale[0], v * scale[1]
        expected = cos * x - sin * y, sin * x + cos * y
        if kind == "POINT":
            expected = expected[0] + move[0], expected[1] + move[1]
    assert textured.texture().uv_transform @ (u, v, 1) == pytest.approx(expected)


def test_two_mappings_apply_in_their_order(textured):
    second = textured.feed("ShaderNodeMapping", Scale=(2, 2, 1))
    textured.feed("ShaderNodeMapping", into=second, Location=(1, 0, 0))
    assert textured.texture().uv_transform @ (0, 0, 1) == pytest.approx((2, 0))


@pytest.mark.parametrize(
    ("kind", "attribute"), [("ShaderNodeUVMap", "uv_map"), ("ShaderNodeAttribute", "attribute_name")]
)
def test_uv_maps_by_name(textured, kind, attribute):
    setattr(textured.feed(kind, output="UV" if kind == "ShaderNodeUVMap" else "Vector"), attribute, "Second")
    assert textured.texture().uv_map == "Second"
    assert list(textured.warn) == []


def test_other_coordinates_are_expressions_and_the_unknown_are_named(textured):
    textured.feed("ShaderNodeTexCoord", output="UV")
    assert textured.expression().inputs == ()
    textured.feed("ShaderNodeTexCoord", output="Generated")
    (coordinates,) = textured.expression().inputs
    assert (coordinates.operation, coordinates.data) == ("attribute", "generated")
    textured.b_image.projection = "BOX"
    assert {e.operation for e in walk(textured.expression())} >= {"box_view", "box_weights", "image"}
    assert list(textured.warn) == []
    textured.b_image.projection = "FLAT"
    textured.feed("ShaderNodeTexCoord", output="Window")
    textured.texture()
    assert "(Texture Coordinate), which is not followed" in next(iter(textured.warn))


def test_nodes_between_image_and_shader_are_followed(textured):
    b_gamma = textured.tree.nodes.new("ShaderNodeGamma")
    textured.tree.links.new(textured.b_image.outputs["Color"], b_gamma.inputs["Color"])
    textured.tree.links.new(b_gamma.outputs[0], textured.b_shader.inputs["Color"])
    assert (textured.expression().operation, textured.texture().name) == ("gamma", "a.png")
    assert list(textured.warn) == []


def test_an_image_node_without_image_is_black(textured):
    textured.b_image.image = None
    assert textured.expression() == (0, 0, 0)


def test_colour_is_multiplied_by_alpha_unless_alpha_is_used(scene, tmp_path):
    textured = Textured(write(tmp_path / "a.png", checks(128 / 255)))
    assert textured.texture().pixels.rgba()[0, 0] == pytest.approx((128 / 255, 0, 0, 1), abs=1e-4)
    b_math = textured.tree.nodes.new("ShaderNodeMath")
    textured.tree.links.new(textured.b_image.outputs["Alpha"], b_math.inputs[0])
    assert textured.texture().pixels.rgba()[0, 0, 0] == pytest.approx(1.0)


# ------------------------------------------------------------------------------------------------ tiles


def tiled(numbers):
    """A tiled image as the image editor makes it: each tile of its own colour, nowhere saved."""
    b_image = bpy.data.images.new("Tiles", 4, 4, tiled=True)
    for number in numbers:
        b_tile = b_image.tiles.get(number) or b_image.tiles.new(tile_number=number)
        b_image.tiles.active = b_tile
        with bpy.context.temp_override(edit_image=b_image):
            bpy.ops.image.tile_fill(color=(number % 10 / 4, number // 10 % 10 / 4, 0, 1), width=4, height=4)
    return b_image


def test_tiles_that_are_nowhere_saved_are_read(scene):
    warn, b_image = Warnings(), tiled((1001, 1002, 1013))
    found = Images(warn).tiles(b_image)
    assert list(warn) == []
    assert set(found) == {(0, 0), (1, 0), (2, 1)}
    for (column, row), texels in found.items():
        expected = srgb_to_linear(np.array([(column + 1) / 4, row / 4], np.float32))
        assert texels.rgba()[2, 2, :2] == pytest.approx(expected, abs=0.01)
    assert b_image.filepath == ""


@pytest.mark.parametrize("token", ["<UDIM>", "<UVTILE>"])
def test_tiles_are_files_and_one_that_is_missing_is_warned_of(scene, tmp_path, token):
    missing, there = {"<UDIM>": ("1001", "1012"), "<UVTILE>": ("u1_v1", "u2_v2")}[token]
    for name in (missing, there):
        write(tmp_path / f"wood.{name}.png", checks())
    b_image = tiled((1001, 1012))
    b_image.filepath = str(tmp_path / f"wood.{token}.png")  # Blender looks which tiles there are
    (tmp_path / f"wood.{missing}.png").unlink()
    warn = Warnings()
    found = Images(warn).tiles(b_image)
    assert set(found) == {(1, 1)}
    assert_checks(found[1, 1].rgba(), LINEAR_HALF)
    assert list(warn) == ["image 'Tiles': cannot read its tile 1001; it is drawn pink"]


def test_a_tiled_image_on_a_material(scene):
    b_material = bpy.data.materials.new("Tiles")
    if bpy.app.version < (5, 0, 0):
        b_material.use_nodes = True
    b_tree = b_material.node_tree
    b_node = b_tree.nodes.new("ShaderNodeTexImage")
    b_node.image = tiled((1001, 1002))
    b_tree.links.new(b_node.outputs["Color"], b_tree.nodes["Principled BSDF"].inputs["Base Color"])
    warn = Warnings()
    (image,) = walk(translate_material(b_material, Images(warn), warn, FrameFacts()).base_color)
    assert set(image.data.tiles) == {(0, 0), (1, 0)}
    assert tuple(image.data.pixels.rgba()[0, 0]) == (1, 0, 1, 1)  # where no tile is, as in EEVEE
    assert list(warn) == []


def test_each_image_that_cannot_be_converted_is_told_of_in_every_frame(scene, tmp_path, monkeypatch):
    """Two of one colour space, whose lines are told as one."""
    monkeypatch.setattr("hybrid_addon.blender.sync.image.convert_with_ocio", lambda *_: False)
    images = [write(tmp_path / f"{name}.png", checks()) for name in ("one", "other")]
    for b_image in images:
        b_image.colorspace_settings.name = "AgX Base sRGB"
    kept, said = MeshCache(), []
    for _ in range(2):
        warn = Warnings()
        kept.begin()
        for b_image in images:
            Images(warn, kept).pixels(b_image)
        kept.end()
        said.append(list(warn.each()))
    assert len(said[0]) == 2 and said[1] == said[0]
