"""What scenes that are measured are made of: an empty file, objects, materials, cameras."""

from __future__ import annotations

import runpy
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..datasets.camera import PinholeCamera
from ..scene.readers.pinhole import pinhole_of
from .runner import ROOT

type Paint = Sequence[float] | bpy.types.Material


def new_file(size: tuple[int, int] | None = None) -> bpy.types.Scene:
    """Return the scene of an empty file, whose pictures have a size in pixels."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.context.scene if size is None else sized(size)


def sized(size: Sequence[int]) -> bpy.types.Scene:
    """Set the size of the open scene's pictures; a pixel of Cycles shows its own square alone."""
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    scene.cycles.pixel_filter_type = "BOX"
    return scene


def example(file: Path, name: str, detail: str, *options: str) -> Path:
    """Return the file of an example scene; it is built if it is not there."""
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        build = runpy.run_path(str(ROOT / "examples" / "build_scene.py"))["main"]
        build([name, str(file), "--detail", detail, *options])
    return file


def block(
    name: str, at: Sequence[float], size: Sequence[float], colour: Paint,
    turn: float = 0.0,
) -> None:  # fmt: skip
    """Add a box of a colour or a material, turned about z by degrees."""
    rotation = (0.0, 0.0, np.radians(turn))
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=at, rotation=rotation)
    item = bpy.context.object
    item.name, item.scale = name, size
    item.data.materials.append(matt(colour))


def ground(z: float, colour: Paint, size: float = 400.0) -> None:
    """Add a plane of a colour or a material."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0.0, 0.0, z))
    bpy.context.object.data.materials.append(matt(colour))


def ball(
    at: Sequence[float], radius: float | Sequence[float], colour: Paint,
    turn: float = 0.0,
) -> None:  # fmt: skip
    """Add a ball or an ellipsoid of a colour or a material."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=at, segments=64, ring_count=32)
    item = bpy.context.object
    item.scale, item.rotation_euler.z = np.broadcast_to(radius, 3), turn
    item.data.shade_smooth()
    item.data.materials.append(matt(colour))


def post(
    at: Sequence[float], radius: float, length: float, colour: Paint, tilt: float = 0.0
) -> None:
    """Add a cylinder of a colour or a material, tilted about y by an angle in rad."""
    bpy.ops.mesh.primitive_cylinder_add(
        radius=radius, depth=length, location=at, vertices=48, rotation=(0.0, tilt, 0.0)
    )
    mesh = bpy.context.object.data
    mesh.materials.append(matt(colour))
    for face in mesh.polygons:
        face.use_smooth = len(face.vertices) == 4


def matt(colour: Paint) -> bpy.types.Material:
    """Make a Lambertian material; one that is made already stays."""
    made = isinstance(colour, bpy.types.Material)
    return colour if made else material("BsdfDiffuse", Color=colour)


def material(
    shader: str, distribution: str = "", **values: float | Sequence[float]
) -> bpy.types.Material:
    """Make a material of one shader; values of its sockets, with _ for blanks."""
    made = bpy.data.materials.new(shader)
    tree = made.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(f"ShaderNode{shader}")
    if distribution:
        node.distribution = distribution
    for name, value in values.items():
        socket = node.inputs[name.replace("_", " ")]
        socket.default_value = value if np.isscalar(value) else (*value, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return made


def camera_at(
    at: Sequence[float], turn: Sequence[float], angle: float, name: str = "camera"
) -> bpy.types.Object:
    """Add a camera of a width in rad, turned from straight down by angles in rad; it is used."""
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.location, camera.rotation_euler, camera.data.angle = at, turn, angle
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    return camera


def look_at(
    at: Sequence[float], target: Sequence[float], angle: float = np.radians(70.0)
) -> bpy.types.Object:
    """Add a camera of a width in rad that looks at a place; it is used."""
    look = Vector(target) - Vector(at)
    return camera_at(at, look.to_track_quat("-Z", "Y").to_euler(), angle)


def depth_of(camera: bpy.types.Object) -> float:
    """Depth of a camera, m; 0 above the water."""
    bpy.context.view_layer.update()
    return max(-float(camera.matrix_world.translation.z), 0.0)


def view_rays(camera: bpy.types.Object, finer: int = 1) -> NDArray[np.float64]:
    """Unit directions of the pixels of a camera's picture, or of so many parts of each a side.

    Of shape (h, w, 3), in the scene's axes.
    """
    scene = bpy.context.scene
    whole = pinhole_of(scene, camera)
    f, c = (finer * np.array(x) for x in ((whole.fx, whole.fy), (whole.cx, whole.cy)))
    fine = PinholeCamera(finer * whole.width, finer * whole.height, *f, *c)
    bpy.context.view_layer.update()
    return fine.rays() * (1.0, -1.0, -1.0) @ np.array(camera.matrix_world.to_3x3()).T
