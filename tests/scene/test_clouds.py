"""Clouds of a scene: in Cycles, in EEVEE, in records, and that they leave."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.datasets.layer_file import bands_name
from underwater_spectral.node_groups import cloud_grids, cloud_table, cloud_term, realtime_values
from underwater_spectral.scene import marks, stored_clouds
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.readers import clouds, volume_grids
from underwater_spectral.scene.terms.clouds import CloudTerm
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import new_clouds, realtime, scene_water, water_body
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import snapshot
from underwater_spectral.uw_spectral.clouds.cloud_light import Clouds, Several
from underwater_spectral.uw_spectral.clouds.matter import suspended_matter
from underwater_spectral.uw_spectral.clouds.solved_cloud import cloud_numbers
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

DEPTH, SIGMA = 5.0, 0.5
PLAIN = SceneSettings(
    water="jerlov:II", bands=3, samples=4, diffuse_shadows=False, scene_floor=False
)

pytestmark = pytest.mark.usefixtures("properties")


def _camera(width=32, height=20, angle=60.0):
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -DEPTH), (math.pi / 2, 0.0, 0.0)
    camera.data.clip_start, camera.data.angle = 0.01, math.radians(angle)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    return camera


def _blob(concentration=8.0, location=(0.0, 3.0, -DEPTH), constituent="minerals"):
    item = new_clouds.add_blob(bpy.context.scene, constituent)
    item.location = location
    item.underwater.concentration = concentration
    bpy.context.view_layer.update()
    return item


def _wall(distance=6.0, size=40.0, colour=0.8):
    bpy.ops.mesh.primitive_plane_add(
        size=size, location=(0.0, distance, -DEPTH), rotation=(math.pi / 2, 0.0, 0.0)
    )
    item = bpy.context.object
    material = bpy.data.materials.new("Wall")
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (colour, colour, colour, 1.0)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    item.data.materials.append(material)
    return item


def _images(engine, plan, path):
    """Render all bands; shape (height, width, n), and the notes."""
    scene = bpy.context.scene
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    render = scene.render
    image = np.zeros((render.resolution_y, render.resolution_x, len(plan.bands)))
    if engine == "cycles":
        opened = engines.cycles_bands(scene, scene.camera, plan, extent, seed=1)
    elif engine == "realtime":
        opened = engines.eevee_realtime(scene, scene.camera, plan, extent, DEPTH)
    else:
        opened = engines.eevee_bands(scene, scene.camera, plan, extent, DEPTH)
    with opened as found:
        draw = found.frame(plan, DEPTH)
        for bands in found.passes:
            draw(bands, path)
            image[..., list(bands)[:3]] = read_exr(path)[0][..., : len(bands)]
    return image, found.notes


def _plan(**changes):
    return render_plan.make_plan(replace(PLAIN, **changes))


@pytest.mark.slow
def test_what_a_cloud_lets_through_of_a_wall_is_its_transmittance(tmp_path):
    camera = _camera(angle=8.0)
    _wall()
    plan = _plan(layers="T")
    scene, extent = (
        bpy.context.scene,
        water_body.water_extent(bpy.context.scene, plan.column, DEPTH),
    )

    def drawn(concentration):
        if concentration:
            _blob(concentration)
        with engines.eevee_bands(scene, camera, plan, extent, DEPTH) as found:
            bands = found.passes[0]
            layers = found.frame(plan, DEPTH)(bands, tmp_path / "wall.exr")
        return layers.layers[bands_name("D")].values[10, 16]

    clear, veiled = drawn(0.0), drawn(1.5)
    matter = suspended_matter("minerals", 1.5, plan.bands.centres)
    wanted = np.exp(-matter.extinction * SIGMA * math.sqrt(2.0 * math.pi))
    assert veiled / clear == pytest.approx(wanted, rel=0.02)


@pytest.mark.slow
def test_nodes_do_what_numpy_does(tmp_path):
    camera = _camera()
    plan = _plan()
    clear, _ = _images("bands", plan, tmp_path / "clear.exr")
    _blob()
    seen, _ = _images("bands", plan, tmp_path / "readers.exr")
    water = eevee_water(plan, bpy.context.scene, Eye(camera, DEPTH), np.eye(3))
    ((cloud, away),) = water.term(CloudTerm).blobs
    assert away == pytest.approx(3.0)
    numbers = cloud_numbers(cloud, water.field, water.channels, away)
    for row, column in ((10, 16), (6, 12), (14, 20)):
        x = (column + 0.5) / 32 * 2 - 1
        y = (1 - (row + 0.5) / 20 * 2) * 20 / 32
        t = math.tan(math.radians(30.0))
        w = np.array([x * t, 1.0, y * t]) / math.hypot(x * t, 1.0, y * t)
        found = Clouds(Several([numbers]), [cloud.matter.phase], water.field.sun)
        s2 = np.sum((w + water.field.sun) ** 2) / 4.0
        veil = found.veil([0.0, 0.0, -DEPTH], list(w), 200.0, s2)
        light = seen[row, column] - veil.passed * clear[row, column]
        # Besides its own there is light of the water before it, less than the whole.
        before = light - veil.light
        assert np.all(before > -0.01 * clear[row, column])
        assert np.all(before < (1.0 - veil.passed) * clear[row, column] * 1.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("water", "constituent", "concentration"),
    [
        ("jerlov:IB", "minerals", 12.0),
        ("jerlov:II", "minerals", 12.0),
        ("jerlov:IB", "bubbles", 3.0),
    ],
)
def test_both_engines_draw_the_same_cloud(water, constituent, concentration, tmp_path):
    _camera(24, 16)
    plan = _plan(water=water, bands=6)
    _blob(concentration, constituent=constituent)
    eevee, _ = _images("bands", plan, tmp_path / "eevee.exr")
    cycles, _ = _images("cycles", replace(plan, settings=replace(plan.settings, samples=512)),
                        tmp_path / "cycles.exr")  # fmt: skip
    middle = np.s_[5:11, 8:16]
    # Blue and green; in red there is hardly any light.
    for band in (1, 2):
        one, other = eevee[middle][..., band].mean(), cycles[middle][..., band].mean()
        assert one == pytest.approx(other, rel=0.1)


@pytest.mark.slow
def test_a_grid_is_what_a_blob_of_its_density_is(tmp_path):
    _camera(16, 12)
    plan = _plan(bands=3, samples=512)
    blob = _blob(10.0)
    one, _ = _images("cycles", plan, tmp_path / "puff.exr")
    blob.underwater.constituent = stored_clouds.NO_CLOUD
    item = _volume_of_a_blob(blob.location)
    item.underwater.constituent, item.underwater.concentration = "minerals", 10.0
    before = snapshot.snapshot()
    other, _ = _images("cycles", plan, tmp_path / "grid.exr")
    assert snapshot.snapshot() == before
    middle = np.s_[3:9, 5:11]
    assert other[middle].mean((0, 1))[:2] == pytest.approx(one[middle].mean((0, 1))[:2], rel=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["bands", pytest.param("realtime", marks=pytest.mark.slow)])
def test_eevee_draws_a_grid_as_a_blob_of_its_density(engine, tmp_path):
    _camera(16, 12)
    plan = _plan()
    blob = _blob(10.0)
    one, _ = _images(engine, plan, tmp_path / "puff.exr")
    blob.underwater.constituent = stored_clouds.NO_CLOUD
    item = _volume_of_a_blob(blob.location)
    item.underwater.constituent, item.underwater.concentration = "minerals", 10.0
    item.rotation_euler.z = 0.4
    bpy.context.view_layer.update()
    before = snapshot.snapshot()
    other, notes = _images(engine, plan, tmp_path / "grid.exr")
    bpy.context.view_layer.update()
    assert snapshot.snapshot() == before
    assert not notes
    assert other[..., :2] == pytest.approx(one[..., :2], rel=0.02)


@pytest.mark.slow
def test_a_blob_in_its_grid_is_one_cloud_twice_as_dense(tmp_path):
    _camera(16, 12)
    plan = _plan()
    _, other = _blob(6.0), _blob(6.0)
    two, _ = _images("bands", plan, tmp_path / "two.exr")
    bpy.data.objects.remove(other)
    item = _volume_of_a_blob((0.0, 3.0, -DEPTH))
    item.underwater.constituent, item.underwater.concentration = "minerals", 6.0
    mixed, _ = _images("bands", plan, tmp_path / "mixed.exr")
    assert mixed[..., :2] == pytest.approx(two[..., :2], rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("water", ["jerlov:IB", "jerlov:II"])
def test_both_engines_draw_the_same_structure(water, tmp_path):
    """Two dense halves with a gap between them, which no blob has."""
    _camera(24, 16)
    plan = _plan(water=water, bands=6)
    item = _halves((0.0, 3.0, -DEPTH))
    item.underwater.constituent, item.underwater.concentration = "minerals", 8.0
    eevee, _ = _images("bands", plan, tmp_path / "eevee.exr")
    traced = replace(plan, settings=replace(plan.settings, samples=512))
    cycles, _ = _images("cycles", traced, tmp_path / "cycles.exr")
    columns = np.r_[3:9, 15:21]
    # In the last band there is hardly any light; few samples of Cycles have noise.
    dense, thin = (x[5:11, columns, :4].mean((0, 1)) for x in (eevee, cycles))
    assert np.mean(dense / thin) == pytest.approx(1.0, abs=0.08)
    if water == "jerlov:II":
        return  # there the gap is as bright, by what the water scatters
    # Water in the gap has light of both halves, too, which EEVEE does not draw: it is 4 to 11 %
    # too dark there, the shadow of the halves in that water included.
    one, other = (x[5:11, 10:14, :4].mean((0, 1)) for x in (eevee, cycles))
    assert 1.0 - one / dense == pytest.approx(1.0 - other / thin, rel=0.12)
    assert np.mean(1.0 - one / dense) == pytest.approx(np.mean(1.0 - other / thin), rel=0.05)


@pytest.mark.slow
def test_what_a_grid_lets_through_of_a_wall_is_its_transmittance(tmp_path):
    camera = _camera(angle=8.0)
    _wall()
    plan = _plan(layers="T")
    scene, extent = (
        bpy.context.scene,
        water_body.water_extent(bpy.context.scene, plan.column, DEPTH),
    )

    def drawn(concentration):
        if concentration:
            item = _volume_of_a_blob((0.0, 3.0, -DEPTH))
            item.underwater.constituent = "minerals"
            item.underwater.concentration = concentration
        with engines.eevee_bands(scene, camera, plan, extent, DEPTH) as found:
            bands = found.passes[0]
            layers = found.frame(plan, DEPTH)(bands, tmp_path / "wall.exr")
        return layers.layers[bands_name("D")].values[10, 16]

    clear, veiled = drawn(0.0), drawn(1.5)
    matter = suspended_matter("minerals", 1.5, plan.bands.centres)
    wanted = np.exp(-matter.extinction * SIGMA * math.sqrt(2.0 * math.pi))
    assert veiled / clear == pytest.approx(wanted, rel=0.02)


@pytest.mark.slow
def test_a_volume_that_is_no_cloud_and_has_no_material_is_left_out(tmp_path):
    """EEVEE draws a fog of its own for it, in which there is no water."""
    _camera(8, 6)
    plan = _plan()
    clear, _ = _images("bands", plan, tmp_path / "clear.exr")
    item = _volume_of_a_blob((0.0, 3.0, -DEPTH))
    seen, notes = _images("bands", plan, tmp_path / "fog.exr")
    assert notes == ["volume 'Smoke' has no material and is left out by EEVEE"]
    assert seen == pytest.approx(clear, rel=1e-3)
    assert [x.name for x in item.modifiers] == ["Volume"]


@pytest.mark.slow
def test_a_grid_without_density_is_said(tmp_path):
    _camera(8, 6)
    plan = _plan()
    clear, _ = _images("bands", plan, tmp_path / "clear.exr")
    item = bpy.data.objects.new("Nothing", bpy.data.volumes.new("Nothing"))
    bpy.context.scene.collection.objects.link(item)
    item.underwater.constituent = "minerals"
    bpy.context.view_layer.update()
    seen, notes = _images("bands", plan, tmp_path / "nothing.exr")
    assert any("no grid named 'density'" in note for note in notes)
    assert seen == pytest.approx(clear, rel=1e-3)


def test_a_density_is_read_at_each_frame_and_not_more_often():
    _camera()
    item = _volume_of_a_blob((0.0, 3.0, -DEPTH))
    item.underwater.constituent = "minerals"
    cube = next(n for n in item.modifiers[0].node_group.nodes if "VolumeCube" in n.bl_idname)
    for frame, size in ((1, 1.75), (2, 0.5)):
        cube.inputs["Max"].default_value = (size,) * 3
        cube.inputs["Max"].keyframe_insert("default_value", frame=frame)
    scene, cache = bpy.context.scene, volume_grids.GridCache(of_job=True)

    def grid(frame):
        scene.frame_set(frame)
        ((cloud,), notes) = cache.of(scene, clouds.clouds_of(scene, [550.0]).grids)
        assert not notes
        return cloud.grid

    first, again, smaller = grid(1), grid(1), grid(2)
    assert again is first
    assert smaller.density.sum() * abs(np.linalg.det(smaller.axes)) < 0.8 * (
        first.density.sum() * abs(np.linalg.det(first.axes))
    )
    volume = first.density.sum() * abs(np.linalg.det(first.axes))
    assert volume == pytest.approx((2.0 * np.pi * SIGMA**2) ** 1.5, rel=0.02)


def test_files_and_sequences_are_read_as_they_stand_at_a_frame(tmp_path):
    scene, _ = bpy.context.scene, _camera()
    made = _volume_of_a_blob((0.0, 3.0, -DEPTH))
    cube = next(n for n in made.modifiers[0].node_group.nodes if "VolumeCube" in n.bl_idname)
    for frame, size in ((1, 1.75), (2, 0.5)):
        cube.inputs["Max"].default_value = (size,) * 3
        bpy.context.view_layer.update()
        seen = made.evaluated_get(bpy.context.evaluated_depsgraph_get())
        geometry = seen.evaluated_geometry()
        assert geometry.volume.grids.save(filepath=str(tmp_path / f"silt_{frame:04d}.vdb"))
    volume = bpy.data.volumes.new("Silt")
    volume.filepath, volume.is_sequence = str(tmp_path / "silt_0001.vdb"), True
    volume.frame_start, volume.frame_duration = 1, 2
    item = bpy.data.objects.new("Silt", volume)
    scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    masses = []
    for frame in (1, 2):
        scene.frame_set(frame)
        density, _, cell = volume_grids.read_density(scene, item)
        masses.append(density.sum() * np.prod(cell))
    assert masses[0] == pytest.approx((2.0 * np.pi * SIGMA**2) ** 1.5, rel=0.02)
    # Of three axes as much is gone as beyond a standard deviation.
    assert masses[1] == pytest.approx(masses[0] * 0.841**3, rel=0.05)


@pytest.mark.slow
def test_live_water_follows_a_grid():
    scene, _ = bpy.context.scene, _camera()
    group = getattr(scene, "underwater")  # noqa: B009 - added by the extension
    group.bands, group.diffuse_shadows, group.scene_floor = 3, False, False
    live.add(scene)
    item = _volume_of_a_blob((0.0, 3.0, -DEPTH))
    item.underwater.constituent = "minerals"
    assert live.update(scene)
    image = next(x for x in bpy.data.images if x.name.startswith(cloud_grids.NAME))
    before = np.array(image.pixels)
    item.location.x = 1.0
    bpy.context.view_layer.update()
    assert live.update(scene, may_rebuild=False)
    assert np.abs(np.array(image.pixels) - before).max() == pytest.approx(1.0, rel=1e-3)
    live.remove(scene)
    assert [x.name for x in item.modifiers] == ["Volume"]


def _halves(place):
    """Add a volume of two boxes beside each other, from geometry nodes."""
    item = _volume_of_a_blob(place)
    tree = item.modifiers[0].node_group
    cube = next(n for n in tree.nodes if "VolumeCube" in n.bl_idname)
    cube.inputs["Min"].default_value, cube.inputs["Max"].default_value = (-1.0,) * 3, (1.0,) * 3
    where = next(n for n in tree.nodes if "InputPosition" in n.bl_idname)
    apart = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(where.outputs[0], apart.inputs[0])
    last = apart.outputs["X"]
    for operation, other in (("ABSOLUTE", 0.0), ("SUBTRACT", 0.35), ("MULTIPLY", 8.0),
                             ("MINIMUM", 1.0), ("MAXIMUM", 0.0)):  # fmt: skip
        node = tree.nodes.new("ShaderNodeMath")
        node.operation, node.inputs[1].default_value = operation, other
        tree.links.new(last, node.inputs[0])
        last = node.outputs[0]
    tree.links.new(last, cube.inputs["Density"])
    bpy.context.view_layer.update()
    return item


def _volume_of_a_blob(place):
    """Add a volume whose density is that of a blob, from geometry nodes."""
    tree = bpy.data.node_groups.new("Volume", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    cube = tree.nodes.new("GeometryNodeVolumeCube")
    cube.inputs["Min"].default_value, cube.inputs["Max"].default_value = (-1.75,) * 3, (1.75,) * 3
    for name in ("X", "Y", "Z"):
        cube.inputs[f"Resolution {name}"].default_value = 48
    where = tree.nodes.new("GeometryNodeInputPosition")
    square = tree.nodes.new("ShaderNodeVectorMath")
    square.operation = "DOT_PRODUCT"
    tree.links.new(where.outputs[0], square.inputs[0])
    tree.links.new(where.outputs[0], square.inputs[1])
    scaled = tree.nodes.new("ShaderNodeMath")
    scaled.operation, scaled.inputs[1].default_value = "MULTIPLY", -0.5 / SIGMA**2
    tree.links.new(square.outputs["Value"], scaled.inputs[0])
    exponent = tree.nodes.new("ShaderNodeMath")
    exponent.operation = "EXPONENT"
    tree.links.new(scaled.outputs[0], exponent.inputs[0])
    tree.links.new(exponent.outputs[0], cube.inputs["Density"])
    tree.links.new(cube.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    item = bpy.data.objects.new("Smoke", bpy.data.volumes.new("Smoke"))
    item.modifiers.new("Volume", "NODES").node_group = tree
    item.location = place
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item


def test_a_scene_without_clouds_has_no_nodes_for_them():
    camera = _camera()
    water = eevee_water(_plan(), bpy.context.scene, Eye(camera, DEPTH), np.eye(3))
    assert cloud_term.CloudShape not in water.shape
    assert not any("cloud" in name for name in realtime_values.single_names(water.shape))
    realtime.add_realtime(
        bpy.context.scene, water, water_body.water_extent(bpy.context.scene, water.column, DEPTH)
    )
    assert not any("Cloud" in group.name for group in bpy.data.node_groups)
    scene_water.remove(bpy.context.scene)


@pytest.mark.slow
def test_live_water_follows_clouds():
    scene, _ = bpy.context.scene, _camera()
    group = getattr(scene, "underwater")  # noqa: B009 - added by the extension
    group.bands, group.diffuse_shadows, group.scene_floor = 3, False, False
    live.add(scene)
    item = _blob(5.0)
    assert live.update(scene, may_rebuild=False) is False
    assert live.update(scene)
    before = _numbers_in_image()
    item.underwater.concentration = 10.0
    assert live.update(scene, may_rebuild=False)
    after = _numbers_in_image()
    # Its extinction is twice what it was.
    assert np.any(np.all(np.isclose(after, 2.0 * before, rtol=1e-4) & (before > 0.1), axis=-1))
    item.location.x = 1.0
    bpy.context.view_layer.update()
    assert live.update(scene, may_rebuild=False)
    moved = _numbers_in_image()
    assert np.any(np.all(np.isclose(moved, (1.0, 3.0, -DEPTH)), axis=-1))
    live.remove(scene)


def _numbers_in_image():
    """Return the texels of the only cloud, three numbers each."""
    image = next(x for x in bpy.data.images if x.name.startswith(cloud_table.NAME))
    return np.array(image.pixels).reshape(-1, 4)[:, :3]


def test_shafts_are_said_not_to_heed_clouds_and_lamps_light_them():
    camera = _camera()
    _blob()
    lamp = bpy.data.objects.new("Torch", bpy.data.lights.new("Torch", "SPOT"))
    lamp.location = (0.3, 0.0, -DEPTH)
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    water = eevee_water(_plan(shafts=True), bpy.context.scene, Eye(camera, DEPTH), np.eye(3))
    said = " ".join(water.term(CloudTerm).notes)
    assert "lamps" not in said
    assert "shafts of light are drawn as if it were not there" in said


@pytest.mark.slow
@pytest.mark.parametrize("place", [(0.0, 3.0, 2.0), (60.0, 0.0, -5.0)], ids=["air", "aside"])
def test_a_cloud_that_is_not_in_view_changes_nothing(place, tmp_path):
    _camera(16, 10)
    plan = _plan()
    clear, _ = _images("bands", plan, tmp_path / "clear.exr")
    _blob(30.0, place)
    beside, _ = _images("bands", plan, tmp_path / "beside.exr")
    assert beside == pytest.approx(clear, rel=2e-3, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["bands", pytest.param("cycles", marks=pytest.mark.slow)])
def test_a_keyframed_concentration_is_that_of_the_frame(engine, tmp_path):
    _camera(8, 6)
    item = _blob(0.0)
    plan = _plan(samples=64)
    for frame, amount in ((1, 0.0), (2, 60.0)):
        item.underwater.concentration = amount
        item.keyframe_insert("underwater.concentration", frame=frame)
    means = []
    for frame in (1, 2):
        bpy.context.scene.frame_set(frame)
        means.append(_images(engine, plan, tmp_path / "frame.exr")[0][2:4, 3:5, 1].mean())
    assert means[1] > 1.2 * means[0]


def test_records_say_what_and_where():
    _camera()
    item = _blob(7.5, (1.0, 2.0, -4.0))
    item.scale = (1.0, 2.0, 3.0)
    bpy.context.view_layer.update()
    (found,) = clouds.records(bpy.context.scene)
    assert found["constituent"] == "minerals"
    assert found["concentration"] == 7.5
    assert found["unit"] == "g/m³"
    assert found["position"] == pytest.approx([1.0, 2.0, -4.0])
    assert np.linalg.norm(found["half_axes"], axis=1) == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.slow
def test_water_below_a_cloud_is_in_its_shadow():
    """Over the same water without the cloud, in both engines."""
    scene, camera = bpy.context.scene, _camera(32, 24)
    item = _blob(80.0, (0.0, 4.0, -2.6))
    item.scale = (1.5, 1.5, 0.7)
    left = {}
    for engine, samples in (("eevee", 16), ("cycles", 2000)):
        chosen = replace(PLAIN, sun_zenith=20.0, sun_azimuth=90.0, samples=samples)
        plan, found = render_plan.make_plan(chosen), []
        for concentration in (80.0, 0.0):
            item.underwater.concentration = concentration
            bpy.context.view_layer.update()
            extent = water_body.water_extent(scene, plan.column, DEPTH)
            with (
                engines.eevee_bands(scene, camera, plan, extent, DEPTH)
                if engine == "eevee"
                else engines.cycles_bands(scene, camera, plan, extent, seed=1)
            ) as made:
                found.append(grey_scene.band_image(made, plan, DEPTH))
        # From the middle down, below the cloud.
        with_cloud, without = (x[12:, 10:22].mean(axis=(0, 1)) for x in found)
        left[engine] = with_cloud / without
    assert np.all(left["cycles"] < 0.95)
    assert left["eevee"] == pytest.approx(left["cycles"], abs=0.04)


def test_cycles_says_what_stands_for_the_phase_function_of_bubbles():
    camera = _camera()
    _blob(constituent="bubbles"), _blob(constituent="bubbles")
    scene, plan = bpy.context.scene, _plan()
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.cycles_bands(scene, camera, plan, extent, seed=1) as found:
        assert sum("Cycles has no phase function of bubbles" in note for note in found.notes) == 1


def test_a_hidden_cloud_is_none():
    _camera()
    item = _blob()
    item.hide_render = True
    assert clouds.clouds_of(bpy.context.scene, [550.0]).objects == ()
    assert clouds.records(bpy.context.scene) == ()


def test_what_cannot_be_a_cloud_is_said():
    _camera()
    wall = _wall()
    wall.underwater.constituent = "minerals"
    found = clouds.clouds_of(bpy.context.scene, [550.0])
    assert found.objects == ()
    assert "neither an empty nor a volume object" in found.notes[0]
    flat = _blob()
    flat.scale = (1.0, 0.0, 1.0)
    bpy.context.view_layer.update()
    with pytest.raises(InputError, match=f"cloud '{flat.name}'.*flat"):
        clouds.clouds_of(bpy.context.scene, [550.0])


def test_clouds_leave_with_the_water():
    scene, camera = bpy.context.scene, _camera()
    _blob()
    before = snapshot.snapshot()
    plan = _plan()
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.cycles_bands(scene, camera, plan, extent, seed=1):
        assert any(marks.CLOUD in item for item in marks.objects(scene))
    assert snapshot.snapshot() == before
