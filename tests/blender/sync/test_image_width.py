# SPDX-License-Identifier: GPL-3.0-or-later
"""Images are kept in the width that they have, stand for the same numbers as ever, and are read once."""

from __future__ import annotations

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from hybrid_addon import memory
from hybrid_addon.blender.sync import Warnings, image_file
from hybrid_addon.blender.sync.cache import MeshCache
from hybrid_addon.blender.sync.image import Images
from hybrid_addon.blender.sync.image_file import srgb_to_linear

pytestmark = pytest.mark.blender

SIZE = 23  # no multiple of what a processor works on at once


def write(path, channels, kind, seed=3):
    """A file of random numbers, opaque in its upper half and clear in its lowest row."""
    pixels = np.random.default_rng(seed).random((SIZE, SIZE, channels)).astype(np.float32)
    if channels in (2, 4):
        pixels[:10, :, -1], pixels[-1, :, -1] = 1, 0
    if kind not in ("uint8", "uint16"):
        pixels *= 4
    spec = oiio.ImageSpec(SIZE, SIZE, channels, kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    out.write_image(pixels)
    out.close()
    return bpy.data.images.load(str(path))


def in_float32(path, alpha_mode, is_srgb):
    """The file as four float32 of each texel, all of it converted at once."""
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hints)
    raw = source.read_image(0, 0, 0, source.spec().nchannels, oiio.FLOAT).reshape(SIZE, SIZE, -1)[::-1]
    is_bytes = str(source.spec().format) == "uint8"
    source.close()
    rgba = np.ones((SIZE, SIZE, 4), np.float32)
    if raw.shape[2] <= 2:
        rgba[..., :3], rgba[..., 3:] = raw[..., :1], raw[..., 1:] if raw.shape[2] == 2 else 1
    else:
        rgba[..., : raw.shape[2]] = raw
    if alpha_mode == "NONE":
        rgba[..., 3] = 1
    elif alpha_mode == "PREMUL":
        np.divide(rgba[..., :3], rgba[..., 3:], out=rgba[..., :3], where=rgba[..., 3:] > 1e-8)
        if is_srgb and is_bytes:  # as Blender does with bytes
            np.minimum(rgba[..., :3], 1, out=rgba[..., :3], where=rgba[..., 3:] > 1e-8)
    if is_srgb:
        rgba[..., :3] = srgb_to_linear(rgba[..., :3])
    return rgba


@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
@pytest.mark.parametrize("alpha_mode", ["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"])
@pytest.mark.parametrize(
    ("name", "kind", "channels"),
    [
        ("bytes.png", "uint8", 4), ("rgb.png", "uint8", 3), ("grey.png", "uint8", 1), ("grey_alpha.png", "uint8", 2),
        ("shorts.png", "uint16", 4), ("grey_shorts.png", "uint16", 1), ("halves.exr", "half", 4),
        ("grey_halves.exr", "half", 1), ("floats.exr", "float", 4), ("rgb.hdr", "float", 3),
    ],
)  # fmt: skip
def test_no_bit_of_a_texel_depends_on_its_width(scene, tmp_path, name, kind, channels, alpha_mode, space):
    b_image = write(tmp_path / name, channels, kind)
    b_image.alpha_mode, b_image.colorspace_settings.name = alpha_mode, space
    texels = Images(Warnings()).pixels(b_image)
    expected = in_float32(tmp_path / name, alpha_mode, space == "sRGB")
    np.testing.assert_array_equal(texels.rgba(), expected)
    index = np.arange(-5, SIZE * SIZE)
    np.testing.assert_array_equal(texels.take(index), expected.reshape(-1, 4).take(index, axis=0, mode="wrap").T)
    expected[..., :3] *= expected[..., 3:]
    expected[..., 3] = 1
    np.testing.assert_array_equal(texels.multiplied().rgba(), expected)
    widens = space == "sRGB" and (kind == "float" or (alpha_mode == "PREMUL" and channels == 4 and kind != "uint8"))
    if not widens:
        dtype = {"half": "float16", "float": "float32"}.get(kind, kind)
        assert (texels.stored.dtype, texels.stored.shape[2]) == (dtype, 4 if channels == 3 else channels)


def test_more_colour_than_alpha_is_what_blender_makes_of_it(scene, tmp_path):
    b_image = write(tmp_path / "glow.png", 4, "uint8")
    b_image.alpha_mode = "PREMUL"
    drawn = np.empty(len(b_image.pixels), np.float32)
    b_image.pixels.foreach_get(drawn)
    found = Images(Warnings()).pixels(b_image).rgba()
    drawn = drawn.reshape(found.shape)
    shows = drawn[..., 3] > 0
    assert (drawn[shows, :3] == 1).mean() > 0.2
    assert np.abs(found - np.dstack([srgb_to_linear(drawn[..., :3]), drawn[..., 3]]))[shows].max() < 0.006


def test_painted_images_of_bytes_stay_bytes(scene):
    b_image = bpy.data.images.new("Painted", 3, 2, alpha=True)
    bytes_ = np.arange(24, dtype=np.uint8).reshape(2, 3, 4) * 10
    b_image.pixels.foreach_set((bytes_ / np.float32(255)).ravel())
    texels = Images(Warnings()).pixels(b_image)
    assert texels.stored.dtype == np.uint8
    np.testing.assert_array_equal(texels.stored, bytes_)


@pytest.fixture
def frames(monkeypatch):
    """Reads images of one frame after the other, and counts what is read from files and from Blender."""
    kept, reads = MeshCache(), []

    def counted(module, name):
        original = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given: reads.append(name) or original(*given))

    from hybrid_addon.blender.sync import image

    counted(image, "read_file")
    counted(image, "_read_blender_pixels")
    counted(image_file, "read_file")

    def frame(b_image):
        reads.clear()
        kept.begin()
        found = Images(Warnings(), kept)
        texels = list(found.tiles(b_image).values()) if b_image.source == "TILED" else [found.pixels(b_image)]
        kept.end()
        return texels, len(reads)

    return frame


def test_a_second_frame_reads_no_image_again(scene, tmp_path, frames):
    b_packed, b_file = (write(tmp_path / name, 4, "uint8") for name in ("packed.png", "file.png"))
    b_packed.pack()
    write(tmp_path / "tile.1001.png", 3, "uint8")
    b_tiles = bpy.data.images.load(str(tmp_path / "tile.1001.png"))
    b_tiles.source = "TILED"
    b_tiles.filepath = str(tmp_path / "tile.<UDIM>.png")
    b_generated = bpy.data.images.new("Generated", 8, 8)
    for pack in (False, True):
        if pack:
            b_tiles.pack()
        for b_image in (b_packed, b_file, b_tiles, b_generated):
            before, _ = frames(b_image)
            after, reads = frames(b_image)
            assert reads == 0, b_image.name
            assert [a is b for a, b in zip(after, before, strict=True)] == [True], b_image.name


def test_what_was_changed_is_read_again(scene, tmp_path, frames):
    b_generated = bpy.data.images.new("Generated", 8, 8)
    (black,), _ = frames(b_generated)
    b_generated.generated_color = (1, 0, 0, 1)
    (red,), _ = frames(b_generated)
    assert (black.rgba()[0, 0].tolist(), red.rgba()[0, 0].tolist()) == ([0, 0, 0, 1], [1, 0, 0, 1])
    b_generated.pixels[:4] = (0, 1, 0, 1)
    (green,), _ = frames(b_generated)
    assert green.rgba()[0, 0].tolist() == [0, 1, 0, 1]
    (same,), _ = frames(b_generated)
    assert same is green
    b_generated.pixels[4:8] = (1, 0, 1, 1)
    (other,), _ = frames(b_generated)
    assert other.rgba()[0, :2].tolist() == [[0, 1, 0, 1], [1, 0, 1, 1]]
    b_generated.pack()
    b_packed = write(tmp_path / "packed.png", 4, "uint8", seed=1)
    b_packed.pack()
    (first,), _ = frames(b_packed)
    write(tmp_path / "other.png", 4, "uint8", seed=2)
    content = (tmp_path / "other.png").read_bytes()
    b_packed.pack(data=content, data_len=len(content))
    (second,), reads = frames(b_packed)
    assert reads >= 1
    assert not np.array_equal(first.stored, second.stored)


def test_an_image_that_does_not_fit_is_refused_before_it_is_read(scene, tmp_path, monkeypatch):
    b_image = write(tmp_path / "huge.png", 4, "uint8")
    monkeypatch.setattr(memory, "available", lambda: 1000)
    with pytest.raises(memory.NotEnoughMemory, match=r"not enough memory: image 'huge.png' .* are free; use smaller"):
        Images(Warnings()).pixels(b_image)
