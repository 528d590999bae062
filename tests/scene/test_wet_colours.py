"""Porous objects are darker in water, in every engine; others stay as they are."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks._places import HEIGHT, WIDTH, Place
from underwater_spectral.benchmarks._scenery import look_at, matt
from underwater_spectral.node_groups import uplift
from underwater_spectral.scene.materials import band_colors, wet_colours
from underwater_spectral.scene.materials.inserted import own_input
from underwater_spectral.scene.materials.mean_colours import mean_colour
from underwater_spectral.tests.scene import scenes
from underwater_spectral.tests.scene.snapshot import snapshot

pytestmark = pytest.mark.usefixtures("properties")
SAND, WET_SAND = 0.4, 0.183


def _sand(name: str, *, porous: bool) -> bpy.types.Material:
    material = scenes.principled(name)
    base = material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    base.default_value = (SAND, SAND, SAND, 1.0)
    material.underwater.porous = porous
    return material


def test_only_porous_objects_get_groups_and_all_comes_back():
    sand, paint = _sand("sand", porous=True), _sand("paint", porous=False)
    before = snapshot()
    wet_colours.insert([sand, paint])
    uplift.set_wet_grains(1.34)
    band_colors.insert([sand, paint])
    base = sand.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    kinds = []
    while base.links:
        node = base.links[0].from_node
        kinds.append(node.node_tree[uplift.KIND])
        base = node.inputs[0]
    assert kinds == [uplift.REFLECTANCE, uplift.WET]
    other = paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    assert own_input(other).node.node_tree[uplift.KIND] == uplift.REFLECTANCE
    band_colors.remove(set())
    for group in [g for g in bpy.data.node_groups if not g.users]:
        bpy.data.node_groups.remove(group)
    assert snapshot() == before


def test_occlusion_takes_them_for_wet():
    sand, paint = _sand("sand", porous=True), _sand("paint", porous=False)
    np.testing.assert_allclose(mean_colour(sand), WET_SAND, atol=0.002)
    np.testing.assert_allclose(mean_colour(paint), SAND, atol=1e-6)


@pytest.mark.slow
def test_both_engines_draw_them_darker():
    """Two plates side by side, close to the camera, one of them porous."""

    def build() -> bpy.types.Object:
        for x, porous in ((-0.5, False), (0.5, True)):
            bpy.ops.mesh.primitive_plane_add(size=0.9, location=(x, 0.0, -3.5))
            material = matt([SAND] * 3)
            material.underwater.porous = porous
            bpy.context.object.data.materials.append(material)
        return look_at((0.0, 0.0, -2.7), (0.0, 1e-3, -3.5), 1.2)

    place = Place("plates", build, samples=64)
    for image in (lambda c: place.by_cycles(c, [1])[0], place.by_eevee):
        shown = image(place.open())
        rows, columns = slice(HEIGHT // 3, 2 * HEIGHT // 3), WIDTH // 4
        dry, wet = (
            shown[rows, x - 4 : x + 4].mean(axis=(0, 1)) for x in (columns, WIDTH - columns)
        )
        np.testing.assert_allclose(wet / dry, WET_SAND / SAND, rtol=0.05)
