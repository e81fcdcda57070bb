# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface programs as artists and scripts choose them: by name, on objects and materials, with custom properties."""

import bpy
import numpy as np
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender.sync import translate
from hybrid_addon.blender.sync.surface_programs import named_program
from tests.blender import kit

pytestmark = pytest.mark.blender


def mirror(hits):
    return hybrid.SurfaceAnswer(reflection=1.0, reflected=hits.mirror)


@pytest.fixture
def empty_scene(addon):
    return kit.empty_scene(16, 16, 1)


@pytest.fixture
def ball(empty_scene):
    bpy.ops.mesh.primitive_uv_sphere_add()
    ball = bpy.context.object
    ball.name = "ball"
    bpy.ops.object.camera_add(location=(0, 0, 5))
    empty_scene.camera = bpy.context.object
    grey = bpy.data.materials.new("grey")
    kit.nodes_of(grey)
    ball.data.materials.append(grey)
    yield ball
    hybrid.programs.forget("mirror")


def translated(scene):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    depsgraph.update()
    return translate(depsgraph, scene, (16, 16), (0, 0, 16, 16))


def test_a_function_answers_for_an_object(ball, empty_scene):
    hybrid.surface(ball, mirror)
    assert ball.hybrid.program == "mirror" and ball.hybrid.ray_traced
    found = translated(empty_scene)
    (worn,) = (found.scene.surfaces[number] for number in found.scene.instances[0].surfaces)
    assert worn.program.hit is mirror and not found.warnings
    hybrid.surface(ball, None)
    assert all(surface.program is None for surface in translated(empty_scene).scene.surfaces)


def test_an_objects_own_wins_over_its_materials(ball, empty_scene):
    hybrid.surface(ball.data.materials[0], "X-Ray")
    assert translated(empty_scene).scene.surfaces[0].program.name == "X-Ray"
    hybrid.surface(ball, "Portal")
    assert translated(empty_scene).scene.surfaces[0].program.name == "Portal"


def test_custom_properties_reach_the_program(ball, empty_scene):
    empty_scene.camera.location.x = 3
    ball["density"], ball["tint"], ball["camera"] = 0.5, (0.1, 0.2, 0.3), empty_scene.camera
    hybrid.surface(ball, "X-Ray")
    values = translated(empty_scene).scene.surfaces[0].program.values
    assert values["density"] == 0.5 and values["tint"] == pytest.approx((0.1, 0.2, 0.3))
    assert values["camera"][:, 3] == pytest.approx((3, 0, 5, 1))


def test_a_name_that_is_not_registered_is_named_and_the_material_is_drawn(ball, empty_scene):
    ball.hybrid.program = "__import__('os').abort()"  # text of a file is a name, never run
    found = translated(empty_scene)
    assert all(surface.program is None for surface in found.scene.surfaces)
    assert [line for line in found.warnings if "object 'ball': there is no surface program \"__import__" in line]


def test_nothing_named_is_nothing(ball):
    assert named_program(ball) is None


@pytest.mark.parametrize(
    ("given", "says"),
    [("no such", "no surface program 'no such'"), (3, "is not a function")],
)
def test_what_is_no_program_is_refused(ball, given, says):
    with pytest.raises(hybrid.HybridError, match=says):
        hybrid.surface(ball, given, name="three" if given == 3 else "")
    assert not ball.hybrid.program


def test_the_report_names_what_went_wrong_and_the_pixel_what_answered(ball, empty_scene):
    def broken(hits):
        raise ValueError("no")

    hybrid.surface(ball, broken)
    result = hybrid.render(empty_scene, mode="full", resolution=(16, 16), samples=1)
    hybrid.programs.forget("broken")
    assert any("object 'ball': surface program 'broken': ValueError: no" in line for line in result.report["warnings"])
    hybrid.surface(ball, mirror)
    assert "answered by surface program 'mirror'" in str(hybrid.explain(8, 8, empty_scene))
    assert np.isfinite(result.image).all()
