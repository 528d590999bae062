"""What instances renders show, and lamps among them: Blender's own answer is that of a render."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector
from underwater_spectral.jobs import batch
from underwater_spectral.scene.as_rendered import as_rendered
from underwater_spectral.scene.materials import bare_surfaces
from underwater_spectral.scene.readers import cameras, lamps
from underwater_spectral.scene.readers.shown_lamps import shown_lamps
from underwater_spectral.scene.readers.visible_meshes import visible_instances
from underwater_spectral.scene.viewport import live, problems
from underwater_spectral.scene.water import scene_water
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import RELATIVE
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

pytestmark = pytest.mark.usefixtures("registered")


class _Look(bpy.types.RenderEngine):
    """Notes what there is to be rendered."""

    bl_idname, bl_label = "UNDERWATER_LOOK", "Look"
    found: list[tuple] = []  # noqa: RUF012

    def render(self, depsgraph):
        shown = (x for x in depsgraph.object_instances if x.is_instance or x.show_self)
        type(self).found = sorted(map(_row, shown))


def _row(one):
    place = tuple(round(x, 3) for x in one.matrix_world.translation)
    return one.object.name, one.object.type, one.is_instance, place


@pytest.fixture
def rendered():
    """What renders show of the scene now."""
    bpy.utils.register_class(_Look)

    def look():
        scene = bpy.context.scene
        engine, scene.render.engine = scene.render.engine, _Look.bl_idname
        scene.render.resolution_x = scene.render.resolution_y = 4
        bpy.ops.render.render()
        scene.render.engine = engine
        return _Look.found

    yield look
    bpy.utils.unregister_class(_Look)


def _add(name, data=None, parent=None, place=(0.0, 0.0, 0.0)):
    item = bpy.data.objects.new(name, data)
    item.location, item.parent = place, parent
    bpy.context.scene.collection.objects.link(item)
    return item


def _spot(name="torch"):
    light = bpy.data.lights.new(name, "SPOT")
    light.energy, light.spot_size, light.shadow_soft_size = 300.0, math.radians(90.0), 0.05
    return light


def _points(*places):
    mesh = bpy.data.meshes.new("points")
    mesh.from_pydata(places, [], [])
    return mesh


def _nodes(of_points, *, in_render_only=False):
    """Geometry nodes that show what a node of a kind makes on points."""
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end, dots, on, switch, asks = (
        tree.nodes.new(kind)
        for kind in (
            "NodeGroupInput",
            "NodeGroupOutput",
            "GeometryNodeMeshToPoints",
            "GeometryNodeInstanceOnPoints",
            "GeometryNodeSwitch",
            "GeometryNodeIsViewport",
        )
    )
    switch.input_type = "GEOMETRY"
    tree.links.new(start.outputs[0], dots.inputs[0])
    tree.links.new(dots.outputs[0], on.inputs["Points"])
    of_points(tree, on)
    if in_render_only:
        tree.links.new(asks.outputs[0], switch.inputs["Switch"])
    tree.links.new(on.outputs[0], switch.inputs["False"])
    tree.links.new(switch.outputs[0], end.inputs[0])
    return tree


def _object(item):
    def feed(tree, on):
        node = tree.nodes.new("GeometryNodeObjectInfo")
        node.inputs["As Instance"].default_value = True
        node.inputs["Object"].default_value = item
        tree.links.new(node.outputs["Geometry"], on.inputs["Instance"])

    return feed


def _collection(found):
    def feed(tree, on):
        node = tree.nodes.new("GeometryNodeCollectionInfo")
        node.inputs["Collection"].default_value = found
        tree.links.new(node.outputs[0], on.inputs["Instance"])

    return feed


PLACES = (0.0, 0.0, -1.0), (5.0, 0.0, -2.0)


def _by_nodes(item, **asked):
    made = _add("scatter", _points(*PLACES))
    made.modifiers.new("scatter", "NODES").node_group = _nodes(_object(item), **asked)
    item.hide_render = True
    return made


def _by_collection_on_points(item):
    kept = _asset(item)
    made = _add("scatter", _points(*PLACES))
    made.modifiers.new("scatter", "NODES").node_group = _nodes(_collection(kept))
    return made


def _by_collection(item):
    kept = _asset(item)
    for place in PLACES:
        made = _add("vehicle", place=place)
        made.instance_type, made.instance_collection = "COLLECTION", kept
    return made


def _asset(*items):
    kept = bpy.data.collections.new("asset")
    for item in items:
        for owner in list(item.users_collection):
            owner.objects.unlink(item)
        kept.objects.link(item)
    return kept


def _by_vertices(item):
    made = _add("holder", _points(*PLACES))
    item.parent, made.instance_type = made, "VERTS"
    return made


def _by_faces(item):
    mesh = bpy.data.meshes.new("faces")
    corners = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)]
    corners += [(x + 5, y, z - 1) for x, y, z in corners]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    made = _add("holder", mesh)
    item.parent, made.instance_type = made, "FACES"
    return made


def _by_particles(item, kind="OBJECT"):
    corners = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)]
    mesh = bpy.data.meshes.new("emitter")
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    made = _add("emitter", mesh)
    made.modifiers.new("particles", "PARTICLE_SYSTEM")
    settings = made.particle_systems[0].settings
    settings.type, settings.count, settings.render_type = "HAIR", 8, kind
    settings.use_advanced_hair, settings.particle_size = True, 1.0
    if kind == "OBJECT":
        settings.instance_object = item
    else:
        settings.instance_collection = _asset(item)
    settings.display_percentage = 50
    item.hide_render = kind == "OBJECT"
    return made


WAYS = {
    "geometry nodes": _by_nodes,
    "geometry nodes in renders only": lambda item: _by_nodes(item, in_render_only=True),
    "a collection on points": _by_collection_on_points,
    "a collection": _by_collection,
    "vertices": _by_vertices,
    "faces": _by_faces,
    "particles": _by_particles,
    "a collection of particles": lambda item: _by_particles(item, "COLLECTION"),
}


@pytest.mark.parametrize("way", WAYS)
def test_instances_are_those_of_a_render(way, rendered):
    """Whatever the viewport's switches say; afterwards all is as it was."""
    scene = bpy.context.scene
    scenes.add_camera()
    lamp, body = _add("lamp", _spot()), scenes._cube("thing", (0.0, 0.0, 0.0))
    made = WAYS[way](lamp)
    if way in ("vertices", "faces"):
        body.parent = made
        hidden = _add("hidden", _spot(), made)
        hidden.hide_render = True
    bpy.context.view_layer.update()
    for item in (lamp, made):
        item.hide_viewport = True
    made.show_instancer_for_viewport, made.show_instancer_for_render = True, False
    bpy.context.view_layer.update()
    wanted, before = rendered(), snapshot.snapshot()
    assert any(row[0] == "lamp" for row in wanted)
    with as_rendered(scene):
        found = sorted(map(_row, visible_instances(bpy.context.evaluated_depsgraph_get())))
        shining = [(one.item.name, tuple(one.place.translation)) for one in shown_lamps(scene)]
    assert found == wanted
    seen = [(name, place) for name, kind, _, place in wanted if kind == "LIGHT"]
    assert sorted(seen) == sorted(
        (name, tuple(round(x, 3) for x in place)) for name, place in shining
    )
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_instances_that_come_and_go_between_frames_light_theirs(tmp_path):
    """One lamp in the second frame, two in the others; each frame as it is by itself."""
    scene = bpy.context.scene
    scenes.add_camera((0.0, -1.0, -20.0), (math.pi / 2, 0.0, 0.0))
    scenes.wall("wall", (0.0, 4.0, -20.0), 12.0)
    lamp = _add("lamp", _spot())
    lamp.rotation_euler.x = math.pi / 2
    _by_collection(lamp)
    first, empty = (scene.objects[name] for name in ("vehicle", "vehicle.001"))
    first.location, empty.location = (-1.0, 1.0, -20.0), (1.0, 1.0, -20.0)
    for frame in (1, 2, 3):
        empty.hide_render = frame == 2
        empty.keyframe_insert("hide_render", frame=frame)
    path = str(tmp_path / "job.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    found = {}
    for frames in ("1-3", "2"):
        out = tmp_path / frames
        options = ["--engine", "cycles", "--samples", "4", "--bands", "3", "--sunlight", "0"]
        options += ["--exposure", "0", "--resolution", "16", "9", "--phase", "hg:0.8"]
        options += ["--surface", "none", "--frames", frames, "--out", str(out)]
        assert batch.main([path, *options], inside_blender=False) == 0
        found |= {(frames, f.stem): read_exr(f)[0] for f in out.glob("0*.exr")}
    all_three = [found["1-3", f"000{n}"] for n in (1, 2, 3)]
    np.testing.assert_array_equal(all_three[1], found["2", "0002"])
    assert all_three[0].mean() == pytest.approx(all_three[2].mean(), rel=0.05)
    assert all_three[1].mean() < 0.7 * all_three[0].mean()


@pytest.mark.slow
def test_a_camera_that_is_none_is_named():
    """A lamp as the active camera ended in a traceback."""
    scene = bpy.context.scene
    scenes.add_camera((0.0, 0.0, -5.0))
    for other in (_add("lamp", _spot()), _add("empty"), scenes._cube("cube", (0.0, 0.0, 0.0))):
        scene.camera = other
        with pytest.raises(InputError, match=rf"'{other.name}' as its active.*set one of Camera"):
            cameras.find_camera(scene, None)
        assert f"'{other.name}' as its active camera" in problems.problem(scene)
    live.add(scene)
    live.remove(scene)
    scene.camera = None
    with pytest.raises(InputError, match="has no active camera"):
        cameras.find_camera(scene, None)
    scene.camera = bpy.data.objects.new("elsewhere", bpy.data.cameras.new("elsewhere"))
    with pytest.raises(InputError, match="no camera 'elsewhere'"):
        cameras.find_camera(scene, None)


def _made(name, *kinds):
    """An object whose geometry nodes make points, or a cube, or cubes on points."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end, join = (
        tree.nodes.new(kind)
        for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeJoinGeometry")
    )
    for kind in kinds:
        dots = tree.nodes.new("GeometryNodeMeshToPoints")
        tree.links.new(start.outputs[0], dots.inputs[0])
        cube = tree.nodes.new("GeometryNodeMeshCube")
        on = tree.nodes.new("GeometryNodeInstanceOnPoints")
        tree.links.new(dots.outputs[0], on.inputs["Points"])
        tree.links.new(cube.outputs[0], on.inputs["Instance"])
        made = {"points": dots, "cube": cube, "cubes": on}[kind]
        tree.links.new(made.outputs[0], join.inputs[0])
    tree.links.new(join.outputs[0], end.inputs[0])
    item = _add(name, _points(*PLACES))
    item.modifiers.new(name, "NODES").node_group = tree
    return item


def test_what_geometry_nodes_make_without_a_material_gets_one_or_is_named():
    """Points were drawn dry, and glaring white."""
    points, both = _made("points", "points"), _made("both", "points", "cube")
    cubes = _made("cubes", "cubes")
    material, notes = bare_surfaces.dress(bpy.context.scene)
    (said,) = notes
    assert "'cubes'" in said
    assert "Set Material" in said
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for item in (points, both):
        geometry = item.evaluated_get(depsgraph).evaluated_geometry()
        parts = [geometry.pointcloud, *([geometry.mesh] if item == both else [])]
        for part in parts:
            assert [m.original for m in part.materials if m] == [material]
    bare_surfaces.undress([])
    assert all([m.name for m in item.modifiers] == [item.name] for item in (points, both, cubes))


@pytest.mark.parametrize("kind", ["SPOT", "AREA", "POINT"])
def test_an_instance_is_the_lamp_that_it_would_be_if_it_were_real(kind):
    """Mirrored and stretched, too; what follows it shines the same way."""
    scene = bpy.context.scene
    item = _add("lamp", bpy.data.lights.new("lamp", kind))
    item.rotation_euler = 0.9, 0.2, 0.4
    _by_collection(item)
    for name, scale in (("vehicle", (-1.0, 1.0, 1.0)), ("vehicle.001", (2.0, 2.0, 0.5))):
        empty = scene.objects[name]
        empty.scale, empty.rotation_euler.z = scale, 0.7
    bpy.context.view_layer.update()
    instanced = lamps.lamps_of(scene, Bands.uniform(3), RELATIVE)
    assert len(instanced.lamps) == len(PLACES)
    for one, lamp in zip(instanced.shown, instanced.lamps, strict=True):
        real = bpy.data.objects.new("real", item.data)
        scene.collection.objects.link(real)
        real.parent, real.rotation_euler = one.instancer, item.rotation_euler
        bpy.context.view_layer.update()
        wanted = lamps.lamps_of(scene, Bands.uniform(3), RELATIVE).lamps[0]
        assert lamp.position == pytest.approx(wanted.position)
        assert lamp.axis == pytest.approx(wanted.axis, abs=1e-3)
        assert lamp.intensity == pytest.approx(wanted.intensity, rel=1e-3)
        assert lamp.radius == pytest.approx(wanted.radius, rel=1e-3)
        follower = scene_water._follower(one.light, one, seen=True)
        shines = follower.matrix_basis.to_3x3() @ Vector((0.0, 0.0, -1.0))
        assert tuple(shines.normalized()) == pytest.approx(lamp.axis, abs=1e-3)
        bpy.data.objects.remove(real)
