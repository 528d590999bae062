"""Water from pictures of surfaces that nobody knows: amounts, intervals, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.datasets import command_line, fit_command
from underwater_spectral.datasets.applied_pictures import FLAT, AppliedSettings, PictureFilter
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.description import (
    BandsDescription,
    CameraDescription,
    Description,
    WaterDescription,
)
from underwater_spectral.uw_spectral.imaging.picture_cells import SeenPicture, bins_of
from underwater_spectral.uw_spectral.imaging.picture_fit import fit_picture
from underwater_spectral.uw_spectral.imaging.water_fit import FITTED, FittedWater
from underwater_spectral.uw_spectral.spectra.colour_rendering import training_reflectances
from underwater_spectral.uw_spectral.spectra.spectral_image import (
    write_codes,
    write_exr,
    write_rgb_exr,
)
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.phase_functions import FournierForand

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
SEA = Description(camera=CameraDescription("ARRI D21"), surface=FLAT)
TRUTH = Constituents(chlorophyll=1.4, cdom=0.3, minerals=1.5)
DEPTH = 6.0
PHASES = (FournierForand(),)
CAMERA = PinholeCamera.from_field_of_view(256, 192, 60.0)
ROWS, COLUMNS = np.mgrid[: CAMERA.height, : CAMERA.width]


def _drawn(truth=TRUTH, depth=DEPTH, seed=0, shade=(0.2, 1.0)) -> tuple[SeenPicture, float]:
    """Tiles of measured reflectances, shaded, at random distances over a floor, and their mean.

    On 24 bands, with noise of 1 %, light of the water as ``uw-spectral apply`` has it.
    """
    rng = np.random.default_rng(seed)
    sea = replace(SEA, water=WaterDescription(truth), bands=BandsDescription(24))
    apply = PictureFilter(AppliedSettings(sea, depth))
    view, tables = apply.water.view, apply.tables(CAMERA)
    nm = view.column.bands.centres
    c = float(np.interp(550.0, nm, view.attenuation))
    count = int(rng.integers(60, 250))
    middles = rng.uniform(size=(count, 2)) * [CAMERA.height, CAMERA.width]
    places = np.stack([ROWS, COLUMNS], axis=-1)[:, :, None]
    tile = np.argmin(np.square(places - middles).sum(axis=-1), axis=-1)
    far = min(rng.uniform(3.0, 6.0) / c, 25.0)
    near = min(rng.uniform(0.3, 1.0), far / 3.0)
    high = (ROWS + 0.5) / CAMERA.height
    floor = near * (far / near) ** (1.0 - high)
    away = np.exp(rng.uniform(*np.log([near, far]), count))
    P = np.where((rng.uniform(size=count) < 0.5)[tile], away[tile], floor)
    P[(rng.uniform(size=count) < 0.1)[tile] & (high < 0.5)] = np.inf
    known = training_reflectances()
    rho = known.at(np.clip(nm, *known.range)).T
    rho = rho[rng.integers(0, len(rho), count)] * rng.uniform(*shade, count)[:, None]
    seen = np.isfinite(P)[..., None]
    along = np.where(seen, P[..., None], 0.0)
    y = np.clip(depth - tables.rays[..., 2] * along[..., 0], 0.0, np.inf)
    light = np.exp(-view.attenuation * along) * view.field.Ed(y) / np.pi * seen
    black = tables.components(np.zeros((3, *P.shape), np.float32), P.astype(np.float32))
    values = black.B + black.F + light * rho[tile] @ view.reduction.response.T
    values /= values.max()
    values += np.hypot(0.01 * values, 0.0005) * rng.standard_normal(values.shape)
    return SeenPicture(values, P, tables.rays), float(rho[tile][seen[..., 0]].mean())


def _inside(fitted: FittedWater, truth: Constituents) -> list[bool]:
    return [
        getattr(fitted.low, name) <= getattr(truth, name) <= getattr(fitted.high, name)
        for name in FITTED
    ]


def _a(water: Constituents) -> np.ndarray:
    return water.water().a([450.0, 550.0, 600.0])


def _c(water: Constituents) -> np.ndarray:
    return _a(water) + water.water().b([450.0, 550.0, 600.0])


def _widths(fitted: FittedWater) -> np.ndarray:
    """Of the intervals, over the true amounts."""
    return np.array([
        (getattr(fitted.high, name) - getattr(fitted.low, name)) / getattr(TRUTH, name)
        for name in FITTED
    ])  # fmt: skip


@pytest.fixture(scope="module")
def picture() -> SeenPicture:
    return _drawn()[0]


def test_water_of_a_picture_is_found(picture):
    """Absorption is told well, attenuation less; chlorophyll hardly, for CDOM stands for it."""
    fitted = fit_picture(picture, SEA, DEPTH)
    assert all(_inside(fitted, TRUTH))
    assert _a(fitted.constituents) == pytest.approx(_a(TRUTH), rel=0.03)
    assert _c(fitted.constituents) == pytest.approx(_c(TRUTH), rel=0.25)
    assert 0.2 < fitted.misfit < 1.3
    widths = _widths(fitted)
    assert widths.min() > 0.0
    assert (widths < [7.0, 0.6, 0.8]).all()


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    rng, inside = np.random.default_rng(11), []
    ranges = ((0.05, 10.0), (0.01, 0.5), (0.02, 5.0))
    for seed in range(12):
        truth = Constituents(*(float(np.exp(rng.uniform(*np.log(each)))) for each in ranges))
        depth = rng.uniform(2.0, 12.0)
        inside.append(_inside(fit_picture(_drawn(truth, depth, seed)[0], SEA, depth), truth))
    assert np.mean(inside) >= 0.9


@pytest.mark.slow
def test_distances_that_are_off_are_seen(picture):
    nearer = replace(picture, distances=picture.distances / 1.5)
    fitted = fit_picture(nearer, SEA, DEPTH)
    assert not all(_inside(fitted, TRUTH))


@pytest.mark.slow
def test_a_known_mean_reflectance_narrows_the_intervals():
    picture, mean = _drawn()
    grey = Spectrum(np.array([1.0, 1e6]), np.full(2, mean), "mean")
    without, known = (fit_picture(picture, SEA, DEPTH, rho) for rho in (None, grey))
    assert all(_inside(known, TRUTH))
    assert _widths(known).sum() < 0.9 * _widths(without).sum()


@pytest.mark.slow
def test_distances_too_short_are_refused():
    clear = Constituents(0.05, 0.01, 0.02)
    picture = _drawn(clear, shade=(0.2, 1.0))[0]
    near = np.where(picture.distances < 1.2, picture.distances, np.nan)
    with pytest.raises(InputError, match=r"attenuation|dark|distances"):
        fit_picture(replace(picture, distances=near), SEA, DEPTH)


def _plain(values=0.3, distances=None, size=(64, 64)) -> SeenPicture:
    directions = np.zeros((*size, 3))
    directions[..., 1] = 1.0
    P = np.linspace(1.0, 8.0, size[0])[:, None] * np.ones(size[1])
    return SeenPicture(
        np.full((*size, 3), values), P if distances is None else distances, directions
    )


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (_plain(distances=np.full((64, 64), 2.0)), "all that is seen is 2 to 2 m away"),
        (_plain(np.nan), "no part of the picture is unclipped"),
        (_plain(distances=np.full((64, 64), np.inf)), "no part of the picture is unclipped"),
        (_plain(size=(40, 40), distances=np.linspace(1, 8, 40)[:, None] * np.ones(40)),
         "shows 3 distances well enough, 5 are needed"),
    ],
)  # fmt: skip
def test_what_does_not_tell_the_water_is_refused(picture, message):
    with pytest.raises(InputError, match=message):
        bins_of(picture, PHASES)


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"needs distances and directions of its pixels"):
        replace(_plain(), distances=np.ones((64, 63)))
    with pytest.raises(InputError, match="distances must be above 0"):
        replace(_plain(), distances=np.zeros((64, 64)))


def test_the_darkest_is_chosen_by_other_pixels_than_are_read():
    rng = np.random.default_rng(2)
    noisy = _plain(0.3 + 0.03 * rng.standard_normal((64, 64, 3)))
    dark = bins_of(noisy, PHASES).dark
    assert dark.value.mean() == pytest.approx(0.3, abs=3 * 0.03 / np.sqrt(8 * dark.value.size))


def _given(tmp_path, monkeypatch, picture, depth, *options):
    np.save(tmp_path / "depth.npy", depth)
    return _given_file(tmp_path / "depth.npy", monkeypatch, picture, *options)


def _given_file(depth, monkeypatch, picture, *options):
    given = []
    water = Constituents(1.0)
    monkeypatch.setattr(
        fit_command, "fit_picture",
        lambda *all_: given.append(all_) or FittedWater(water, water, water, 1.0),
    )  # fmt: skip
    arguments = ["fit", str(picture), str(depth), "--camera", "ARRI D21"]
    assert command_line.main([*arguments, "--depth", "6", "--fov", "60", *options]) == 0
    return given[0]


def test_command_undoes_the_development(tmp_path, monkeypatch):
    """Of a picture that ``uw-spectral apply`` made: light of black surfaces, up to the exposure."""
    sea = replace(SEA, water=WaterDescription(TRUTH))
    apply = PictureFilter(AppliedSettings(sea, DEPTH))
    camera = PinholeCamera.from_field_of_view(32, 24, 60.0)
    z = np.linspace(1.0, 4.0, 24)[:, None] * np.ones(32)
    z[0] = 0.0
    write_rgb_exr(tmp_path / "wet.exr", apply.picture(np.zeros((24, 32, 3)), z, camera))
    seen, description, depth, mean = _given(tmp_path, monkeypatch, tmp_path / "wet.exr", z)
    assert (description.camera.sensor, depth, mean) == ("ARRI D21", 6.0, None)
    tables = apply.tables(camera)
    P = apply.distances(z, camera, "depth")
    np.testing.assert_allclose(seen.distances, P, rtol=1e-6)
    np.testing.assert_allclose(seen.directions, tables.rays, atol=1e-12)
    parts = tables.components(np.zeros((3, 24, 32), np.float32), P)
    ratio = seen.values / (parts.B + parts.F)
    assert ratio / ratio.mean() == pytest.approx(np.ones_like(ratio), rel=0.03)


def test_a_file_that_names_its_depth_is_not_taken_for_ranges(tmp_path, monkeypatch):
    """Its planar depth was, where ``--ranges`` was asked for; ``apply`` goes by the file."""
    write_codes(tmp_path / "raw.png", np.full((24, 32, 3), 1000, np.uint16))
    write_exr(tmp_path / "depth.exr", np.full((24, 32, 1), 2.0, np.float32), ["planar_depth"])
    for options in ((), ("--ranges",)):
        given = tmp_path / "depth.exr", monkeypatch, tmp_path / "raw.png", "--raw", *options
        assert _given_file(*given)[0].distances[0, 0] > 2.1


def test_command_leaves_out_what_is_clipped_or_unknown(tmp_path, monkeypatch):
    codes = np.full((24, 32, 3), 1000, np.uint16)
    codes[3, 4, 1], codes[5, 6, 2] = 0, 65535
    write_codes(tmp_path / "raw.png", codes)
    z = np.full((24, 32), 2.0)
    z[0, 0] = np.nan
    options = ("--raw", "--invalid", "fill", "--mean-reflectance", "0.2")
    seen, _, _, mean = _given(tmp_path, monkeypatch, tmp_path / "raw.png", z, *options)
    assert np.argwhere(np.isnan(seen.values)).tolist() == [[3, 4, 1], [5, 6, 2]]
    assert seen.values[0, 0] == pytest.approx(np.full(3, 1000 / 65535))
    assert np.argwhere(np.isnan(seen.distances)).tolist() == [[0, 0]]
    assert mean.at([500.0]) == pytest.approx([0.2])


def test_command_refuses_what_hangs_on_the_water(tmp_path, capsys):
    write_rgb_exr(tmp_path / "wet.exr", np.ones((24, 32, 3), np.float32))
    np.save(tmp_path / "depth.npy", np.ones((24, 32)))
    files = [str(tmp_path / "wet.exr"), str(tmp_path / "depth.npy")]
    arguments = ["--camera", "ARRI D21", "--depth", "6", "--fov", "60", "--white-balance", "depth"]
    assert command_line.main(["fit", *files, *arguments]) == 2
    assert "give raw channels (--raw)" in capsys.readouterr().err
