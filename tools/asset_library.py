# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the asset library that the extension brings: twenty materials, three light rigs, a preview of each (CC0).

    python -m tools.asset_library       (Blender 4.5: both Blenders can open what it writes)

Where the numbers are from: IOR at 589 nm, 20 C (M. Polyanskiy, refractiveindex.info; gems: gemmological tables);
metals' reflectance at normal incidence, linear sRGB (S. Lagarde, Feeding a Physically Based Shading Model, 2011);
absorption of water in 1/m (Pope and Fry 1997, at 650, 550 and 450 nm). Other absorptions are chosen by eye.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

import hybrid_addon as hybrid

FOLDER = Path(hybrid.__file__).parent / "assets"
SIZE, SAMPLES = 96, 6
CATALOGS = {
    "Hybrid/Metals": "5d0f2bb2-1f0a-4d6e-9c52-7a1d5a1f0001",
    "Hybrid/Glass and Liquids": "5d0f2bb2-1f0a-4d6e-9c52-7a1d5a1f0002",
    "Hybrid/Gems": "5d0f2bb2-1f0a-4d6e-9c52-7a1d5a1f0003",
    "Hybrid/Paints": "5d0f2bb2-1f0a-4d6e-9c52-7a1d5a1f0004",
    "Hybrid/Light Rigs": "5d0f2bb2-1f0a-4d6e-9c52-7a1d5a1f0005",
}
RGB = tuple[float, float, float]
WHITE: RGB = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Recipe:
    """One material, by the inputs of Principled. absorption: 1/m; dispersion: 20 / Abbe number; about: a line."""

    name: str
    catalog: str
    about: str
    color: tuple[float, ...] = WHITE
    metallic: float = 0.0
    transmission: float = 0.0
    roughness: float = 0.0
    ior: float = 1.5
    coat: float = 0.0
    anisotropic: float = 0.0
    absorption: RGB | None = None
    dispersion: float = 0.0
    size: float = 1.0  # of the preview's ball, m: absorption is per metre


def metal(name: str, color: RGB, roughness: float = 0.0, anisotropic: float = 0.0, about: str = "") -> Recipe:
    """A metal by its measured reflectance."""
    about = about or "Polished; reflectance measured"
    return Recipe(name, "Hybrid/Metals", about, color, 1.0, roughness=roughness, anisotropic=anisotropic)


def clear(name: str, ior: float, about: str, absorption: RGB | None = None, roughness: float = 0.0,
          dispersion: float = 0.0, catalog: str = "Hybrid/Glass and Liquids", size: float = 1.0) -> Recipe:  # fmt: skip
    """Something that light goes through."""
    return Recipe(name, catalog, about, transmission=1.0, roughness=roughness, ior=ior, absorption=absorption,
                  dispersion=dispersion, size=size)  # fmt: skip


MATERIALS = (
    metal("Mirror", (0.972, 0.960, 0.915), about="Silver, as behind the glass of a mirror"),
    metal("Chrome", (0.550, 0.556, 0.554)),
    metal("Gold", (1.0, 0.766, 0.336)),
    metal("Copper", (0.955, 0.637, 0.538)),
    metal("Brushed Steel", (0.562, 0.565, 0.578), 0.3, 0.7, "Iron's reflectance, brushed along the tangent"),
    metal("Satin Aluminium", (0.913, 0.921, 0.925), 0.25, about="Sandblasted; reflectance measured"),
    clear("Glass", 1.5168, "Crown glass (BK7): IOR and Abbe number 64.2 measured", dispersion=0.3115),
    clear("Window", 1.52, "Float glass, a little green at its edge: give panes both faces", (3.0, 1.0, 1.8), size=0.1),
    clear("Frosted", 1.5168, "Etched glass, roughness 0.35: Rough Samples 4 for a calm picture", roughness=0.35),
    clear("Acrylic", 1.4905, "Plexiglas: IOR and Abbe number 57.4 measured", dispersion=0.348),
    clear("Water", 1.333, "IOR and absorption measured: blue only in metres of it", (0.340, 0.0565, 0.0092)),
    clear("Ice", 1.309, "Clear ice: IOR measured; absorption as water's", (0.340, 0.0565, 0.0092), 0.03),
    clear("Red Wine", 1.344, "IOR measured; deep red in a glass of 7 cm", (4.0, 130.0, 90.0), size=0.06),
    clear("Honey", 1.487, "IOR measured at 20 % water", (2.0, 18.0, 140.0), size=0.05),
    clear("Diamond", 2.417, "IOR and Abbe number 55 measured", dispersion=0.362, catalog="Hybrid/Gems"),
    clear("Ruby", 1.766, "IOR measured; for a stone of 1 cm", (8.0, 280.0, 200.0), catalog="Hybrid/Gems", size=0.01),
    clear(
        "Sapphire", 1.766, "IOR measured; for stones of 1 cm", (230.0, 130.0, 12.0), catalog="Hybrid/Gems", size=0.01
    ),
    clear("Emerald", 1.577, "IOR measured; for stones of 1 cm", (220.0, 20.0, 130.0), catalog="Hybrid/Gems", size=0.01),
    Recipe(
        "Car Paint", "Hybrid/Paints", "Red paint under a clear coat", (0.35, 0.012, 0.012), roughness=0.45, coat=1.0
    ),
    Recipe(
        "Piano Lacquer", "Hybrid/Paints", "Black under a clear coat", (0.004, 0.004, 0.004), roughness=0.3, coat=1.0
    ),
)


def material(recipe: Recipe) -> bpy.types.Material:
    """Its nodes: Principled, and an absorbing volume."""
    b_material = bpy.data.materials.new(recipe.name)
    b_material.use_nodes = True
    tree = b_material.node_tree
    inputs = tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*recipe.color, 1.0)
    for socket, value in (
        ("Metallic", recipe.metallic),
        ("Transmission Weight", recipe.transmission),
        ("Roughness", recipe.roughness),
        ("IOR", recipe.ior),
        ("Coat Weight", recipe.coat),
        ("Anisotropic", recipe.anisotropic),
    ):
        inputs[socket].default_value = value
    if recipe.transmission:
        b_material.use_raytrace_refraction = True  # for EEVEE, where it draws the object
    if recipe.absorption:
        densest = max(recipe.absorption)
        volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
        volume.location = (0, -420)
        volume.inputs["Density"].default_value = densest  # EEVEE's and Cycles' rule: density (1 - colour), 1/m
        volume.inputs["Color"].default_value = (*(1 - a / densest for a in recipe.absorption), 1.0)
        tree.links.new(volume.outputs["Volume"], tree.nodes["Material Output"].inputs["Volume"])
    b_material.hybrid.dispersion = recipe.dispersion
    return b_material


RIGS: dict[str, tuple[str, Sequence[tuple[str, RGB, RGB, tuple[float, float], float]]]] = {
    # light: name, place, what it looks at, size in m, power in W
    "Softboxes": (
        "A large softbox, a fill and a rim light around the origin, for a product of 0.5 to 2 m",
        (
            ("Key", (-2.5, -2.5, 3.0), (0, 0, 0.5), (2.0, 2.0), 350.0),
            ("Fill", (3.0, -2.0, 1.5), (0, 0, 0.5), (1.5, 2.5), 90.0),
            ("Rim", (0.5, 3.5, 2.5), (0, 0, 0.5), (0.4, 2.5), 160.0),
        ),
    ),
    "Jewellery": (
        "Two strips and six small lights that sparkle in facets, for stones and rings at the origin",
        (
            ("Strip Left", (-1.2, -0.6, 0.9), (0, 0, 0.1), (0.15, 1.2), 30.0),
            ("Strip Right", (1.2, -0.6, 0.9), (0, 0, 0.1), (0.15, 1.2), 30.0),
            *(
                (f"Spark {i}", (np.cos(i * 1.05) * 0.9, np.sin(i * 1.05) * 0.9, 1.3), (0, 0, 0), (0.06, 0.06), 6.0)
                for i in range(6)
            ),
        ),
    ),
    "Car Studio": (
        "A light tent's roof and two long strips, whose reflections draw the lines of a body of 4 m",
        (
            ("Roof", (0.0, 0.0, 4.5), (0, 0, 0), (6.0, 3.0), 700.0),
            ("Strip Left", (-4.5, 0.0, 1.8), (0, 0, 0.6), (6.0, 0.5), 260.0),
            ("Strip Right", (4.5, 0.0, 1.8), (0, 0, 0.6), (6.0, 0.5), 260.0),
        ),
    ),
}


def rig(name: str) -> bpy.types.Collection:
    """A collection of area lights."""
    collection = bpy.data.collections.new(name)
    for light_name, place, target, (width, height), power in RIGS[name][1]:
        b_light = bpy.data.lights.new(f"{name} {light_name}", "AREA")
        b_light.shape, b_light.size, b_light.size_y, b_light.energy = "RECTANGLE", width, height, power
        b_object = bpy.data.objects.new(b_light.name, b_light)
        b_object.location = place
        toward = np.subtract(target, place)
        b_object.rotation_euler = (
            np.arctan2(np.hypot(toward[0], toward[1]), -toward[2]),
            0.0,
            np.arctan2(-toward[0], toward[1]),
        )
        collection.objects.link(b_object)
    return collection


def stage() -> tuple[bpy.types.Scene, bpy.types.Object, bpy.types.Collection]:
    """A ball on a chequered floor, and two lamps; all of it traced."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    hybrid.register()
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.5, location=(0, 0, 0.5))
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_plane_add(size=12)
    floor = bpy.data.materials.new("Floor")
    floor.use_nodes = True
    checker = floor.node_tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 48.0
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = (0.55,) * 4, (0.25,) * 4
    bsdf = floor.node_tree.nodes["Principled BSDF"]
    bsdf.inputs["Roughness"].default_value = 1.0
    floor.node_tree.links.new(checker.outputs["Color"], bsdf.inputs["Base Color"])
    bpy.context.object.data.materials.append(floor)
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.12, 0.13, 0.15, 1)
    bpy.ops.object.camera_add(location=(0, -2.6, 1.15), rotation=(1.33, 0, 0))
    scene.camera = bpy.context.object
    scene.camera.data.lens = 62
    lamps = rig("Softboxes")
    scene.collection.children.link(lamps)
    return scene, ball, lamps


def preview(scene: bpy.types.Scene, b_id: bpy.types.ID) -> None:
    """What the scene shows now becomes the datablock's preview."""
    found = hybrid.render(scene, mode="full", samples=SAMPLES, resolution=(SIZE, SIZE)).image
    light = np.clip(found[..., :3] * 0.9, 0.0, 1.0)
    light = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    pixels = np.dstack([light, np.ones_like(light[..., :1])]).astype(np.float32)
    b_id.preview_ensure().image_size = (SIZE, SIZE)
    b_id.preview.image_pixels_float = pixels.ravel()


def marked(b_id: bpy.types.ID, catalog: str, about: str) -> bpy.types.ID:
    """The datablock as an asset."""
    b_id.asset_mark()
    data = b_id.asset_data
    data.catalog_id, data.description, data.license = CATALOGS[catalog], about, "CC0-1.0"
    data.author = "The Hybrid Ray Tracing developers"
    data.tags.new("Hybrid")
    return b_id


def main() -> None:
    """Write the library and its catalogues."""
    scene, ball, lamps = stage()
    assets: set[bpy.types.ID] = set()
    for recipe in MATERIALS:
        b_material = material(recipe)
        ball.data.materials.clear()
        ball.data.materials.append(b_material)
        assets.add(marked(b_material, recipe.catalog, recipe.about))
        volume = b_material.node_tree.nodes.get("Volume Absorption")
        density = volume.inputs["Density"].default_value if volume else 0.0
        if volume:
            volume.inputs["Density"].default_value = density * recipe.size
        preview(scene, b_material)
        if volume:
            volume.inputs["Density"].default_value = density
        print(recipe.name, flush=True)
    scene.collection.children.unlink(lamps)
    ball.data.materials.clear()
    ball.data.materials.append(bpy.data.materials["Car Paint"])
    for name, (about, _) in RIGS.items():
        collection = lamps if name == lamps.name else rig(name)
        scene.collection.children.link(collection)
        assets.add(marked(collection, "Hybrid/Light Rigs", about))
        preview(scene, collection)
        scene.collection.children.unlink(collection)
        print(name, flush=True)
    FOLDER.mkdir(exist_ok=True)
    bpy.data.libraries.write(str(FOLDER / "hybrid_assets.blend"), assets, fake_user=True, compress=True)
    lines = [f"{key}:{path}:{path.replace('/', '-')}" for path, key in CATALOGS.items()]
    head = "# Asset catalogues of Hybrid Ray Tracing, made by tools/asset_library.py\nVERSION 1\n\n"
    (FOLDER / "blender_assets.cats.txt").write_text(head + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
