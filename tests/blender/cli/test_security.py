# SPDX-License-Identifier: GPL-3.0-or-later
"""A .blend is untrusted: nothing in it runs, and nothing is written but where the user asked. Mode full: no EEVEE."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

import hybrid_addon as hybrid
from hybrid_addon.blender import cli
from hybrid_addon.blender.pipeline import nodes, scene_setup
from hybrid_addon.blender.sync import sky

pytestmark = pytest.mark.blender
PACKAGE = Path(hybrid.__file__).parent
HOSTILE = ["../../x", "/etc/x", "a\nhybrid: progress 9/9", "..", "a/b\\c", "x\x1b[2J", "{camera_name}", "%n####"]


@pytest.fixture
def scene(scene):
    scene.render.resolution_x, scene.render.resolution_y, scene.hybrid.samples = 24, 16, 1
    scene.hybrid.mode = "FULL"
    hybrid.mark(bpy.data.objects["Cube"], reflectivity=0.5)
    return scene


def compositor(scene):
    """The user's own tree, with Render Layers and an output."""
    if bpy.app.version >= (5, 0):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        output = tree.nodes.new("CompositorNodeComposite")
    layers = tree.nodes.new("CompositorNodeRLayers")
    tree.links.new(output.inputs[0], layers.outputs["Image"])
    return tree


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_the_source_evaluates_no_text_and_starts_no_process_but_two():
    """Words that run what they are given, or load objects: none, anywhere in the package but what draws skies, what
    compiles tiles, whose process gets folders and the name of a kernel, and --surface-programs, which runs the file
    that the user names on the command line."""
    banned = r"\b(eval|exec|__import__|as_module|run_path|run_module)\(|\b(pickle|marshal|shelve|subprocess)\b"
    banned += r"|os\.(system|popen|spawn\w*|exec\w+)|allow_pickle|use_scripts=True|tempfile\.mktemp"
    found = {f"{path.name}: {line.strip()}" for path in PACKAGE.rglob("*.py")
             for line in path.read_text(encoding="utf-8").splitlines() if re.search(banned, line)}  # fmt: skip
    known = {line for line in found if line.startswith(("sky.py: ", "apart.py: ")) and "subprocess" in line}
    known |= {line for line in found if line.startswith("marks.py: runpy.run_path(path, ")}
    assert not found - known
    assert {line for line in known if "Popen(" in line or "run(" in line} == {
        "apart.py: child = subprocess.Popen(",
        "sky.py: done = subprocess.run(",
    }


def test_the_process_for_skies_is_blender_and_gets_only_numbers_of_the_file(scene, monkeypatch):
    """Its words are our own, no file is opened there, and no script but ours runs."""
    started, orders = [], []

    def run(command, **options):
        started.append((command, options))
        orders.append(json.loads(Path(command[-2]).read_text(encoding="utf-8")))
        raise OSError("not here")

    monkeypatch.setattr(sky.subprocess, "run", run)
    monkeypatch.setattr(sky, "_kept", sky.OrderedDict())
    b_sky = scene.world.node_tree.nodes.new("ShaderNodeTexSky")
    b_sky.name = b_sky.label = "--python-expr evil"
    assert "not here" in sky.baked(sky.settings_of(b_sky))
    ((command, options),), (order,) = started, orders
    *words, order_path, picture_path = command
    assert words == [sys.executable, str(sky.SCRIPT), "--"]
    assert not options.get("shell") and options["timeout"] == sky.SECONDS
    assert not Path(order_path).exists() and Path(order_path).parent == Path(picture_path).parent
    kinds = {item.identifier for item in b_sky.bl_rna.properties["sky_type"].enum_items}
    assert {v for v in order["settings"].values() if isinstance(v, str)} <= kinds
    monkeypatch.setattr(sky, "bpy", SimpleNamespace(app=SimpleNamespace(module=False, binary_path="/opt/blender")))
    real = sky._blender()
    assert real[0] == "/opt/blender" and real[-2:] == ["--python", str(sky.SCRIPT)]
    assert {"--background", "--factory-startup", "--disable-autoexec"} <= set(real)


@pytest.mark.parametrize("verb", ["plan", "render"])
def test_no_script_and_no_driver_of_the_file_runs(scene, tmp_path, verb):
    """Even where the user has told Blender to trust every file that he opens himself."""
    marker = tmp_path / "it ran"
    code = f"open({str(marker)!r}, 'a').close()"
    text = bpy.data.texts.new("startup.py")
    text.write(code)
    text.use_module = True
    cube = bpy.data.objects["Cube"]
    driver = cube.hybrid.driver_add("reflectivity").driver
    driver.expression = f"[{code.replace('.close()', '')}, 0.5][1]"
    blend = save(tmp_path / "evil.blend")
    marker.unlink(missing_ok=True)
    preferences = bpy.context.preferences.filepaths
    preferences.use_scripts_auto_execute = True
    try:
        more = ["--output", str(tmp_path / "o.png")] if verb == "render" else []
        assert cli.main([verb, str(blend), *more]) == 0
    finally:
        preferences.use_scripts_auto_execute = False
    assert not marker.exists()


def test_scene_and_layer_names_stay_in_the_folder(scene, tmp_path, capfd):
    """Several scenes of hostile names, with passes: two plain files a scene, one plain line each."""
    scene.name = HOSTILE[0]
    scene.view_layers[0].name = "../a.b\n/Combined"
    for name in HOSTILE[1:]:
        bpy.ops.scene.new(type="LINK_COPY")
        bpy.context.scene.name = name
    blend = save(tmp_path / "names.blend")
    folder = tmp_path / "out" / "here"
    folder.mkdir(parents=True)
    code = cli.main(["render", str(blend), "--output", str(folder / "{scene_name}.png"), "--scene", "all",
                     "--passes", str(folder / "passes"), "--report", str(folder / "r.json")])  # fmt: skip
    printed = capfd.readouterr()
    assert code == 0, printed
    found = files(tmp_path)
    assert all(name == "names.blend" or name.startswith(f"out{os.sep}here{os.sep}") for name in found), found
    assert len(found) == 1 + 1 + 4 * len(HOSTILE)
    ours = [line for line in printed.out.splitlines() if line.startswith("hybrid: progress")]
    assert len(ours) == len(HOSTILE)
    assert all(line.isprintable() for line in ours)


@pytest.mark.parametrize("option", [[], ["--file-outputs"]])
def test_the_files_own_outputs_are_written_when_asked_only(scene, tmp_path, capfd, option):
    """A File Output node names any path it likes; Blender makes the folder and writes."""
    elsewhere = tmp_path / "elsewhere"
    tree = compositor(scene)
    node = tree.nodes.new("CompositorNodeOutputFile")
    if bpy.app.version >= (5, 0):
        node.directory = str(elsewhere)
        node.file_output_items.new("RGBA", "Image")
        node.format.media_type = "IMAGE"
        node.format.file_format = "PNG"
    else:
        node.base_path = str(elsewhere)
    layers = next(n for n in tree.nodes if n.type == "R_LAYERS")
    tree.links.new(node.inputs[0], layers.outputs["Image"])
    blend = save(tmp_path / "f.blend")
    assert cli.main(["render", str(blend), "--output", str(tmp_path / "o.png"), *option]) == 0
    assert elsewhere.exists() == bool(option)
    warned = [line for line in capfd.readouterr().out.splitlines() if "--file-outputs" in line]
    assert len(warned) == (0 if option else 1)


@pytest.mark.parametrize(
    "memory",
    ["[]", "{", "7", '"x"', "[" * 100000, '{"asleep": 5}', '{"asleep": {"output": 3, "before": [[], {}]}}',
     '{"asleep": {"output": "File Output", "before": ["no", "x"]}, "use_single_layer": {"a": 1}, "source_use": []}',
     '{"use_nodes": "no", "use_compositing": [], "../": "x"}'],
)  # fmt: skip
def test_a_forged_memory_of_the_pipeline_does_no_harm(scene, memory):
    """What it would put back is taken from the file, as is what marks its nodes."""
    tree = compositor(scene)
    for value in (3, {"a": 1}, [1, 2], "mask"):
        node = tree.nodes.new("CompositorNodeBlur")
        node[nodes.SOURCE] = node[nodes.ROLE] = node[nodes.MUTED] = value
    scene.hybrid.restore = memory
    hybrid.enable(scene)
    assert hybrid.render(scene).image.shape == (16, 24, 4)
    hybrid.disable(scene)
    assert len(bpy.data.scenes) == 1
    assert scene.hybrid.restore == ""
    assert scene_setup.mask_layer(scene) is None


def test_temporary_files_are_this_users_only_and_removed(scene, tmp_path, monkeypatch):
    """Also when the render ends by an error; and a link that was laid in the way is not followed."""
    from hybrid_addon.blender import files as own

    with pytest.raises(RuntimeError), own.scratch() as name:
        assert Path(name).parent == Path(bpy.app.tempdir)
        assert re.fullmatch(r"hybrid_\w+\.exr", Path(name).name)
        assert os.name == "nt" or Path(name).stat().st_mode & 0o077 == 0
        raise RuntimeError
    assert not Path(name).exists()
    victim, picture = tmp_path / "victim", tmp_path / "o.png"
    victim.write_text("mine")
    picture.symlink_to(victim)
    with own.atomic(picture) as part:
        Path(part).write_text("new")
    assert (victim.read_text(), picture.read_text(), picture.is_symlink()) == ("mine", "new", False)


def ladder(tree, kind, first, steps):
    """Nodes that all take the one before twice: 2 ** steps ways lead through them."""
    last = first
    for _ in range(steps):
        node = tree.nodes.new(kind)
        for socket in list(node.inputs)[:2]:
            tree.links.new(socket, last)
        last = node.outputs[0]
    return last


def circle(tree, kind):
    """Two nodes that take nothing but one another."""
    a, b = tree.nodes.new(kind), tree.nodes.new(kind)
    for node, other in ((a, b), (b, a)):
        for socket in list(node.inputs)[:2]:
            tree.links.new(socket, other.outputs[0])
    return a.outputs[0]


@pytest.mark.parametrize("build", [ladder, circle])
@pytest.mark.parametrize("where", ["number", "surface", "volume"])
def test_nodes_that_branch_without_end_end(scene, build, where):
    material = bpy.data.objects["Cube"].data.materials[0]
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    first = {"number": ("ShaderNodeTexChecker", 1), "surface": ("ShaderNodeBsdfDiffuse", 0),
             "volume": ("ShaderNodeVolumeAbsorption", 0)}[where]  # fmt: skip
    kind = "ShaderNodeMath" if where == "number" else "ShaderNodeAddShader"
    end = circle(tree, kind) if build is circle else ladder(tree, kind, tree.nodes.new(first[0]).outputs[first[1]], 31)
    to = {"number": shader.inputs["Roughness"], "surface": output.inputs["Surface"], "volume": output.inputs["Volume"]}
    tree.links.new(to[where], end)
    assert hybrid.render(scene).image.shape == (16, 24, 4)


def test_marks_of_ours_on_what_is_the_users(scene):
    """A file may call anything ours: none of it goes, nothing fails."""
    layer = scene.view_layers[0]
    layer["hybrid_mask"] = layer["hybrid_source"] = scene["hybrid_trace"] = True
    hybrid.enable(scene)
    assert hybrid.render(scene).image.shape == (16, 24, 4)
    hybrid.disable(scene)
    assert list(bpy.data.scenes) == [scene]
    assert list(scene.view_layers) == [layer]
