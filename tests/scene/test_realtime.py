"""Real-time water goes into a scene, takes other values, and leaves without a trace."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import marks
from underwater_spectral.scene.materials import wet_trees
from underwater_spectral.scene.readers.lamps import lamps_of
from underwater_spectral.scene.readers.scene_lamps import SceneLamps
from underwater_spectral.scene.terms.lamps import LampTerm
from underwater_spectral.scene.water import frame_water, realtime, scene_water, water_body
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.scene import columns, scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.illuminant import RELATIVE
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

HG = parse_phase("hg:0.8").for_bands(np.ones(3))
DEPTH = 5.0


def _water(
    a=0.05, b=0.1, *, phase=HG, shafts=False, reflectances=None, depth=DEPTH, lamps=None, **changes
):
    values = {"floor_depth": 9.0, "floor_reflectance": 0.3} | changes
    column = columns.grey_column(a, b, **values)
    lamps = lamps or SceneLamps()
    shining = LampTerm(lamps.in_water(column, phase, depth))
    inputs = FrameInputs(reflectances or {}, terms=(shining,))
    return frame_water.realtime_water(column, phase, depth, np.eye(3), shafts=shafts, inputs=inputs)


def _add(scene, water):
    extent = water_body.water_extent(scene, water.column, DEPTH)
    return realtime.add_realtime(scene, water, extent)


@pytest.mark.slow
@pytest.mark.parametrize("shafts", [pytest.param(False, marks=pytest.mark.slow), True])
def test_removal_restores_every_value(shafts):
    scene = scenes.varied_scene()
    before = snapshot.snapshot()
    water = _water(
        shafts=shafts,
        surface="flat",
        lamps=lamps_of(scene, columns.grey_column(0.1, 0.1).bands, RELATIVE),
    )
    assert len(water.term(LampTerm).scene.lamps) == 2
    notes = _add(scene, water)
    assert len(notes) == 2
    assert all("mirrors" in note for note in notes)
    during = snapshot.snapshot()
    scene_water.remove(scene)
    assert len(snapshot.differences(before, during)) > 100
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_removal_after_save_and_load(tmp_path):
    scenes.varied_scene()
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    before = snapshot.snapshot()
    _add(bpy.context.scene, _water(shafts=True))
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert marks.has_water(bpy.context.scene)
    scene_water.remove(bpy.context.scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_water_twice_is_refused():
    scene = scenes.varied_scene()
    _add(scene, _water())
    with pytest.raises(InputError, match="has water already; remove it first"):
        _add(scene, _water())


@pytest.mark.slow
def test_new_values_build_nothing():
    scene = scenes.varied_scene()
    _add(scene, _water(shafts=True))

    def nodes():
        trees = [*bpy.data.node_groups, *(m.node_tree for m in bpy.data.materials)]
        return {t.name: [n.as_pointer() for n in t.nodes] for t in trees}

    before, values = nodes(), snapshot.snapshot()
    sun = {"sun_cosine": math.cos(0.5), "sun_direction": (math.sin(0.5), 0.0, -math.cos(0.5))}
    other = _water(0.2, 0.5, shafts=True, depth=2.0, **sun)
    realtime.set_values(scene, other)
    assert nodes() == before
    changed = snapshot.differences(values, snapshot.snapshot())
    assert any("UW Values" in line for line in changed)
    links = [line for line in changed if "link" in line]
    assert links == []


def test_other_shape_is_refused():
    scene = scenes.varied_scene()
    _add(scene, _water())
    with pytest.raises(InputError, match="needs other nodes"):
        realtime.set_values(scene, _water(surface="flat"))
    scene_water.remove(scene)
    with pytest.raises(InputError, match="no real-time water"):
        realtime.set_values(scene, _water())


def test_edited_and_animated_colours_are_followed():
    scene = scenes.varied_scene()
    _add(scene, _water())
    scene.frame_set(20)
    realtime.set_values(scene, _water())
    tree = bpy.data.materials["animated"].node_tree
    copies = [n for n in tree.nodes if wet_trees.SOURCE in n]
    assert [copy.inputs[0].default_value for copy in copies] == pytest.approx([0.9])


def test_measured_reflectance_reaches_its_material():
    scene = scenes.varied_scene()
    _add(scene, _water(reflectances={"measured": np.array([0.1, 0.2, 0.3])}))
    node = next(
        n
        for n in bpy.data.materials["measured"].node_tree.nodes
        if n.bl_idname == "ShaderNodeGroup" and "Coverage" in n.inputs
    )
    assert node.inputs["Column"].default_value == 3.0
    assert list(node.inputs["Measured"].default_value) == pytest.approx([0.1, 0.2, 0.3])


def test_linked_materials_are_named(tmp_path):
    library = tmp_path / "library.blend"
    material = scenes.principled("shared")
    bpy.data.libraries.write(str(library), {material})
    bpy.data.materials.remove(material)
    scene = scenes.varied_scene()
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.materials = ["shared"]
    bpy.data.objects["no material"].data.materials.append(wanted.materials[0])
    before = snapshot.snapshot()
    notes = _add(scene, _water())
    assert any("material 'shared' is linked from" in note for note in notes)
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []
