"""The light of lamps as shader nodes, rendered, against the same formulas in numpy."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_lamps
from underwater_spectral.node_groups.node_mathematics import MARK, NODES, Graph
from underwater_spectral.scene import exr_output
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_path import gauss_sum
from underwater_spectral.uw_spectral.lamps.lamp_shadow import shadow_directions, shadow_map
from underwater_spectral.uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile, rov_lamp
from underwater_spectral.uw_spectral.mathematics import NUMPY
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase import (
    EinsteinSmoluchowski,
    FournierForand,
    Mixture,
    seawater_mixture,
)

SIZE = 12
INTENSITY = (1.0, 2.0, 0.5)
PHASE = Mixture((EinsteinSmoluchowski(), FournierForand()), (0.02, 0.98))
WATER = lamp_water([0.1, 0.1, 0.1], [0.1, 0.3, 1.0], seawater_mixture([1.0] * 3, [0.02] * 3))


@pytest.fixture
def square():
    """Return a function that draws a formula of the position on a square, and the positions."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    camera.location.z = 3.0
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("Square")
    mesh.materials.append(material)
    for item in (camera, bpy.data.objects.new("Square", mesh)):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = SIZE

    def draw(formula, path):
        tree = material.node_tree
        for node in list(tree.nodes):
            tree.nodes.remove(node)
        graph = Graph(tree)
        position = graph.term(graph.node("ShaderNodeNewGeometry").outputs["Position"])
        emission = graph.node("ShaderNodeEmission")
        graph.assign(formula(graph, position), emission.inputs["Color"])
        output = graph.node("ShaderNodeOutputMaterial")
        tree.links.new(emission.outputs[0], output.inputs["Surface"])
        assert all(node[MARK] for node in tree.nodes)
        exr_output.write_float_exr(scene, path)
        return read_exr(path)[0].astype(np.float64)

    return draw


def _position(draw, tmp_path):
    # The same seed, so the same places in the pixels.
    return draw(lambda _, position: position, tmp_path / "position.exr")


def test_angles(square, tmp_path):
    at = _position(square, tmp_path)

    def formula(m, x, y):
        return m.arctan2(y, x), m.tan(x), m.arctan2(y * 0.0 + 1.0, m.absolute(x))

    def nodes(graph, position):
        x, y, _ = graph.components(position)
        return graph.vector(*formula(NODES, x, y))

    seen = square(nodes, tmp_path / "angles.exr")
    wanted = np.stack(formula(NUMPY, at[..., 0], at[..., 1]), axis=-1)
    assert seen == pytest.approx(wanted, abs=2e-5)


@pytest.mark.parametrize(
    "profile",
    [
        pytest.param(IsotropicProfile(), id="isotropic", marks=pytest.mark.slow),
        pytest.param(SpotProfile(math.radians(50), 0.3), id="spot"),
        pytest.param(rov_lamp(), id="table", marks=pytest.mark.slow),
    ],
)
def test_nodes_are_the_formulas(square, tmp_path, profile):
    at = _position(square, tmp_path)
    axis = (0.0, math.sin(2.5), math.cos(2.5))
    other = Lamp((9.0, 9.0, 9.0), axis, np.zeros(6), IsotropicProfile(), 0.02)
    # A wall 2.5 m below the lamp keeps its light from what is beyond.
    down = -shadow_directions()[:, 2]
    wall = shadow_map(np.where(down > 0.0, 2.5 / np.maximum(down, 1e-9), np.inf))
    lamp = Lamp((0.2, 0.0, 1.0), axis, np.array(INTENSITY), profile, 0.02, shadow=wall, thrown=1.0)
    # The second lamp of two and the second triple of two are looked up.
    six = np.concatenate([np.zeros(3), INTENSITY])
    b = np.concatenate([np.full(3, 9.0), WATER.b])
    water = lamp_water(np.full(6, 0.1), b, seawater_mixture([1.0] * 6, [0.02] * 6))
    image = realtime_lamps.new_image(2, 2)
    lamps = [other, dataclasses.replace(lamp, intensity=six)]
    realtime_lamps.write_lamps(image, lamps, [(1.0, 0.0, 0.0)] * 2, water)

    def path(m, x, y, lamp, water, integrate):
        # From behind the lamp to far before it, through the lamp and past it.
        ray = ray_past_lamp(lamp, (x, 0.1, y * 4.0), (0.0, 0.0, 1.0), 6.0 + x, m)
        once, more = lamp_light(lamp, ray, water, m, integrate)
        return once + more

    def before_a_thing(m, x, y, lamp, water, integrate):
        # What is bent by less than ten degrees is left out.
        ray = ray_past_lamp(lamp, (x, 0.1, y - 3.0), (0.0, 0.0, 1.0), 6.0, m, before_thing=True)
        return sum(lamp_light(lamp, ray, water, m, integrate))

    def surface(m, x, y, lamp, water, integrate):
        del integrate
        patch = patch_past_lamp(lamp, (x, y, 0.0), (0.0, 0.0, 1.0), m)
        return sum(surface_irradiance(lamp, patch, water, m))

    for formula in (path, before_a_thing, surface):

        def nodes(graph, position, formula=formula):
            x, y, _ = graph.components(position)
            table = realtime_lamps.LampTable(graph, image)
            index = graph.operation("ADD", (graph.operation("MULTIPLY", (x, 0.0)), 1.0))
            bands = {name: graph.vector(*getattr(WATER, name).tolist()) for name in ("a", "b", "c")}
            spread = table.spread(index)
            water = dataclasses.replace(WATER, **bands, phase=PHASE, spread=spread)
            return formula(NODES, x, y, table.lamp(index, index), water, table.integrate)

        seen = square(nodes, tmp_path / "lamp.exr")
        wanted = formula(NUMPY, at[..., :1], at[..., 1:2], lamp, WATER, gauss_sum)
        assert wanted.max() > 0
        # The table of the profile is linear between its places.
        assert seen == pytest.approx(wanted, rel=2e-3, abs=2e-3 * wanted.max())
