"""Look-ups in tables, rendered, against linear interpolation in numpy."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import texture_atlas
from underwater_spectral.node_groups.node_mathematics import Graph
from underwater_spectral.scene.engines import exr_output
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.table import Axis, Table

WIDTH, HEIGHT = 64, 36


def _drawn(engine, look_up, path):
    """Draw a function of the places of a table's width and height, which fill the picture."""
    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
        scene.world = bpy.data.worlds.new("World")
        scene.world.cycles.sampling_method = "NONE"  # it is no lamp
    scene.render.engine = engine
    scene.cycles.samples = scene.eevee.taa_render_samples = 1
    scene.cycles.use_denoising, scene.cycles.filter_width = False, 0.01
    scene.render.filter_size = 0.0
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    tree = scene.world.node_tree
    tree.nodes.clear()
    graph = Graph(tree)
    window = graph.term(graph.node("ShaderNodeTexCoord").outputs["Window"])
    background = graph.node("ShaderNodeBackground")
    graph.assign(look_up(graph, *graph.components(window)[:2]), background.inputs["Color"])
    output = graph.node("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    exr_output.write_float_exr(scene, path)
    return read_exr(path)[0].astype(np.float64)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("size", [(4, 4), (7, 5), (1, 9), (640, 1), (1301, 3000)])
@pytest.mark.parametrize("engine", ["CYCLES", "BLENDER_EEVEE"])
def test_tables_are_looked_up_linearly(engine, size, tmp_path):
    columns, rows = size
    image = texture_atlas.number_image("Table", columns, rows)
    image.use_half_precision = False
    table = np.ones((rows, columns, 4), np.float32)
    table[..., :3] = np.random.default_rng(1).uniform(0.2, 1.0, (rows, columns, 3))
    image.pixels.foreach_set(table.ravel())

    def look_up(graph, x, y):
        # To the middles of the outermost texels, which no margin is needed for.
        h, v = x * float(columns - 1), y * float(rows - 1)
        found = texture_atlas.texel(graph, image, h, v, columns, rows)
        return graph.vector(graph.components(found)[1], x, y)

    seen, *place = np.moveaxis(_drawn(engine, look_up, tmp_path / "a.exr"), -1, 0)
    h, v = (x[..., None] * (n - 1.0) for x, n in zip(place, (columns, rows), strict=True))
    wanted = Table(table[..., :3], (Axis("v", rows), Axis("h", columns))).at(v=v, h=h)[..., 1]
    # Half floats draw the place of a large table within a texel or two.
    if engine == "CYCLES":
        error = np.abs(seen - wanted)
        assert np.median(error) < 1e-4
        assert error.max() < (1e-3 if rows < 1000 else 2e-2)
    elif rows < 1000:
        assert np.abs(seen - wanted).max() < 2e-3 + 1e-3 * max(columns, rows)


@pytest.mark.slow
@pytest.mark.parametrize("tiled", [False, True])
def test_tiles_begin_anew_beyond_their_edges(tiled, tmp_path):
    image = texture_atlas.number_image("Tile", 4, 2)
    image.use_half_precision = False
    row = np.array([0.1, 0.5, 0.2, 0.9])
    table = np.ones((2, 4, 4), np.float32)
    table[..., :3] = row[None, :, None]
    image.pixels.foreach_set(table.ravel())

    def look_up(graph, x, y):
        # From the middle of the texel before the first to the middle of the last.
        found = texture_atlas.texel(graph, image, x * 4.0 - 1.0, y, 4, 2, tiled=tiled)
        return graph.vector(graph.components(found)[0], x, y)

    seen, x, _ = np.moveaxis(_drawn("CYCLES", look_up, tmp_path / "a.exr"), -1, 0)
    wanted = np.interp(4.0 * x - 1.0, np.arange(-1, 4), [row[-1] if tiled else row[0], *row])
    np.testing.assert_allclose(seen, wanted, atol=1e-4)


def test_single_texels_of_tables_keep_their_digits(tmp_path):
    image = texture_atlas.number_image("Table", 5, 3)
    image.use_half_precision = False
    table = np.ones((3, 5, 4), np.float32)
    table[..., :3] = np.arange(45.0).reshape(3, 5, 3) + 0.1234567
    image.pixels.foreach_set(table.ravel())
    for row in range(3):
        for column in range(5):

            def look_up(graph, x, y, at=(column, row)):
                del x, y
                return texture_atlas.closest(graph, image, float(at[0]), float(at[1]))

            if (column + row) % 2 == 0:
                seen = _drawn("CYCLES", look_up, tmp_path / "a.exr")
                np.testing.assert_array_equal(seen[3, 4].astype(np.float32), table[row, column, :3])
