"""The light of lamps as shader nodes, rendered, against the same formulas in numpy."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import (
    lamp_images,
    lamp_profiles,
    lamp_table,
    lamp_visibility,
    realtime_lamps,
)
from underwater_spectral.node_groups.loops import summed
from underwater_spectral.node_groups.node_mathematics import MARK, NODES, Graph
from underwater_spectral.scene.engines import exr_output
from underwater_spectral.uw_spectral.lamps.inelastic_source import LampExcitation
from underwater_spectral.uw_spectral.lamps.lamp import Lamp, LitPart, LitParts, ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_harmonics import Harmonics
from underwater_spectral.uw_spectral.lamps.lamp_projection import project_lamps
from underwater_spectral.uw_spectral.lamps.lamp_shadow import (
    PART_SIDE,
    shadow_directions,
    shadow_map,
)
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_water
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile, SpotProfile, rov_lamp
from underwater_spectral.uw_spectral.lamps.virtual_point_lights import COUNT as PARTS
from underwater_spectral.uw_spectral.lamps.virtual_point_lights import LAMBERT
from underwater_spectral.uw_spectral.mathematics import NUMPY
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.channels import channels_of
from underwater_spectral.uw_spectral.transfer.facets import Facets
from underwater_spectral.uw_spectral.transfer.radiance_field import distance_in_water
from underwater_spectral.uw_spectral.water.phase_functions import seawater_mixture

SIZE = 12


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


AXIS = (0.0, math.sin(2.5), math.cos(2.5))
WAVES = np.linspace(0.0, 1.0, 7)
INTENSITY = 1.0 + WAVES
# One of the channels has bands that count against it.
CHANNELS = channels_of(
    Bands.uniform(7), [WAVES**2, 1.0 - (2.0 * WAVES - 1.0) ** 2, 1.0 - 1.3 * WAVES]
)
MEASURED = [0.9 - 0.8 * WAVES, 0.1 + 0.7 * WAVES]


def _projected(profile=None, *, clouds=0.0, excited=(), **more):
    """Two lamps, of which the second is looked up, in water of seven bands."""
    b = 0.6 - 0.3 * WAVES
    water = lamp_water(0.05 + 0.3 * WAVES, b, seawater_mixture(b, [0.02] * 7))
    other = Lamp((9.0, 9.0, 9.0), AXIS, np.zeros(7), IsotropicProfile(), 0.02)
    # A wall 2.5 m below the lamp keeps its light from what is beyond.
    down = -shadow_directions()[:, 2]
    wall = shadow_map(np.where(down > 0.0, 2.5 / np.maximum(down, 1e-9), np.inf))
    form = profile or SpotProfile(math.radians(50), 0.3)
    given = {"shadow": wall, "virtual": 1.0, "seen": 0.0, "radius": 0.02} | more
    lamp = Lamp((0.2, 0.0, 1.0), AXIS, INTENSITY, form, **given)
    return project_lamps([other, lamp], water, CHANNELS, MEASURED, clouds=clouds, excited=excited)


def _images(projected):
    images = lamp_images.new_images(
        2, 2, lamp_images.LampRows.of_parts(projected.parts, projected.measured)
    )
    lamp_images.write_lamps(images, projected, [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    return images


def _agree(seen, wanted):
    assert np.abs(wanted).max() > 0
    # The table of the profile is linear between its places.
    assert seen == pytest.approx(wanted, rel=2e-3, abs=2e-3 * np.abs(wanted).max())


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    "profile",
    [
        pytest.param(IsotropicProfile(), id="isotropic", marks=pytest.mark.slow),
        pytest.param(SpotProfile(math.radians(50), 0.3), id="spot"),
        pytest.param(rov_lamp(), id="table", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("before_surface", [False, True])
def test_nodes_are_the_formulas(square, tmp_path, profile, before_surface):
    at = _position(square, tmp_path)
    projected = _projected(profile)
    images = _images(projected)

    def ray(x, y):
        # From behind the lamp to far before it, through the lamp and past it; or before an object,
        # where what is bent by less than ten degrees is left out.
        if before_surface:
            return (x, 0.1, y - 3.0), (0.0, 0.0, 1.0), 6.0
        return (x, 0.1, y * 4.0), (0.0, 0.0, 1.0), 6.0 + x

    def nodes(graph, position):
        x, y, _ = graph.components(position)
        table = lamp_table.LampTable.of(graph, images)
        index = graph.operation("ADD", (graph.operation("MULTIPLY", (x, 0.0)), 1.0))
        lamp = table.lamp(index)
        past = ray_past_lamp(lamp, *ray(x, y), NODES, before_surface=before_surface)
        light = table.in_water(index, projected.components)
        return light.along(lamp, past, NODES, table.nodes_for(lamp))

    seen = square(nodes, tmp_path / "lamp.exr")
    _agree(
        seen, projected.path_light(*ray(at[..., :1], at[..., 1:2]), before_surface=before_surface)
    )


@pytest.mark.slow
def test_the_group_of_the_way_is_the_formula(square, tmp_path):
    at = _position(square, tmp_path)
    # The second lamp is beside the way, and the first shines into the camera.
    projected = _projected(seen=1.0, radius=0.3, shadow=None)
    group = realtime_lamps.build_path(_images(projected), projected.components, ahead=False)

    def nodes(graph, position):
        del position
        return graph.term(graph.node("ShaderNodeGroup", node_tree=group).outputs["Light"])

    seen = square(nodes, tmp_path / "lamp.exr")
    x, y = at[..., :1], at[..., 1:2]
    P = 3.0 + 0.0 * x  # of a camera without perspective
    wanted = projected.path_light((x, y, P), (0.0, 0.0, -1.0), P, before_surface=True)
    _agree(seen, wanted)


@pytest.mark.slow
def test_the_group_of_the_way_has_light_of_changed_wavelength(square, tmp_path):
    at, b = _position(square, tmp_path), np.array([0.7, 0.5])
    water = Harmonics(np.array([0.2, 0.1]), b, seawater_mixture(b, [0.02] * 2))
    # That of the lamp does not drown it.
    matrices = np.stack([np.outer([1.0, 0.3], WAVES), np.outer([0.0, 1.0], 1.0 - WAVES)])
    excited = LampExcitation(water, matrices)
    projected = _projected(excited=[excited.by(np.zeros(2)), excited], virtual=0.0)
    images = lamp_images.new_images(
        2, 2, lamp_images.LampRows.of_parts(projected.parts, projected.measured, inelastic=2)
    )
    lamp_images.write_lamps(images, projected, [(1.0, 0.0, 0.0)] * 4)
    group = realtime_lamps.build_path(images, projected.components, ahead=False)

    def nodes(graph, position):
        del position
        return graph.term(graph.node("ShaderNodeGroup", node_tree=group).outputs["Light"])

    seen = square(nodes, tmp_path / "lamp.exr")
    x, y = at[..., :1], at[..., 1:2]
    P = 3.0 + 0.0 * x
    wanted, plain = (
        one.path_light((x, y, P), (0.0, 0.0, -1.0), P, before_surface=True)
        for one in (projected, _projected(virtual=0.0))
    )
    assert np.median(wanted / plain) > 1.5
    _agree(seen, wanted)


@pytest.mark.slow
def test_the_way_past_what_stands_for_objects_is_the_formula(square, tmp_path):
    # Its loops are shorter, which EEVEE heeds; Cycles makes none of them.
    scene = bpy.context.scene
    scene.render.engine, scene.eevee.taa_render_samples = "BLENDER_EEVEE", 1
    parts = LitParts([LitPart((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0 * WAVES, 0.1)])
    projected = _projected(LAMBERT, radius=0.3, shadow=None, parts=parts)
    images = lamp_images.new_images(
        2, 2, lamp_images.LampRows.of_parts(projected.parts, projected.measured), 1
    )
    lamp_images.write_lamps(images, projected, [(1.0, 0.0, 0.0), lamp_visibility.NO_SHADOW])
    group = realtime_lamps.build_path(images, projected.components, ahead=False)
    assert lamp_table.LampTable.of(Graph(group), images).virtual == 1

    def nodes(graph, position):
        light = graph.term(graph.node("ShaderNodeGroup", node_tree=group).outputs["Light"])
        x, y, _ = graph.components(position)
        # EEVEE draws nothing that is negative.
        return graph.vector(graph.components(light)[0], x + 1.0, y + 1.0)

    seen, x, y = np.moveaxis(square(nodes, tmp_path / "lamp.exr"), -1, 0)[..., None]
    P = 3.0 + 0.0 * x
    ray = (x - 1.0, y - 1.0, P), (0.0, 0.0, -1.0), P
    wanted = projected.path_light(*ray, before_surface=True)[..., :1]
    # EEVEE keeps half floats.
    assert seen == pytest.approx(wanted, rel=4e-3, abs=1e-4 * np.abs(wanted).max())


@pytest.mark.slow
def test_the_group_ahead_is_the_formula(square, tmp_path):
    projected = _projected(seen=1.0, radius=0.3, shadow=None)
    group = realtime_lamps.build_path(_images(projected), projected.components, ahead=True)

    def nodes(graph, position):
        del position
        node = graph.node("ShaderNodeGroup", node_tree=group)
        node.inputs["y_f"].default_value = 4.0
        return graph.term(node.outputs["Light"])

    seen = square(nodes, tmp_path / "lamp.exr")
    # The camera is above the water, whose surface counts as its depth; the floor is below that.
    P = distance_in_water(0.0, 1.0, 4.0)
    _agree(
        seen, projected.path_light((0.0, 0.0, 3.0), (0.0, 0.0, -1.0), P)[None, None] + 0.0 * seen
    )


@pytest.mark.slow_but_first
@pytest.mark.parametrize("measured", [0, 2])
def test_the_group_of_surfaces_is_the_formula(square, tmp_path, measured):
    at = _position(square, tmp_path)
    projected = _projected(virtual=0.2)
    names = ("D", "Seen", "E", "F", "J")
    group = realtime_lamps.build_patch(_images(projected), names)
    colour, normal = (0.8, 0.4, 0.1), (0.0, 0.6, 0.8)
    seen = {}
    for name in names:

        def nodes(graph, position, name=name):
            del position
            node = graph.node("ShaderNodeGroup", node_tree=group)
            node.inputs["Normal"].default_value = normal
            node.inputs["Color"].default_value = (*colour, 1.0)
            # The lamp that casts the shadow of the second is green.
            node.inputs["Lamp Visibility"].default_value = (0.0, 0.5, 0.0)
            node.inputs["Measured"].default_value = measured
            return graph.term(node.outputs[name])

        seen[name] = square(nodes, tmp_path / "lamp.exr")
    x, y = at[..., :1], at[..., 1:2]
    patch = (x, y, 0.0), normal
    chosen = {"visible": 0.7, "measured": measured - 1 if measured else None}
    D, F = projected.reflected(*patch, colour, 3.0 + 0.0 * x, **chosen)
    J = sum(projected.reflected(*patch, colour, 0.0 * x, **chosen))
    wanted = {"D": D, "F": F, "Seen": D + F, "E": projected.irradiance(*patch, 0.7), "J": J}
    for name in names:
        _agree(seen[name], wanted[name])


def test_parts_of_lit_objects_are_the_formula(square, tmp_path, monkeypatch):
    # Cycles draws the square, which runs no loop whose count is a number of the image.
    def always(graph, count, terms):
        return summed(graph, count if isinstance(count, int) else PARTS, terms)

    monkeypatch.setattr(lamp_profiles, "summed", always)
    at = _position(square, tmp_path)
    # Walls at the height of the square's middle keep the light of some from one side of it.
    down, x = -shadow_directions(PART_SIDE)[:, 2], shadow_directions(PART_SIDE)[:, 0]
    wall = np.where((down > 0.0) & (x > 0.0), 0.7 / np.maximum(down, 1e-9), np.inf)
    parts = [
        LitPart(
            (0.3 * number - 0.8, 0.2 * number - 0.5, 0.8 + 0.1 * number),
            (0.0, 0.6 - 0.1 * number, -math.sqrt(1.0 - (0.6 - 0.1 * number) ** 2)),
            (0.1 + 0.05 * number) * (1.0 - 0.1 * number * WAVES),
            0.1 * number,
            shadow_map(wall, PART_SIDE) if number % 2 else None,
        )
        for number in range(PARTS)
    ]
    projected = _projected(shadow=None, unblocked=1.0, parts=LitParts(parts))
    images = lamp_images.new_images(
        2, 2, lamp_images.LampRows.of_parts(projected.parts, projected.measured), 1
    )
    lamp_images.write_lamps(images, projected, [(1.0, 0.0, 0.0), lamp_visibility.NO_SHADOW])
    group = realtime_lamps.build_patch(images, ("Seen", "E"))
    colour, normal = (0.8, 0.4, 0.1), (0.0, 0.6, 0.8)
    x, y = at[..., :1], at[..., 1:2]
    patch = (x, y, 0.0), normal
    for name, wanted in (
        ("Seen", sum(projected.reflected(*patch, colour, 3.0 + 0.0 * x))),
        ("E", projected.irradiance(*patch)),
    ):

        def nodes(graph, position, name=name):
            del position
            node = graph.node("ShaderNodeGroup", node_tree=group)
            node.inputs["Normal"].default_value = normal
            node.inputs["Color"].default_value = (*colour, 1.0)
            return graph.term(node.outputs[name])

        _agree(square(nodes, tmp_path / "lamp.exr"), wanted)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("facets", [1, 2])
def test_the_group_of_facets_is_the_formula(square, tmp_path, facets):
    at = _position(square, tmp_path)
    projected = _projected(virtual=0.2, radius=0.1)
    group = realtime_lamps.build_patch(_images(projected), ("Seen",), facets=facets)
    colour, normal, smooth = (0.8, 0.4, 0.1), (0.0, 0.28, 0.96), (0.28, 0.0, 0.96)
    surfaces = [Facets(normal, 0.5, (0.5, 0.3, 0.1), (0.2, 0.3, 0.4), (0.2, 0.3, 0.5), 1.3)]
    surfaces.append(Facets(smooth, 0.2, clear=(0.7, 0.7, 0.7), index=1.5))
    values = {
        "Normal": normal, "Color": (*colour, 1.0), "Lamp Visibility": (0.0, 0.5, 0.0),
        "Mirror": (0.5, 0.3, 0.1, 1.0), "Edge": (0.2, 0.3, 0.4, 1.0),
        "Clear": (0.2, 0.3, 0.5, 1.0), "Roughness": 0.5, "Index": 1.3,
        "Coat": 0.7, "Coat Roughness": 0.2, "Coat Index": 1.5, "Coat Normal": smooth,
    }  # fmt: skip

    def nodes(graph, position):
        del position
        node = graph.node("ShaderNodeGroup", node_tree=group)
        for socket in node.inputs:
            if socket.name in values:
                socket.default_value = values[socket.name]
        return graph.term(node.outputs["Seen"])

    seen = square(nodes, tmp_path / "lamp.exr")
    x, y = at[..., :1], at[..., 1:2]
    eye = (0.0, 0.0, 1.0)
    found = projected.reflected(
        (x, y, 0.0),
        normal,
        colour,
        3.0 + 0.0 * x,
        visible=0.7,
        facets=surfaces[:facets],
        to_eye=eye,
    )
    _agree(seen, sum(found))


def test_thirty_two_lamps_fit():
    images = lamp_images.new_images(32, 33, lamp_images.LampRows.of_parts(2, 3))
    graph = Graph(bpy.data.node_groups.new("Lamps", "ShaderNodeTree"))
    assert lamp_table.LampTable.of(graph, images).count == 32
    assert max(*images.numbers.size, *images.sources.size) < 16384
