# ruff: noqa: E501
"""What users give objects: a row for each kind of material and of object that is compared.

Each row puts one object, about .7 m across, on the ground at a place. Those of :data:`KINDS` are
compared in pictures; what is refused or only said is in the documents.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

RADIUS = 0.35
_RED, _GREEN, _GREY, _WHITE = (0.6, 0.08, 0.05), (0.1, 0.4, 0.12), (0.4, 0.4, 0.4), (0.9, 0.9, 0.9)
_GOLD = (0.9, 0.6, 0.2)

type Value = float | Sequence[float] | bpy.types.NodeSocket | str
type Values = Mapping[str, Value]
type Maker = Callable[[], bpy.types.Material]
type Shaded = tuple[bpy.types.NodeSocket, str]
type MakeObject = Callable[[bpy.types.Material | None], bpy.types.Object]


@dataclass(frozen=True)
class Kind:
    """An object that is compared.

    ``make_object`` makes the object, of ``material``; ``left_out`` tells what EEVEE does not draw, and
    says.
    """

    name: str
    material: Callable[[], bpy.types.Material | None]
    make_object: MakeObject
    left_out: bool = False


def _tree() -> tuple[bpy.types.Material, bpy.types.NodeTree, bpy.types.Node]:
    material = bpy.data.materials.new("Kind")
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def _node(tree: bpy.types.NodeTree, kind: str, **values: Value) -> bpy.types.Node:
    """Add a node; values of its inputs by name, with _ for blanks, or of its properties."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in values.items():
        socket = next((i for i in node.inputs if i.name == name.replace("_", " ")), None)
        if socket is None:
            setattr(node, name, value)
        elif isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        elif socket.type == "RGBA" and isinstance(value, Sequence):
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value
    return node


def _shader(kind: str, **values: Value) -> Maker:
    """Make a material of one shader node."""
    return _built(lambda tree: (_node(tree, kind, **values).outputs[0], "Surface"))


def _principled(**values: Value) -> Maker:
    return _shader("BsdfPrincipled", **values)


def _mixed(fraction: float, one: tuple[str, Values], other: tuple[str, Values]) -> Maker:
    def build(tree: bpy.types.NodeTree) -> Shaded:
        mix = _node(tree, "MixShader")
        mix.inputs[0].default_value = fraction
        for socket, (kind, values) in zip(mix.inputs[1:], (one, other), strict=True):
            tree.links.new(_node(tree, kind, **values).outputs[0], socket)
        return mix.outputs[0], "Surface"

    return _built(build)


def _built(build: Callable[[bpy.types.NodeTree], Shaded]) -> Maker:
    """Make a material whose output gets what is built, by the name of the output's input."""

    def make() -> bpy.types.Material:
        material, tree, output = _tree()
        socket, name = build(tree)
        tree.links.new(socket, output.inputs[name])
        return material

    return make


def _colour_straight(tree: bpy.types.NodeTree) -> Shaded:
    return _node(tree, "RGB").outputs[0], "Surface"


def _ramp(tree: bpy.types.NodeTree) -> Shaded:
    noise = _node(tree, "TexNoise", Scale=6.0)
    ramp = _node(tree, "ValToRGB")
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.45, 0.55
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (*_RED, 1), (*_GREEN, 1)
    return _node(tree, "BsdfPrincipled", Base_Color=ramp.outputs[0]).outputs[0], "Surface"


def _bumped(tree: bpy.types.NodeTree) -> Shaded:
    noise = _node(tree, "TexNoise", Scale=8.0)
    bump = _node(tree, "Bump", Height=noise.outputs[0], Strength=0.6, Distance=0.2)
    shader = _node(tree, "BsdfPrincipled", Base_Color=_GREY, Normal=bump.outputs[0])
    return shader.outputs[0], "Surface"


def _rim(kind: str) -> Callable[[bpy.types.NodeTree], Shaded]:
    def build(tree: bpy.types.NodeTree) -> Shaded:
        rim = _node(tree, kind)
        mix = _node(tree, "MixShader")
        tree.links.new(rim.outputs[0], mix.inputs[0])
        for socket, colour in zip(mix.inputs[1:], (_RED, _WHITE), strict=True):
            tree.links.new(_node(tree, "BsdfDiffuse", Color=colour).outputs[0], socket)
        return mix.outputs[0], "Surface"

    return build


def _cut_out(tree: bpy.types.NodeTree) -> Shaded:
    checker = _node(tree, "TexChecker", Scale=6.0)
    shader = _node(tree, "BsdfPrincipled", Base_Color=_GREEN, Alpha=checker.outputs[1])
    return shader.outputs[0], "Surface"


def _leaf(tree: bpy.types.NodeTree) -> Shaded:
    """Diffuse and translucent, cut out, as foliage of model libraries is."""
    checker = _node(tree, "TexChecker", Scale=4.0)
    mix, cut = _node(tree, "MixShader"), _node(tree, "MixShader")
    mix.inputs[0].default_value = 0.4
    for socket, kind in zip(mix.inputs[1:], ("BsdfDiffuse", "BsdfTranslucent"), strict=True):
        tree.links.new(_node(tree, kind, Color=_GREEN).outputs[0], socket)
    tree.links.new(checker.outputs[1], cut.inputs[0])
    tree.links.new(_node(tree, "BsdfTransparent").outputs[0], cut.inputs[1])
    tree.links.new(mix.outputs[0], cut.inputs[2])
    return cut.outputs[0], "Surface"


def _displaced() -> bpy.types.Material:
    material, tree, output = _tree()
    noise = _node(tree, "TexNoise", Scale=5.0)
    moved = _node(tree, "Displacement", Height=noise.outputs[0], Scale=0.2)
    tree.links.new(moved.outputs[0], output.inputs["Displacement"])
    tree.links.new(_node(tree, "BsdfPrincipled").outputs[0], output.inputs["Surface"])
    material.displacement_method = "BOTH"
    return material


def _smoke(kind: str, **values: Value) -> Maker:
    return _built(lambda tree: (_node(tree, kind, **values).outputs[0], "Volume"))


def _linked(mesh_or_curve: bpy.types.ID, material: bpy.types.Material | None) -> bpy.types.Object:
    item = bpy.data.objects.new("Kind", mesh_or_curve)
    bpy.context.scene.collection.objects.link(item)
    if material is not None:
        item.data.materials.append(material)
    return item


def _mesh(shape: str, *, smooth: bool = True, **sizes: float) -> bpy.types.Mesh:
    """Make one of bmesh's shapes."""
    import bmesh  # exists once bpy is loaded

    mesh, built = bpy.data.meshes.new("Kind"), bmesh.new()
    getattr(bmesh.ops, f"create_{shape}")(built, **sizes)
    built.to_mesh(mesh)
    built.free()
    if smooth:
        mesh.shade_smooth()
    return mesh


def _round(radius: float = RADIUS, finer: int = 5) -> bpy.types.Mesh:
    return _mesh("icosphere", subdivisions=finer, radius=radius)


def sphere(material: bpy.types.Material | None) -> bpy.types.Object:
    """A ball."""
    return _linked(_round(), material)


def cube(material: bpy.types.Material | None) -> bpy.types.Object:
    """A box with sharp edges."""
    mesh = _mesh("cube", size=1.2 * RADIUS, smooth=False)
    return _linked(mesh, material)


def panel(material: bpy.types.Material | None) -> bpy.types.Object:
    """A sheet without thickness that leans back."""
    mesh = _mesh("grid", x_segments=1, y_segments=1, size=RADIUS, smooth=False)
    mesh.transform(Matrix.Rotation(math.radians(55.0), 4, "X"))
    mesh.uv_layers.new()
    return _linked(mesh, material)


def slab(material: bpy.types.Material | None) -> bpy.types.Object:
    """A pane with thickness."""
    mesh = _mesh("cube", size=2.0 * RADIUS, smooth=False)
    mesh.transform(Matrix.Rotation(math.radians(55.0), 4, "X") @ Matrix.Diagonal((1, 1, 0.08, 1)))
    return _linked(mesh, material)


def _text(material: bpy.types.Material | None) -> bpy.types.Object:
    curve = bpy.data.curves.new("Kind", "FONT")
    curve.body, curve.size, curve.extrude = "R", 0.9, 0.08
    curve.align_x = curve.align_y = "CENTER"
    item = _linked(curve, material)
    item.rotation_euler.x = math.radians(55.0)
    return item


def _nurbs(material: bpy.types.Material | None) -> bpy.types.Object:
    curve = bpy.data.curves.new("Kind", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.08
    spline = curve.splines.new("NURBS")
    spline.points.add(5)
    for number, point in enumerate(spline.points):
        angle = number * math.pi / 3.0
        point.co = (0.25 * math.cos(angle), 0.25 * math.sin(angle), 0.05 * number - 0.1, 1.0)
    spline.use_cyclic_u = True
    return _linked(curve, material)


def _metaball(material: bpy.types.Material | None) -> bpy.types.Object:
    ball = bpy.data.metaballs.new("Kind")
    ball.resolution = ball.render_resolution = 0.05
    ball.elements.new().radius = 1.5 * RADIUS
    return _linked(ball, material)


def _even(count: int) -> NDArray[np.float64]:
    """Directions that are spread evenly, shape (count, 3)."""
    i = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * i / count, i * math.pi * (3.0 - math.sqrt(5.0))
    return np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], -1)


def _hair(count: int, length: float, radius: float) -> MakeObject:
    """Return what makes curves that stand on a ball."""

    def make(material: bpy.types.Material | None) -> bpy.types.Object:
        hair = bpy.data.hair_curves.new("Kind")
        points = 4
        hair.add_curves([points] * count)
        out = _even(count)
        along = np.linspace(RADIUS - length, RADIUS, points)
        places = out[:, None, :] * along[None, :, None]
        places[..., 2] -= 0.1 * np.linspace(0.0, 1.0, points) ** 2 * length / 0.1
        hair.points.foreach_set("position", places.astype(np.float32).ravel())
        radii = hair.attributes.get("radius") or hair.attributes.new("radius", "FLOAT", "POINT")
        radii.data.foreach_set("value", np.full(count * points, radius, np.float32))
        return _linked(hair, material)

    return make


def _particle_hair(material: bpy.types.Material | None) -> bpy.types.Object:
    item = _linked(_round(RADIUS - 0.15, 3), material)
    item.modifiers.new("Hair", "PARTICLE_SYSTEM")
    settings = item.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 3000, 0.15
    settings.root_radius, settings.tip_radius, settings.radius_scale = 1.0, 0.5, 0.01
    settings.material = 1
    return item


def _points(material: bpy.types.Material | None) -> bpy.types.Object:
    cloud = bpy.data.pointclouds.new("Kind")
    count = 400
    cloud.resize(count)
    cloud.points.foreach_set("co", (0.3 * _even(count)).astype(np.float32).ravel())
    cloud.points.foreach_set("radius", np.full(count, 0.035, np.float32))
    return _linked(cloud, material)


def _nodes(
    item: bpy.types.Object, build: Callable[[bpy.types.NodeTree], bpy.types.NodeSocket]
) -> bpy.types.Object:
    tree = bpy.data.node_groups.new("Kind", "GeometryNodeTree")
    tree.is_modifier = True
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    tree.links.new(build(tree), tree.nodes.new("NodeGroupOutput").inputs[0])
    item.modifiers.new("Nodes", "NODES").node_group = tree
    return item


def _instances(material: bpy.types.Material | None) -> bpy.types.Object:
    """Balls that geometry nodes put on a ball."""

    def build(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        start = tree.nodes.new("NodeGroupInput")
        on = tree.nodes.new("GeometryNodeInstanceOnPoints")
        ball = tree.nodes.new("GeometryNodeMeshIcoSphere")
        ball.inputs["Radius"].default_value, ball.inputs["Subdivisions"].default_value = 0.06, 3
        sets = tree.nodes.new("GeometryNodeSetMaterial")
        sets.inputs["Material"].default_value = material
        tree.links.new(ball.outputs["Mesh"], sets.inputs["Geometry"])
        tree.links.new(start.outputs[0], on.inputs["Points"])
        tree.links.new(sets.outputs[0], on.inputs["Instance"])
        return on.outputs[0]

    mesh = _mesh("icosphere", subdivisions=2, radius=0.28)
    return _nodes(_linked(mesh, None), build)


def _collection_instance(material: bpy.types.Material | None) -> bpy.types.Object:
    group = bpy.data.collections.new("Kind")
    inner = bpy.data.objects.new("Inner", _round(0.5 * RADIUS))
    inner.data.materials.append(material)
    group.objects.link(inner)
    item = bpy.data.objects.new("Kind", None)
    item.instance_type, item.instance_collection, item.scale = "COLLECTION", group, (2.0, 2.0, 2.0)
    bpy.context.scene.collection.objects.link(item)
    return item


def _shape_key(material: bpy.types.Material | None) -> bpy.types.Object:
    item = sphere(material)
    item.shape_key_add(name="Basis")
    key = item.shape_key_add(name="Flat")
    for point in key.data:
        point.co.x *= 0.5
    key.value = 1.0
    return item


def _armature(material: bpy.types.Material | None) -> bpy.types.Object:
    item = sphere(material)
    bones = bpy.data.armatures.new("Kind")
    frame = bpy.data.objects.new("Kind", bones)
    bpy.context.scene.collection.objects.link(frame)
    bpy.context.view_layer.objects.active = frame
    bpy.ops.object.mode_set(mode="EDIT")
    bone = bones.edit_bones.new("Bone")
    bone.head, bone.tail = (0.0, 0.0, 0.0), (0.0, 0.0, 0.3)
    bpy.ops.object.mode_set(mode="OBJECT")
    frame.pose.bones["Bone"].scale = (0.6, 1.0, 0.6)
    item.parent = frame
    item.modifiers.new("Armature", "ARMATURE").object = frame
    item.vertex_groups.new(name="Bone").add(range(len(item.data.vertices)), 1.0, "REPLACE")
    return frame


def _solid(modifier: str) -> MakeObject:
    def make(material: bpy.types.Material | None) -> bpy.types.Object:
        item = sphere(material)
        item.modifiers.new("Modifier", modifier)
        return item

    return make


def _relief(material: bpy.types.Material | None) -> bpy.types.Object:
    """Coarse and smooth, where shadows end on triangles."""
    return _linked(_round(finer=2), material)


def _named_attribute(tree: bpy.types.NodeTree) -> Shaded:
    colour = _node(tree, "VertexColor", layer_name="Paint").outputs["Color"]
    return _node(tree, "BsdfPrincipled", Base_Color=colour).outputs[0], "Surface"


def _painted(material: bpy.types.Material | None) -> bpy.types.Object:
    item = sphere(material)
    paint = item.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    for vertex, value in zip(item.data.vertices, paint.data, strict=True):
        value.color = (*(_RED if vertex.co.x < 0.0 else _GREEN), 1.0)
    return item


def _none() -> None:
    return None


KINDS = (
    Kind("diffuse", _shader("BsdfDiffuse", Color=_RED), sphere),
    Kind("diffuse, rough", _shader("BsdfDiffuse", Color=_RED, Roughness=1.0), sphere),
    Kind("principled, default", _principled(), sphere),
    Kind("principled, dark", _principled(Base_Color=(0.02, 0.02, 0.02)), sphere),
    Kind("principled, white", _principled(Base_Color=_WHITE), cube),
    Kind("no material", _none, sphere),
    Kind("glossy .1", _shader("BsdfAnisotropic", Color=_WHITE, Roughness=0.1), sphere),
    Kind("glossy .4", _shader("BsdfAnisotropic", Color=_WHITE, Roughness=0.4), sphere),
    Kind("anisotropic", _shader("BsdfAnisotropic", Color=_GOLD, Roughness=0.3, Anisotropy=0.8), sphere),
    Kind("principled, metal .3", _principled(Base_Color=_GOLD, Metallic=1.0, Roughness=0.3), sphere),
    Kind("metallic .3", _shader("BsdfMetallic", Base_Color=_GOLD, Roughness=0.3), sphere),
    Kind("metal plate .2", _principled(Base_Color=_WHITE, Metallic=1.0, Roughness=0.2), panel),
    Kind("plastic .1", _principled(Base_Color=_RED, Roughness=0.1), sphere),
    Kind("plastic .4", _principled(Base_Color=_RED, Roughness=0.4), sphere),
    Kind("plastic, IOR 2", _principled(Base_Color=_RED, Roughness=0.2, IOR=2.0), sphere),
    Kind("coat", _principled(Base_Color=_RED, Coat_Weight=1.0), sphere),
    Kind("coat, tinted", _principled(Base_Color=_WHITE, Coat_Weight=1.0, Coat_Tint=_GOLD), sphere),
    Kind("sheen, principled", _principled(Base_Color=_RED, Sheen_Weight=1.0), sphere),
    Kind("sheen", _shader("BsdfSheen", Color=_WHITE), sphere),
    Kind("thin film", _principled(Metallic=1.0, Thin_Film_Thickness=500.0, Roughness=0.3), sphere),
    Kind("toon", _shader("BsdfToon", Color=_RED), sphere),
    Kind("translucent", _shader("BsdfTranslucent", Color=_GREEN), panel),
    Kind("translucent ball", _shader("BsdfTranslucent", Color=_GREEN), sphere),
    Kind("leaf, cut out", _built(_leaf), panel),
    Kind("subsurface", _shader("SubsurfaceScattering", Color=_RED, Scale=0.05), sphere),
    Kind("subsurface, principled", _principled(Base_Color=_RED, Subsurface_Weight=1.0, Subsurface_Scale=0.05), sphere),
    Kind("glass ball", _shader("BsdfGlass", Color=_WHITE, Roughness=0.0, IOR=1.5), sphere),
    Kind("glass pane", _shader("BsdfGlass", Color=_WHITE, Roughness=0.0, IOR=1.5), slab),
    Kind("glass, rough", _shader("BsdfGlass", Color=_WHITE, Roughness=0.3, IOR=1.5), sphere),
    Kind("refraction", _shader("BsdfRefraction", Color=_WHITE, Roughness=0.0, IOR=1.5), sphere),
    Kind("transmission", _principled(Base_Color=_GREEN, Transmission_Weight=1.0, Roughness=0.0), sphere),
    Kind("transmission pane", _principled(Base_Color=_WHITE, Transmission_Weight=1.0, Roughness=0.0), slab),
    Kind("jelly, thin", _principled(Base_Color=_WHITE, Transmission_Weight=0.8, Roughness=0.2, IOR=1.35), panel),
    Kind("alpha .5", _principled(Base_Color=_RED, Alpha=0.5), panel),
    Kind("alpha, cut out", _built(_cut_out), panel),
    Kind("transparent, tinted", _shader("BsdfTransparent", Color=_GREEN), panel),
    Kind("half transparent", _mixed(0.5, ("BsdfTransparent", {}), ("BsdfDiffuse", {"Color": _RED})), sphere),
    Kind("emission", _shader("Emission", Color=_GREEN, Strength=0.02), sphere),
    Kind("emission, principled", _principled(Base_Color=_RED, Emission_Color=_GREEN, Emission_Strength=0.02), sphere),
    Kind("diffuse and glossy", _mixed(0.3, ("BsdfDiffuse", {"Color": _RED}), ("BsdfAnisotropic", {"Color": _WHITE, "Roughness": 0.2})), sphere),
    Kind("colour into surface", _built(_colour_straight), sphere),
    Kind("noise and ramp", _built(_ramp), sphere),
    Kind("bump", _built(_bumped), sphere),
    Kind("fresnel", _built(_rim("Fresnel")), sphere),
    Kind("layer weight", _built(_rim("LayerWeight")), sphere),
    Kind("displacement", _displaced, sphere),
    Kind("painted vertices", _built(_named_attribute), _painted),
    Kind("coarse and smooth", _principled(Base_Color=_GREY, Roughness=1.0), _relief),
    Kind("hair BSDF", _shader("BsdfHair", Color=_GOLD), _hair(3000, 0.2, 0.004)),
    Kind("hair, principled", _shader("BsdfHairPrincipled", Color=_GOLD), _hair(3000, 0.2, 0.004)),
    Kind("hair, diffuse", _shader("BsdfDiffuse", Color=_GOLD), _hair(3000, 0.2, 0.004)),
    Kind("hair particles", _shader("BsdfDiffuse", Color=_GOLD), _particle_hair),
    Kind("point cloud", _shader("BsdfDiffuse", Color=_RED), _points),
    Kind("instances", _shader("BsdfDiffuse", Color=_RED), _instances),
    Kind("collection", _principled(Base_Color=_RED), _collection_instance),
    Kind("text", _principled(Base_Color=_RED), _text),
    Kind("curve", _principled(Base_Color=_RED), _nurbs),
    Kind("metaball", _principled(Base_Color=_RED), _metaball),
    Kind("shape key", _principled(Base_Color=_RED), _shape_key),
    Kind("armature", _principled(Base_Color=_RED), _armature),
    Kind("smoke", _smoke("VolumePrincipled", Density=3.0, Color=_WHITE), sphere, left_out=True),
    Kind("volume, scattering", _smoke("VolumeScatter", Density=3.0, Color=_WHITE), cube, left_out=True),
    Kind("volume, absorbing", _smoke("VolumeAbsorption", Density=3.0, Color=_RED), cube, left_out=True),
    Kind("holdout", _shader("Holdout"), sphere),
    Kind("wireframe", _principled(Base_Color=_RED), _solid("WIREFRAME")),
)  # fmt: skip
"""Rows of the matrix."""


def place(kind: Kind, where: Vector) -> bpy.types.Object:
    """Put an object of a kind into the open scene, its centre at a place."""
    item = kind.make_object(kind.material())
    item.location = where
    return item
