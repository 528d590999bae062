"""Tables in images, rendered, against the same tables in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.node_groups import texture_atlas
from underwater_spectral.node_groups.image_table import ImageTable, Tiles, write_tiles
from underwater_spectral.node_groups.node_mathematics import NODES
from underwater_spectral.uw_spectral.table import (
    LOGARITHMIC,
    Axis,
    Scale,
    Table,
    discrete_axis,
    root,
)

from .test_texture_atlas import _drawn

R, ANGLE = Scale(5, 0.1, 10.0, LOGARITHMIC), Scale(6, 0.0, 2.0, root(2.0))
AXES = discrete_axis("which", 5), R.axis("r"), ANGLE.axis("angle"), Axis("column", 4)
MARGINS = pytest.mark.parametrize("margin", [0, 1])


def _image(values, tiles, margin, column=3, row=2):
    image = texture_atlas.number_image("Table", 128, 96)
    image.use_half_precision = False
    # What is not of the table would be seen.
    texels = np.full((96, 128, 4), 50.0, np.float32)
    write_tiles(texels[row:, column:], values, tiles, margin)
    image.pixels.foreach_set(texels.ravel())
    return image


def _agree(path, values, axes, of_place, tiles, margin, **more):
    """Draw a table at coordinates by the places across and up the picture, and look them up."""
    image = _image(values, tiles, margin)

    def look_up(graph, x, y):
        table = ImageTable(graph, image, axes, 3.0, 2.0, tiles, margin, **more)
        found = table.at(**of_place(x, y))
        return graph.vector(graph.components(found)[1], x, y)

    seen, x, y = np.moveaxis(_drawn("CYCLES", look_up, path), -1, 0)
    wanted = Table(values, axes).at(**of_place(x[..., None], y[..., None]))[..., 1]
    np.testing.assert_allclose(seen, wanted, atol=2e-3)


@MARGINS
@pytest.mark.parametrize("which", [0.0, 4.0])
def test_nodes_look_up_what_numpy_does(which, margin, tmp_path):
    """Tiles in lines of three, and those of the second axis above them."""
    high, wide = 6 + 2 * margin, 4 + 2 * margin
    tiles = Tiles(columns=wide, rows=5 * high, across=3), Tiles(rows=high)
    values = np.random.default_rng(3).uniform(0.2, 1.0, (5, 5, 6, 4, 3))

    def of_place(x, y):
        # From before the first entries to beyond the last ones, which are held.
        return {"which": which, "r": x * 12.0 + 0.05, "angle": y * 2.2, "column": y * 3.0}

    _agree(tmp_path / "a.exr", values, AXES, of_place, tiles, margin)


def test_a_row_is_looked_up_where_only_nodes_know_which(tmp_path):
    values = np.random.default_rng(4).uniform(0.2, 1.0, (5, 6, 3))
    image = _image(values[:, None], (Tiles(rows=1),), 0)

    def look_up(graph, x, y):
        which = NODES.floor(y * 4.999)
        row = ImageTable(graph, image, (ANGLE.axis("angle"),), 3.0, which + 2.0, margin=0)
        return graph.vector(graph.components(row.at(angle=x * 2.0))[1], x, y)

    seen, x, y = np.moveaxis(_drawn("CYCLES", look_up, tmp_path / "a.exr"), -1, 0)
    table = Table(values, (discrete_axis("which", 5), ANGLE.axis("angle")))
    wanted = table.at(which=np.floor(y * 4.999)[..., None], angle=2.0 * x[..., None])[..., 1]
    np.testing.assert_allclose(seen, wanted, atol=2e-3)


@pytest.mark.parametrize("numbers", [1, 2])
def test_entries_may_be_numbers(numbers, tmp_path):
    values = np.random.default_rng(5).uniform(0.2, 1.0, (6, 4, numbers))
    image = _image(values, (), 1)

    def look_up(graph, x, y):
        table = ImageTable(graph, image, AXES[2:], 3.0, 2.0, numbers=numbers)
        found = table.at(angle=y * 2.0, column=x * 3.0)
        return graph.vector(found if numbers == 1 else found[1], x, y)

    seen, x, y = np.moveaxis(_drawn("CYCLES", look_up, tmp_path / "a.exr"), -1, 0)
    wanted = Table(values, AXES[2:]).at(angle=2.0 * y[..., None], column=3.0 * x[..., None])
    np.testing.assert_allclose(seen, wanted[..., -1], atol=2e-3)


def test_all_of_a_numbered_axis_are_found_where_none_is_named(tmp_path):
    values = np.random.default_rng(6).uniform(0.2, 1.0, (5, 6, 4, 3))
    axes, tiles = (AXES[0], *AXES[2:]), (Tiles(columns=6),)
    image = _image(values, tiles, 1)

    def look_up(graph, x, y):
        found = ImageTable(graph, image, axes, 3.0, 2.0, tiles).at(angle=y * 2.0, column=x * 3.0)
        return graph.vector(graph.components(sum(found))[1], x, y)

    seen, x, y = np.moveaxis(_drawn("CYCLES", look_up, tmp_path / "a.exr"), -1, 0)
    found = Table(values, axes).at(angle=2.0 * y[..., None], column=3.0 * x[..., None])
    np.testing.assert_allclose(seen, sum(found)[..., 1], atol=1e-2)
