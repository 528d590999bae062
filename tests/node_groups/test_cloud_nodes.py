"""Clouds as shader nodes, rendered, against the same formulas in numpy."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import (
    cloud_grids,
    cloud_table,
    lamp_images,
    lamp_table,
    realtime_lamps,
)
from underwater_spectral.node_groups.loops import followed, summed
from underwater_spectral.node_groups.node_mathematics import NODES
from underwater_spectral.uw_spectral.clouds import lamp_lit_cloud
from underwater_spectral.uw_spectral.clouds.cloud_light import Clouds, Several
from underwater_spectral.uw_spectral.clouds.cloud_numbers import (
    CloudNumbers,
    add_up,
    march,
    with_escapes,
)
from underwater_spectral.uw_spectral.clouds.cloud_shadow import daylit_fractions
from underwater_spectral.uw_spectral.clouds.density_grid import DensityGrid
from underwater_spectral.uw_spectral.clouds.gaussian_blob import GaussianBlob
from underwater_spectral.uw_spectral.clouds.lamp_lit_cloud import LampAndClouds
from underwater_spectral.uw_spectral.clouds.matter import blunt_phase, suspended_matter
from underwater_spectral.uw_spectral.lamps.lamp import ray_past_lamp
from underwater_spectral.uw_spectral.lamps.profile import IsotropicProfile

from .test_lamp_nodes import _agree, _position, _projected, square  # noqa: F401 - a fixture

SUN = (0.373, 0.0, -0.928)
PLACES = ((0.0, 0.0, 0.4), (0.7, 0.3, 1.2))
KINDS = ("bubbles", "minerals")
COUNTS = pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.slow)])


def _clouds(count):
    """A cloud in the middle of the square of :func:`square`, and one of other matter beside it."""
    found, phases = [], []
    for number, (kind, at) in enumerate(zip(KINDS[:count], PLACES, strict=False)):
        matter = suspended_matter(kind, 8.0, [450.0, 550.0, 650.0])
        blunt = blunt_phase(matter.phase)
        a, b = matter.absorption, matter.scattering
        wide, turned = b * (1.0 - blunt.peak), b * (1.0 - matter.phase.g)
        axes = np.diag([0.9, 0.6, 0.8])
        blob, up = GaussianBlob.of_axes(at, axes), 1.0 + number
        cloud = CloudNumbers(
            blob.middle, blob.rows, a + b, a + wide, wide / (a + wide),
            up * np.array([1.0, 0.8, 0.5]), np.array([0.3, 0.3, 0.2]), np.array([0.5, 0.6, 0.2]),
            np.array([0.1, 0.1, 0.3]), np.array([0.1, 0.2, 0.3]), np.array([0.2, 0.2, 0.4]),
            np.array([0.02, 0.03, 0.01]), a + turned, turned / (a + turned), 2.0,
            blunt.asymmetry, blunt.ceiling, blunt.peak, float(number),
        )  # fmt: skip
        found.append(with_escapes(cloud))
        phases.append(matter.phase)
    image = cloud_table.new_image(len(phases))
    cloud_table.write_clouds(image, found)

    def nodes(graph):
        table = cloud_table.CloudTable(graph, image)
        return Clouds(table, cloud_table.kinds(phases), SUN, NODES)

    return Clouds(Several(found), phases, SUN), nodes


@pytest.mark.slow_but_first
@COUNTS
@pytest.mark.parametrize("name", ["light", "passed", "skylight", "shadow"])
def test_daylight_in_clouds(square, tmp_path, count, name):  # noqa: F811
    at = _position(square, tmp_path)
    clouds, in_nodes = _clouds(count)
    w, s2 = (0.0, 0.6, -0.8), 0.4

    def of(found, x, y, add):
        if name == "skylight":
            return found.skylight_transmittance((x, y, -0.3))
        if name == "shadow":
            single, scattered = daylit_fractions(found, (x, y, 1.0), w, 3.0, 0.4, 0.3, **add)
            return single - 0.5 * scattered
        return getattr(found.veil((x, y, 3.0), w, 4.5, s2, **add), name)

    def nodes(graph, position):
        x, y, _ = graph.components(position)
        loop = {"add": lambda steps, terms: summed(graph, steps, terms)}
        return of(in_nodes(graph), x, y, loop)

    seen = square(nodes, tmp_path / "clouds.exr")
    _agree(seen, of(clouds, at[..., :1], at[..., 1:2], {}))


def _with_grid(blobs):
    """A cloud with a box of nodes, turned in the middle of the square, and so many blobs."""
    clouds, in_nodes = _clouds(max(blobs, 1))
    density = np.random.default_rng(3).random((9, 12, 7))
    for axis in range(3):
        density = (np.roll(density, 1, axis) + density + np.roll(density, -1, axis)) / 3.0
        np.moveaxis(density, axis, 0)[[0, -1]] = 0.0
    turned = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    box = DensityGrid(density, np.array([-0.1, 0.4, 0.1]), turned * 0.15)
    like = clouds.group.clouds[-1]
    lamps = [x.position for x in _projected(IsotropicProfile(), clouds=0.4).lamps]
    one = replace(like, escapes=None, grid=box.lit(SUN, float(like.transport.mean()), lamps))
    image, of_lamps = cloud_grids.new_image(1), cloud_grids.new_lamp_image(1, len(lamps))
    cloud_table.write_grids(image, [one])
    cloud_table.write_lamps(of_lamps, [one])
    group = Several([*clouds.group.clouds[:blobs], one])

    def nodes(graph):
        others = in_nodes(graph)
        table = others.group if blobs else None
        grids = cloud_table.grids_in(graph, image, of_lamps, len(lamps))
        together = Several(grids, table)
        return replace(others, group=together)

    return replace(clouds, group=group), nodes


@pytest.mark.slow
@pytest.mark.parametrize(
    ("blobs", "name"),
    [(0, "light"), (0, "passed"), (0, "sunlight"), (1, "sunlight")],
)
def test_daylight_in_a_grid(square, tmp_path, blobs, name):  # noqa: F811
    """Cycles, which draws the nodes here, has no room for the light of both kinds at once."""
    at = _position(square, tmp_path)
    clouds, in_nodes = _with_grid(blobs)
    w, s2 = (0.0, 0.6, -0.8), 0.4

    def of(found, x, y, **how):
        if name == "sunlight":
            return found.sunlight_transmittance((x, y, -0.3))
        return getattr(found.veil((x, y, 3.0), w, 4.5, s2, **how), name)

    def nodes(graph, position):
        x, y, _ = graph.components(position)
        add, follow = (
            functools.partial(summed, graph),
            functools.partial(followed, graph, skips=False),
        )
        return of(in_nodes(graph), x, y, add=add, follow=follow)

    seen = square(nodes, tmp_path / "grid.exr")
    wanted = of(clouds, at[..., :1], at[..., 1:2])
    assert wanted.max() > 1.2 * wanted.min()
    _agree(seen, wanted)


def test_a_grid_is_written_only_where_it_differs():
    clouds, _ = _with_grid(0)
    image = next(x for x in bpy.data.images if x.name.startswith(cloud_grids.NAME))
    image.pack()
    cloud_table.write_grids(image, clouds.group.clouds)
    assert not image.is_dirty
    (one,) = clouds.group.clouds
    cloud_table.write_grids(image, [replace(one, transport=2.0 * one.transport)])
    assert image.is_dirty
    bpy.data.images.remove(image)


@pytest.mark.slow
@COUNTS
@pytest.mark.parametrize("part", ["scattered", "transmittance"])
def test_lamps_in_clouds(square, tmp_path, count, part):  # noqa: F811
    """Cycles, which draws the nodes here, has no room for both parts and the water at once."""
    at = _position(square, tmp_path)
    clouds, in_nodes = _clouds(count)
    projected = _projected(IsotropicProfile(), clouds=0.4)
    images = lamp_images.new_images(
        2, 2, lamp_images.LampRows.of_parts(projected.parts, projected.measured, in_clouds=True)
    )
    lamp_images.write_lamps(images, projected, [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    w, P = (0.0, 0.6, -0.8), 4.5

    def of(found, lamp, light, x, y, add):
        origin = (x, y, 3.0)
        past = ray_past_lamp(lamp, origin, w, P, found.m, before_surface=True)
        through = LampAndClouds(found, lamp, past, origin, w, P)
        if part == "transmittance":
            return through.transmittance(3.0 + x, past.place(x + 0.2))
        return found.group.total(lambda cloud: through.scattered(cloud, light, add))[0]

    def nodes(graph, position):
        x, y, _ = graph.components(position)
        table = lamp_table.LampTable.of(graph, images)
        index = graph.operation("ADD", (graph.operation("MULTIPLY", (x, 0.0)), 1.0))
        light = table.in_water(index, projected.components)
        add = functools.partial(summed, graph)
        return of(in_nodes(graph), table.lamp(index), light, x, y, add)

    seen = square(nodes, tmp_path / "lamp.exr")
    _, (lamp, light) = projected.lights()
    _agree(seen, of(clouds, lamp, light, at[..., :1], at[..., 1:2], add_up))


@pytest.mark.slow
@pytest.mark.parametrize("part", ["scattered", "between", "rays"])
def test_lamps_in_a_grid(square, tmp_path, part):  # noqa: F811
    at = _position(square, tmp_path)
    clouds, in_nodes = _with_grid(0)
    projected = _projected(IsotropicProfile(), clouds=0.4)
    images = lamp_images.new_images(
        2, 2, lamp_images.LampRows.of_parts(projected.parts, projected.measured, in_clouds=True)
    )
    lamp_images.write_lamps(images, projected, [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    w, P = (0.0, 0.6, -0.8), 4.5

    def of(found, lamp, light, number, x, y, add, follow):
        origin = (x, y, 3.0)
        (cloud,) = found.group.grids
        if part == "between":
            beyond = (-0.1 + 0.6 * x, 1.4 + 0.6 * y, 0.55 + 0.0 * x)
            way = [1.3 * (a - b) for a, b in zip(beyond, lamp.position, strict=True)]
            return found.m.exp(
                -(cloud.transport * cloud.from_lamp(number, lamp.position, way, found.m))
            )
        rays = found.rays(found.group.grids, origin, w, P, add)
        if part == "rays":
            ray = rays[id(cloud)]
            return cloud.transport * ray.column(3.2, found.m) + ray.middle
        past = ray_past_lamp(lamp, origin, w, P, found.m, before_surface=True)
        through = LampAndClouds(found, lamp, past, origin, w, P, number, rays)
        return through.scattered(cloud, light, add, follow)[0]

    def nodes(graph, position):
        x, y, _ = graph.components(position)
        table = lamp_table.LampTable.of(graph, images)
        index = graph.operation("ADD", (graph.operation("MULTIPLY", (x, 0.0)), 1.0))
        light = table.in_water(index, projected.components)
        add, follow = (
            functools.partial(summed, graph),
            functools.partial(followed, graph, skips=False),
        )
        return of(in_nodes(graph), table.lamp(index), light, index, x, y, add, follow)

    seen = square(nodes, tmp_path / "lamp.exr")
    _, (lamp, light) = projected.lights()
    wanted = of(clouds, lamp, light, 1, at[..., :1], at[..., 1:2], add_up, march)
    assert wanted.max() > 1.2 * wanted.min()
    _agree(seen, wanted)


def test_lamps_on_objects_below_clouds(square, tmp_path):  # noqa: F811
    at = _position(square, tmp_path)
    clouds, in_nodes = _clouds(1)
    projected = _projected(virtual=0.2, clouds=0.4)
    images = lamp_images.new_images(
        2, 2, lamp_images.LampRows.of_parts(projected.parts, projected.measured, in_clouds=True)
    )
    lamp_images.write_lamps(images, projected, [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    group = realtime_lamps.build_patch(images, ("J",), clouds=in_nodes)
    colour, normal = (0.8, 0.4, 0.1), (0.0, 0.6, 0.8)

    def nodes(graph, position):
        del position
        node = graph.node("ShaderNodeGroup", node_tree=group)
        node.inputs["Normal"].default_value = normal
        node.inputs["Color"].default_value = (*colour, 1.0)
        node.inputs["Lamp Visibility"].default_value = (0.0, 1.0, 0.0)
        return graph.term(node.outputs["J"])

    seen = square(nodes, tmp_path / "lamp.exr")
    x, y = at[..., :1], at[..., 1:2]
    J = sum(projected.reflected((x, y, 0.0), normal, colour, 0.0 * x, visible=1.2))
    transmittance = lamp_lit_cloud.transmittance_to_surface(
        clouds, projected.lamps[1], (x, y, 0.0 * x)
    )
    assert transmittance.min() < 0.8
    _agree(seen, J * transmittance)


def test_numbers_of_clouds_keep_their_places_in_the_image():
    clouds, _ = _clouds(2)
    image = cloud_table.new_image(2)
    first, second = clouds.group.clouds
    cloud_table.write_clouds(image, [first, replace(second, transport=np.array([7.0, 8.0, 9.0]))])
    texels = np.array(image.pixels).reshape(*reversed(image.size), 4)
    assert np.any(np.all(texels[1, :, :3] == (7.0, 8.0, 9.0), axis=-1))
    assert math.isclose(texels[0, 0, 0], first.reference)
    bpy.data.images.remove(image)
