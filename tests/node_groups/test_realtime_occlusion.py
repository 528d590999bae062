"""Occlusion as EEVEE looks it up, rendered, against the table in numpy, per pixel."""

from __future__ import annotations

import dataclasses

import numpy as np
from underwater_spectral.node_groups import realtime_occlusion
from underwater_spectral.scene.terms.occlusion import OcclusionTerm
from underwater_spectral.scene.water import frame_water
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.tests.node_groups.test_realtime_groups import _column
from underwater_spectral.uw_spectral.occlusion import occlusion_table as tables
from underwater_spectral.uw_spectral.occlusion.grid import Grid
from underwater_spectral.uw_spectral.occlusion.probe_irradiance import ProbeIrradiance
from underwater_spectral.uw_spectral.occlusion.view_directions import COUNT
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.channel_tables import ON_PATH
from underwater_spectral.uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, tabulate
from underwater_spectral.uw_spectral.transfer.sun_beam import half_angle2
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.sun_beam import sun_beam

WEIGHTS = np.eye(3)
TURNING = 0.05
UNDERSIDE = ((-1.5, 0.2, -3.0), (3.0, 0.0, 0.0), (0.0, 1.0, -1.0))


def _water():
    wavelengths = Bands.uniform(3).centres
    a, b = 0.03 + 0.3 * ((wavelengths - 400) / 300) ** 2, 0.1 * 550 / wavelengths
    lobes = parse_phase("mixture").for_bands(b, 0.003 * (550 / wavelengths) ** 4)
    return _column(3, a, b, surface="none", sky="uniform", floor_depth=np.inf), lobes


def _table(column, seed=3):
    """Random occlusion, smooth from cell to cell, about the view."""
    random = np.random.default_rng(seed)
    grid = Grid((-5.0, -2.0, -9.0), 1.0, (10, 9, 8))
    along = grid.centres() @ random.normal(size=(3, 2 * COUNT)) * 0.5
    mean, fraction = 0.6 + 0.3 * np.sin(along), 0.2 * np.cos(along)
    ratios = mean[..., None] + fraction[..., None] * np.array([1.0, 0.2, -0.8])
    on_patches, scattered = np.split(ratios, 2, axis=1)
    for light in (on_patches, scattered):
        light += 0.15 * np.sin(along[:, :COUNT, None] + 1.0) * np.array([0.3, -1.0, 0.6])
    light = ProbeIrradiance(
        grid, np.ones(grid.count, bool), on_patches, scattered, 0.5 + 0.5 * np.sin(along[:, 0]),
        np.full(3, TURNING), 0.7,
    )  # fmt: skip
    return tables.occlusion_table(light, column.attenuation, np.ones(3))


def _along_rays(table, rate, camera, w, P, spectra):
    """Numbers of the table along rays whose light falls off at a rate by band."""
    found = [table.along(camera, w, P, each[:, None]) for each in rate.T]
    return np.stack([x @ of_band for x, of_band in zip(found, spectra.T, strict=True)], axis=1)


def _inputs(column, lobes, table):
    field = column.solved_field(lobes, OCCLUSION_STREAMS)
    return FrameInputs(terms=(OcclusionTerm(table, field),))


def test_open_water_is_occluded_as_the_table_says(tmp_path):
    column, lobes = _water()
    solved, table = column.solved_field(lobes), _table(column)
    view = probe.View(5.0, 88.0, square=None)
    water = frame_water.realtime_water(
        column, lobes, 5.0, WEIGHTS, solved=solved, inputs=_inputs(column, lobes, table)
    )
    seen = probe.render(water, view, tmp_path / "a.exr")
    w = view.rays().reshape(-1, 3)
    light, sun = tabulate(solved), solved.sun
    columns = [part[:, None] for part in w.T]
    s2 = half_angle2(w.T, sun)

    def single_scattering(field):
        beam = dataclasses.replace(sun_beam(column, lobes), cp=field.extinction)
        P = np.minimum(beam.boundary(5.0, columns), 1e6)
        found = beam.single_scattering(5.0, columns, P, without_peak=True)
        return found * field.aureole([5.0], s2)[:, 0].T, P[:, 0]

    # What fewer streams leave unscattered is not shaded as scattered light is.
    low_stream_field = column.solved_field(lobes, OCCLUSION_STREAMS)
    single, P = single_scattering(low_stream_field)
    M = light.scattered(np.full(len(w), 5.0), w.T, sun) + single_scattering(solved)[0] - single
    camera = np.array([0.0, 0.0, -5.0])
    up, c, sun_alone = w[:, 2:], low_stream_field.extinction, np.eye(4)[:, 3:]
    spectra = np.concatenate([np.ones((1, 3)), table.spectra[ON_PATH:], np.zeros((1, 3))])
    occlusion = _along_rays(table, c - light.decay * up, camera, w, P, spectra)
    lit = _along_rays(
        table, c * (1.0 - up / column.sun_cosine), camera, w, P, sun_alone @ [[1] * 3]
    )
    turned = (1.0 - np.exp(-5.0 * TURNING)) * np.minimum(s2 / 0.067, 1.0)[:, None] ** 2
    down = w[:, 2] < -0.05
    wanted = (single * (1.0 - turned) * lit + (M + single * turned) * occlusion)[down]
    errors = np.abs(seen.reshape(-1, 3)[down] / wanted - 1.0)
    assert np.median(errors) < 3e-3
    assert np.quantile(errors, 0.99) < 0.02
    unoccluded = np.abs((single + M)[down] / wanted - 1.0)
    assert np.median(unoccluded) > 0.15


def test_patches_are_occluded_as_the_table_says(tmp_path):
    """The underside of a square over sand, in water so clear that only its own light is seen."""
    column, _ = _water()
    clear = {"absorption": np.full(3, 1e-4), "scattering": np.full(3, 1e-3)}
    floor = {"floor_depth": 12.0, "floor_reflectance": np.full(3, 0.5)}
    column = dataclasses.replace(column, **clear, **floor)
    lobes = parse_phase("mixture").for_bands(column.scattering, np.full(3, 5e-4))
    solved, table = column.solved_field(lobes), _table(column)
    view = probe.View(5.0, 210.0, square=UNDERSIDE)
    pictures = [
        probe.render(
            frame_water.realtime_water(
                column,
                lobes,
                5.0,
                WEIGHTS * 50,
                solved=solved,
                inputs=_inputs(column, lobes, occlusion),
            ),
            view,
            tmp_path / "a.exr",
        )
        for occlusion in (table, tables.without_occlusion(3))
    ]
    P, normal, where = probe.square_ahead(view)
    on_it = where == 1
    assert normal @ column.sun_direction > 0.1, "the sun shines on its back"
    points = (view.rays() * P[..., None])[on_it] + [0.0, 0.0, -5.0]
    beside = points + normal * tables.OFF_SURFACE * table.grid.cell
    numbers = table.mixed(tables.IRRADIANCE, beside, np.tile(normal, (len(beside), 1)))
    wanted = numbers[:, :1] + numbers[:, 1:3] @ table.spectra[:ON_PATH]
    ratio = pictures[0][on_it] / pictures[1][on_it]
    assert on_it.sum() > 30
    assert np.median(np.abs(ratio / wanted - 1.0)) < 0.02


def test_an_image_of_another_size_takes_the_place_of_one():
    image = realtime_occlusion.new_image()
    name = image.name
    table = _table(_water()[0])
    realtime_occlusion.write_table(image, table)
    import bpy

    found = bpy.data.images[name]
    # A cell around the grid of 10 × 9 × 8.
    assert tuple(found.size) == (COUNT * 12, 2 * 11 * 10)
    atlas = np.empty(len(found.pixels), np.float32)
    found.pixels.foreach_get(atlas)
    np.testing.assert_array_equal(
        atlas.reshape(220, COUNT * 12, 4), realtime_occlusion.pixels(table)
    )
