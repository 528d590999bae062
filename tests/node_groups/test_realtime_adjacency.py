"""What objects in view block and carry, as EEVEE looks it up, against numpy, per pixel."""

from __future__ import annotations

from unittest import mock

import numpy as np
from scipy.ndimage import map_coordinates
from underwater_spectral.scene.terms.occlusion import OcclusionTerm
from underwater_spectral.scene.water import frame_water
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.tests.node_groups.test_realtime_groups import _column
from underwater_spectral.uw_spectral.occlusion.adjacency import Adjacency
from underwater_spectral.uw_spectral.occlusion.occlusion_table import without_occlusion
from underwater_spectral.uw_spectral.occlusion.view_map import SIZE, view_map
from underwater_spectral.uw_spectral.occlusion.visibility_buffer import visibility_buffer
from underwater_spectral.uw_spectral.transfer.pixel_parts import Around
from underwater_spectral.uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

VIEW = probe.View(5.0, 88.0)


def _wave(low: float, high: float, turn: float) -> np.ndarray:
    """A smooth picture in three channels."""
    x, y = np.meshgrid(*[np.linspace(0.0, 9.0, SIZE)] * 2)
    waves = [np.sin(x + k + turn) * np.cos(1.3 * y - k) for k in range(3)]
    return low + (high - low) * (0.5 + 0.5 * np.stack(waves))


def test_a_square_is_drawn_as_numpy_has_it(tmp_path):
    a, b = np.array([0.05, 0.08, 0.3]), np.array([0.3, 0.25, 0.2])
    lobes = parse_phase("mixture").for_bands(b, np.full(3, 0.003))
    column = _column(3, a, b, surface="none", sky="uniform", floor_depth=np.inf)
    turned = np.array(VIEW.matrix.to_3x3())
    view = view_map((0.0, 0.0, -VIEW.depth), turned, 1.2)
    field = column.solved_field(lobes, OCCLUSION_STREAMS)
    occlusion = OcclusionTerm(without_occlusion(3), field, visibility_buffer(view, []))
    inputs = FrameInputs(terms=(occlusion,))
    water = frame_water.realtime_water(column, lobes, VIEW.depth, np.eye(3), inputs=inputs)
    level = float(water.field.scalar_irradiance(VIEW.depth).max())
    adjacency = Adjacency(
        _wave(0.1, 0.4, 0.0), _wave(0.2, 1.0, 2.0), _wave(-0.02, 0.1, 1.0) * level
    )

    def around(points: np.ndarray, *factors: float) -> Around:
        h, v = view.place(list(points.T))
        images = adjacency.blocked, adjacency.own, adjacency.beside
        parts = (
            factor * np.stack([map_coordinates(x, [v, h], order=1) for x in image], axis=1)
            for factor, image in zip(factors, images, strict=True)
        )
        return Around(*parts)

    def errors(*factors: float) -> np.ndarray:
        wanted, where = probe.expected_of_projected(
            water, VIEW, lambda points: around(points, *factors)
        )
        return np.abs(found / wanted - 1.0)[where == 1]

    with mock.patch.object(OcclusionTerm, "adjacency", return_value=adjacency):
        found = probe.render(water, VIEW, tmp_path / "a.exr")
    right = errors(1.0, 1.0, 1.0)
    assert len(right) > 30
    assert np.median(right) < 2e-3
    assert np.quantile(right, 0.99) < 0.01
    for factors in ((0.9, 1.0, 1.0), (1.0, 0.9, 1.0), (1.0, 1.0, 0.9)):
        assert np.quantile(errors(*factors), 0.9) > 0.01
