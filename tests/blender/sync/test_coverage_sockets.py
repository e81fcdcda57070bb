# SPDX-License-Identifier: GPL-3.0-or-later
"""A walk through every node that Blender has for shaders: inputs, outputs and settings are followed or named.

Each is changed: the translated surface must change, or a warning name it, or the table say why neither is needed.
"""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from hybrid_addon.blender.sync import Warnings, texture_nodes
from hybrid_addon.blender.sync.coverage import NODE_SETTINGS, SOCKETS, Followed, Named, status_of
from hybrid_addon.blender.sync.image import Images
from hybrid_addon.blender.sync.material import translate_material
from hybrid_addon.blender.sync.texture import FrameFacts
from hybrid_addon.blender.sync.world import translate_world
from tests.blender.sync.coverage_kit import contents, items_of, other_value

pytestmark = pytest.mark.blender

ABSTRACT = {"ShaderNode", "ShaderNodeCustomGroup"}
KINDS = sorted(
    name
    for name in dir(bpy.types)
    if isinstance(getattr(bpy.types, name), type)
    and issubclass(getattr(bpy.types, name), bpy.types.ShaderNode)
    and name not in ABSTRACT
)
COMMON = {p.identifier for p in bpy.types.ShaderNode.bl_rna.properties}
WORLD_ONLY = {"ShaderNodeBackground", "ShaderNodeOutputWorld"}
LIVELY = {"VALUE": 0.4, "RGBA": (0.35, 0.5, 0.7, 1.0), "VECTOR": (0.3, 0.2, 0.6)}
OF_THEIR_OWN = {  # inputs whose lively value is another
    ("ShaderNodeBsdfPrincipled", "Alpha"): 1.0,
    ("ShaderNodeBsdfPrincipled", "Coat IOR"): 1.6,
    ("ShaderNodeMapRange", "From Max"): 0.9,
    ("ShaderNodeMapRange", "To Max"): 0.8,
    ("ShaderNodeClamp", "Min"): 0.5,
    ("ShaderNodeClamp", "Max"): 0.8,
}
BESIDE = {  # settings and inputs that count only beside others
    ("ShaderNodeTexWave", "rings_direction"): {"wave_type": "RINGS"},
    ("ShaderNodeTexVoronoi", "distance"): {"voronoi_dimensions": "3D"},
    ("ShaderNodeTexImage", "projection_blend"): {"projection": "BOX"},
    ("ShaderNodeMix", "blend_type"): {"data_type": "RGBA"},
    ("ShaderNodeMix", "clamp_result"): {"data_type": "RGBA"},
    ("ShaderNodeMix", "factor_mode"): {"data_type": "VECTOR"},
    ("ShaderNodeTexSky", "turbidity"): {"sky_type": "PREETHAM"},
}


@pytest.fixture(scope="module", autouse=True)
def factory_file(addon):
    """One for all: a fresh one for each node would take most of the time. Skies are not drawn, which takes seconds."""
    bpy.ops.wm.read_factory_settings()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            texture_nodes, "baked", lambda settings: np.full((2, 4, 4), hash(str(settings)) % 999, np.float32)
        )
        yield


class Stage:
    """One node of a kind in a tree of its own, wired to where it counts; `told` and `made` of the translation."""

    def __init__(self, kind, **settings):
        self.kind, self.of_world = kind, kind in WORLD_ONLY
        create = bpy.data.worlds if self.of_world else bpy.data.materials
        self.b_id = create.new("Stage")
        if bpy.app.version < (5, 0, 0):
            self.b_id.use_nodes = True
        self.tree = self.b_id.node_tree
        self.tree.nodes.clear()
        sink = "ShaderNodeOutputWorld" if self.of_world else "ShaderNodeOutputMaterial"
        self.output = self.tree.nodes.new(sink)
        self.b_node = self.output if kind == sink else self.tree.nodes.new(kind)
        if "image" in self.b_node.bl_rna.properties:
            self.b_node.image = picture()
        for name, value in settings.items():
            setattr(self.b_node, name, value)
        for b_socket in self.b_node.inputs:
            status = status_of(table(kind), b_socket.name)
            if not hasattr(b_socket, "default_value") or not isinstance(status, Followed | Named):
                continue
            lively = OF_THEIR_OWN.get((kind, b_socket.name), LIVELY.get(b_socket.type))
            value = lively if isinstance(status, Followed) else status.neutral
            if value is not None:
                width = len(b_socket.default_value) if b_socket.type in ("RGBA", "VECTOR") else 0
                b_socket.default_value = (
                    (value if isinstance(value, tuple) else (value,) * 4)[:width] if width else value
                )
        self.wire()

    def wire(self, output=None):
        """Link its output, or the first one there is, to where it counts."""
        shown = [b_output for b_output in self.b_node.outputs if b_output.enabled]
        if self.b_node == self.output or not shown:
            return
        b_output = output or shown[0]
        if b_output.type == "SHADER":
            volume = self.kind.startswith("ShaderNodeVolume")
            self.link(b_output, self.output.inputs["Volume" if volume else "Surface"])
            return
        shader = self.tree.nodes.new("ShaderNodeEmission")
        self.link(b_output, shader.inputs["Color"])
        self.link(shader.outputs[0], self.output.inputs["Surface"])

    def link(self, b_output, b_input):
        self.tree.links.new(b_output, b_input)

    def feed(self, b_input):
        """Link something that varies to an input."""
        if b_input.type == "SHADER":
            volume = b_input.name == "Volume"
            b_node = self.tree.nodes.new("ShaderNodeVolumeScatter" if volume else "ShaderNodeEmission")
            self.link(b_node.outputs[0], b_input)
        else:
            b_noise = self.tree.nodes.new("ShaderNodeTexNoise")
            self.link(b_noise.outputs["Color" if b_input.type in ("RGBA", "VECTOR") else 0], b_input)

    def translate(self):
        """(what it is made of, its warnings)."""
        warn = Warnings()
        if self.of_world:
            scene = bpy.context.scene
            scene.world = self.b_id
            made = translate_world(bpy.context.evaluated_depsgraph_get(), scene, Images(warn), warn, FrameFacts())[0]
        else:
            made = translate_material(self.b_id, Images(warn), warn, FrameFacts())
        return contents(made), set(warn.each())


def picture():
    b_image = bpy.data.images.get("Stage") or bpy.data.images.new("Stage", 4, 4, alpha=True)
    pixels = np.random.default_rng(1).random((16, 4), np.float32)
    b_image.pixels.foreach_set(pixels.ravel())
    return b_image


def table(kind):
    return SOCKETS.get(kind, {})


def is_named_whole(kind):
    return isinstance(table(kind).get(""), Named)


def status_is(kind, name, status):
    return isinstance(status_of(table(kind), name), status)


def variants(kind):
    """Settings under which a node has other inputs: as it is, and each item of each enumeration."""
    b_node = Stage(kind).b_node
    yield {}
    for b_property in b_node.bl_rna.properties:
        if b_property.identifier not in COMMON and b_property.type == "ENUM" and not b_property.is_readonly:
            yield from ({b_property.identifier: item} for item in items_of(b_node, b_property.identifier))


def inputs(kind):
    """(settings under which it is there, its position), each input once."""
    seen = set()
    for settings in variants(kind):
        for position, b_socket in enumerate(Stage(kind, **settings).b_node.inputs):
            if b_socket.enabled and (b_socket.identifier, b_socket.name) not in seen and b_socket.name:
                seen.add((b_socket.identifier, b_socket.name))
                yield settings, position


@pytest.mark.parametrize("kind", KINDS)
def test_every_input_is_followed_named_or_irrelevant(kind):
    assert kind in SOCKETS, f"{kind} is in no table of sync/coverage"
    wrong = []
    for settings, position in inputs(kind):
        name = Stage(kind, **settings).b_node.inputs[position].name
        status = status_of(table(kind), name)
        if is_named_whole(kind) and not isinstance(status, Followed):
            continue
        if status is None:
            wrong.append(f"{name!r} is in no table")
        elif isinstance(status, Followed | Named) and not counts(kind, settings, position, status):
            wrong.append(f"{name!r} is listed as {type(status).__name__}, and changing it shows nothing")
    assert wrong == []


def counts(kind, settings, position, status):
    """Whether a change of an input shows as its status says: by a value where it has one, and by a link."""
    before, told = Stage(kind, **settings).translate()
    changed, fed = Stage(kind, **settings), Stage(kind, **settings)
    b_socket = changed.b_node.inputs[position]
    fed.feed(fed.b_node.inputs[position])
    stages = [fed]
    if hasattr(b_socket, "default_value") and not b_socket.hide_value:
        if isinstance(status, Followed) or status.neutral is not None:
            b_socket.default_value = other_value(b_socket.default_value)
            stages.append(changed)
    for stage in stages:
        made, says = stage.translate()
        new = says - told
        named = any(repr(b_socket.name) in line for line in new)
        if not (named if isinstance(status, Named) else made != before or new):
            return False
    return True


@pytest.mark.parametrize("kind", [kind for kind in KINDS if is_named_whole(kind)])
def test_a_node_that_is_not_followed_is_named_once(kind):
    stages = [Stage(kind, **settings) for settings in variants(kind)]
    told = [stage.translate()[1] for stage in stages if any(b_output.enabled for b_output in stage.b_node.outputs)]
    named = [[line for line in lines if stages[0].b_node.name in line] for lines in told]
    if kind not in ("ShaderNodeScript", "ShaderNodeTexPointDensity", *PARTLY):
        assert all(len(lines) == 1 for lines in named), named
    elif kind in PARTLY:
        assert any(len(lines) == 1 for lines in named)


PARTLY = ("ShaderNodeMapRange",)
"""Followed in most of their settings."""


NEVER_WHOLE = ()
"""They bring a warning whatever is set."""


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind in SOCKETS and not is_named_whole(kind)])
def test_a_node_at_its_neutral_values_brings_no_warning(kind):
    assert (len(Stage(kind).translate()[1]) > 0) == (kind in NEVER_WHOLE)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind in SOCKETS and not is_named_whole(kind)])
def test_every_output_is_followed_or_named(kind):
    silent, seen = [], set()
    for settings in variants(kind):
        for position, b_output in enumerate(Stage(kind, **settings).b_node.outputs):
            if b_output.type == "SHADER" or not b_output.enabled or b_output.identifier in seen:
                continue
            seen.add(b_output.identifier)
            stage = Stage(kind, **settings)
            stage.tree.nodes.remove(next(n for n in stage.tree.nodes if n.bl_idname == "ShaderNodeEmission"))
            stage.wire(stage.b_node.outputs[position])
            made, told = stage.translate()
            if made == WHITE() and not told:
                silent.append(b_output.name)
    assert silent == []


def WHITE():
    """What an Emission shader makes with nothing linked to it."""
    return Stage("ShaderNodeEmission").translate()[0]


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind in SOCKETS and not is_named_whole(kind)])
def test_every_setting_of_a_node_is_followed_named_or_irrelevant(kind):
    silent = []
    for b_property in Stage(kind).b_node.bl_rna.properties:
        name = b_property.identifier
        status = status_of(NODE_SETTINGS.get(kind, {}), name)
        simple = b_property.type in ("ENUM", "BOOLEAN", "INT", "FLOAT") and not b_property.is_readonly
        if name in COMMON or not simple or (status is not None and not isinstance(status, Named)):
            continue
        beside = BESIDE.get((kind, name), {})
        before, told = Stage(kind, **beside).translate()
        stage = Stage(kind, **beside)
        value = getattr(stage.b_node, name)
        values = items_of(stage.b_node, name) if b_property.type == "ENUM" else [other_value(value)]
        for value in values:
            stage = Stage(kind, **{**beside, name: value})
            made, says = stage.translate()
            if made == before and says == told:
                silent.append((name, value))
    assert silent == []
