"""The detector's noise has the statistics of EMVA 1288, and its files are read by others."""

from __future__ import annotations

import dataclasses
import json

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest
import rawpy
from underwater_spectral.uw_spectral.detector import (
    PATTERNS,
    Detector,
    RawSettings,
    Vignetting,
    capture,
    dark_counts,
    expected_counts,
    filter_of_pixels,
    mosaic,
    raw_counts,
    write_dng,
)
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import write_codes

SHAPE = (400, 500)
QUIET = Detector(read_noise=0.0, dark_current=0.0, shot_noise=False)


def photon_transfer(detector: Detector, iso: float | None = None):
    """Means and temporal variances, from pairs of pictures as EMVA 1288 takes them."""
    means, variances = [], []
    levels = np.linspace(0.0, 0.8, 15) * detector.white_level / detector.gain_at(iso)
    levels = np.minimum(levels, 0.8 * detector.full_well)
    for number, electrons in enumerate(levels):
        one, two = (
            raw_counts(np.full(SHAPE, electrons), detector, 2 * number + i, iso=iso).astype(float)
            for i in (0, 1)
        )
        means.append((one.mean() + two.mean()) / 2)
        variances.append(((one - two) ** 2).mean() / 2 - (one.mean() - two.mean()) ** 2 / 2)
    return np.array(means), np.array(variances)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("detector", "iso"),
    [
        (Detector(gain=0.25, read_noise=3.0), None),
        (Detector(gain=0.25, read_noise=12.0), 400.0),
        (Detector(full_well=1500.0, gain=30.0, read_noise=2.0, bits=16, black_level=600.0), None),
        (Detector(gain=0.25, read_noise=20.0, gains=0.02, offsets=5.0, black_level=100.0), None),
    ],
)
def test_the_photon_transfer_returns_gain_and_read_noise(detector, iso):
    means, variances = photon_transfer(detector, iso)
    # A variance of n pixels is known to sqrt(2/n); weigh by that.
    slope, dark = np.polyfit(means - means[0], variances, 1, w=1 / variances)
    K = detector.gain_at(iso)
    assert slope == pytest.approx(K, rel=0.01)
    noise = np.sqrt(max(dark - 1 / 12, 0.0)) / K
    assert noise == pytest.approx(detector.read_noise, rel=0.03)


def test_the_photon_transfer_would_tell_a_wrong_noise():
    # Noise of the wrong kind does not pass: Gaussian of a constant width has no slope.
    means, variances = photon_transfer(Detector(read_noise=30.0, shot_noise=False))
    slope = np.polyfit(means, variances, 1)[0]
    assert abs(slope) < 0.05 * Detector().gain


def test_shot_noise_is_poisson_and_pixels_are_independent():
    detector = Detector(read_noise=0.0, dark_current=0.0, gain=1.0, bits=16, black_level=0.0)
    counts = raw_counts(np.full((1000, 1000), 7.0), detector, 5).astype(float)
    third = ((counts - 7.0) ** 3).mean()
    assert counts.mean() == pytest.approx(7.0, abs=4 * np.sqrt(7e-6))
    assert counts.var() == pytest.approx(7.0, rel=0.01)
    assert third == pytest.approx(7.0, rel=0.05)  # as large as the mean: a Gaussian has none
    rest = counts - counts.mean()
    assert abs((rest[:, 1:] * rest[:, :-1]).mean()) < 4 * 7e-3


def test_dark_current_grows_with_time():
    detector = Detector(read_noise=0.0, dark_current=20.0, gain=1.0, black_level=10.0)
    counts = dark_counts(SHAPE, detector, 1, exposure_time=4.0).astype(float)
    assert counts.mean() == pytest.approx(10.0 + 80.0, rel=0.001)
    assert counts.var() == pytest.approx(80.0 + 1 / 12, rel=0.02)


def test_read_noise_goes_below_black():
    detector = Detector(read_noise=10.0, gain=1.0, black_level=64.0, dark_current=0.0)
    counts = dark_counts(SHAPE, detector, 1).astype(float)
    assert counts.mean() == pytest.approx(64.0, abs=0.1)
    assert (counts < 64).mean() == pytest.approx(0.48, abs=0.01)  # 0.5 less half a count's share


def test_wells_and_counts_are_full():
    low = Detector(full_well=1000.0, gain=1.0, black_level=50.0, read_noise=0.0)
    counts = raw_counts(np.full(SHAPE, 5000.0), low, 0)
    assert set(np.unique(counts)) == {1050}
    high = dataclasses.replace(low, full_well=1e6)
    assert set(np.unique(raw_counts(np.full(SHAPE, 1e5), high, 0))) == {high.white_level}


def test_pixels_keep_their_gains_and_offsets():
    detector = dataclasses.replace(QUIET, gain=1.0, gains=0.01, offsets=8.0, bits=14)
    one, two = (raw_counts(np.full(SHAPE, 4000.0), detector, seed).astype(float) for seed in (1, 2))
    assert np.array_equal(one, two)
    dark = dark_counts(SHAPE, detector, 3).astype(float)
    assert dark.std() == pytest.approx(8.0, rel=0.02)
    assert (one - dark).std() / 4000.0 == pytest.approx(0.01, rel=0.03)
    other = raw_counts(np.full(SHAPE, 4000.0), dataclasses.replace(detector, device_seed=1), 1)
    assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.02


def test_the_same_seed_makes_the_same_picture():
    electrons = np.linspace(0, 9000, 200_000).reshape(SHAPE)
    one, again, other = (raw_counts(electrons, Detector(), seed) for seed in (7, 7, 8))
    assert np.array_equal(one, again)
    assert (one != other).mean() > 0.9


def test_expected_counts_are_the_mean():
    electrons = np.full(SHAPE, 3000.0)
    detector = Detector(dark_current=50.0)
    mean = raw_counts(electrons, detector, 2, exposure_time=2.0).mean()
    assert mean == pytest.approx(expected_counts(electrons, detector, exposure_time=2.0).mean(),
                                 rel=1e-3)  # fmt: skip


@pytest.mark.parametrize("pattern", PATTERNS)
def test_every_filter_sees_its_channel(pattern):
    picture = np.random.default_rng(1).random((5, 7, 3))
    seen = mosaic(picture, pattern)
    for i, letter in enumerate(pattern):
        y, x = divmod(i, 2)
        assert np.array_equal(seen[y::2, x::2], picture[y::2, x::2, "RGB".index(letter)])


def test_lenses_darken_towards_the_corners():
    size, focal, centre = (60, 40), (50.0, 50.0), (30.0, 20.0)
    natural = Vignetting().fraction(size, focal, centre)
    corner = np.cos(np.arctan(np.hypot(29.5, 19.5) / 50.0)) ** 4
    assert natural[0, 0] == pytest.approx(corner)
    radial = Vignetting(natural=False, radial=(-0.3, -0.1)).fraction(size, focal, centre)
    assert radial[20, 30] == pytest.approx(1.0, abs=1e-3)
    assert radial[0, 0] == pytest.approx(0.6, abs=0.03)
    flat = capture(np.full((40, 60, 3), 0.5), RawSettings(QUIET, 1.0))
    dark = capture(np.full((40, 60, 3), 0.5), RawSettings(QUIET, 1.0, vignetting=Vignetting()),
                   focal=focal, centre=centre)  # fmt: skip
    black = QUIET.black_level
    assert (dark - black)[0, 0, 0] / (flat - black)[0, 0, 0] == pytest.approx(corner, abs=1e-3)


def test_everything_is_off_by_default_and_recorded():
    settings = RawSettings(Detector(gain=0.5), 2.0, pattern="GRBG", vignetting=Vignetting())
    record = json.loads(json.dumps(settings.record()))
    assert record["detector"]["gain"] == 0.5
    assert record["vignetting"]["natural"] is True
    plain = RawSettings(QUIET, 1.0)
    assert plain.pattern is plain.vignetting is None
    assert capture(np.full((2, 2, 3), 0.5), plain).shape == (2, 2, 3)


def test_sixteen_bit_tiff_keeps_every_count(tmp_path):
    counts = capture(np.random.default_rng(0).random((32, 48, 3)),
                     RawSettings(Detector(bits=14, gain=1.0), 1.0, pattern="RGGB"))  # fmt: skip
    path = tmp_path / "raw.tif"
    write_codes(path, counts, {"ImageDescription": "linear counts"})
    assert np.array_equal(cv2.imread(path, cv2.IMREAD_UNCHANGED), counts)
    image = oiio.ImageBuf(str(path))
    assert image.spec().format == oiio.UINT16
    assert np.array_equal(image.get_pixels(oiio.UINT16)[..., 0], counts)


XYZ_TO_CAMERA = np.array([[0.8, -0.2, -0.1], [-0.4, 1.2, 0.2], [-0.05, 0.2, 0.6]])


@pytest.mark.parametrize("pattern", PATTERNS)
def test_libraw_reads_our_dng(tmp_path, pattern):
    white = XYZ_TO_CAMERA @ [0.9505, 1.0, 1.089]
    detector = Detector(bits=14, gain=1.0, read_noise=2.0, black_level=256.0)
    grey = np.broadcast_to(0.4 * white / white.max(), (64, 96, 3))
    settings = RawSettings(detector, 1.0, pattern=pattern)
    counts = capture(grey, settings)
    path = tmp_path / "raw.dng"
    write_dng(path, counts, settings, XYZ_TO_CAMERA, white, "Nikon D7000 in water")
    with rawpy.imread(str(path)) as raw:
        assert np.array_equal(raw.raw_image_visible, counts)
        names = np.array(list(raw.color_desc.decode()))[raw.raw_colors_visible]
        assert np.array_equal(names, np.array(list("RGB"))[filter_of_pixels(counts.shape, pattern)])
        assert set(raw.black_level_per_channel) == {256}
        assert raw.white_level == 15_000 + 256  # of a full well
        gains = np.array(raw.camera_whitebalance[:3])
        assert gains / gains[1] == pytest.approx(white[1] / white, rel=1e-3)
        rgb = raw.postprocess(use_camera_wb=True, gamma=(1, 1), no_auto_bright=True,
                              output_bps=16).astype(float)  # fmt: skip
    mean = rgb[8:-8, 8:-8].mean(axis=(0, 1))
    assert mean / mean[1] == pytest.approx(np.ones(3), abs=0.01)
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(("iso", "white"), [(None, 3814), (100.0, 3814), (400.0, 4095)])
def test_a_full_well_is_white_in_a_dng(tmp_path, iso, white):
    """LibRaw clips all channels where the first is full, so that highlights are not magenta."""
    detector, path = Detector(read_noise=0.0, shot_noise=False), tmp_path / "raw.dng"
    bright = np.broadcast_to([4.0, 8.0, 4.0], (32, 32, 3))
    settings = RawSettings(detector, 1.0, iso=iso, pattern="RGGB")
    counts = capture(bright, settings)
    write_dng(path, counts, settings, np.eye(3), [0.5, 1.0, 0.5], "a")
    with rawpy.imread(str(path)) as raw:
        assert raw.white_level == counts.max() == white
        rgb = raw.postprocess(use_camera_wb=True, gamma=(1, 1), no_auto_bright=True, output_bps=16,
                              output_color=rawpy.ColorSpace.raw)  # fmt: skip
    assert rgb[8:-8, 8:-8].min() == rgb[8:-8, 8:-8].max() == 2**16 - 1


@pytest.mark.parametrize(("iso", "said"), [(None, 200), (800.0, 800), (1e6, 65535)])
def test_readers_know_the_iso_of_a_dng(tmp_path, iso, said):
    path, counts = tmp_path / "raw.dng", np.full((32, 32), 500, np.uint16)
    settings = RawSettings(Detector(base_iso=200.0), 1.0, iso=iso, pattern="RGGB")
    write_dng(path, counts, settings, np.eye(3), np.ones(3), "a")
    with rawpy.imread(str(path)) as raw:  # LibRaw
        assert raw.other.iso_speed == said
    tags = oiio.ImageInput.open(str(path)).spec()  # by its TIFF reader
    assert tags.getattribute("Exif:ISOSpeedRatings") == (said,)


def test_a_dng_is_a_tiff_with_the_counts_at_its_end(tmp_path):
    counts = np.arange(64, dtype=np.uint16).reshape(8, 8)
    settings = RawSettings(Detector(), 1.0, pattern="RGGB")
    write_dng(tmp_path / "a.dng", counts, settings, np.eye(3), np.ones(3), "a")
    content = (tmp_path / "a.dng").read_bytes()
    assert content[:4] == b"II*\0"
    assert np.array_equal(np.frombuffer(content[-128:], "<u2").reshape(8, 8), counts)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"full_well": 0.0}, "full_well must be positive"),
        ({"read_noise": -1.0}, "read_noise must be 0 or more"),
        ({"bits": 17}, "1 to 16"),
        ({"bits": 4}, "leaves no room"),
        ({"gain": np.nan}, "gain must be positive"),
    ],
)
def test_what_is_no_detector_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        Detector(**changes)


def test_what_cannot_be_taken_says_why(tmp_path):
    picture, behind = np.ones((4, 4, 3)), RawSettings(QUIET, 1.0, pattern="RGGB")
    with pytest.raises(InputError, match="ISO 50 is below"):
        raw_counts([[1.0]], Detector(), 0, iso=50.0)
    with pytest.raises(InputError, match="not negative"):
        raw_counts([[-1.0]], Detector(), 0)
    with pytest.raises(InputError, match="exposure time"):
        raw_counts([[1.0]], Detector(), 0, exposure_time=-1.0)
    with pytest.raises(InputError, match="needs focal lengths"):
        capture(picture, RawSettings(QUIET, 1.0, vignetting=Vignetting()))
    with pytest.raises(InputError, match="unknown mosaic"):
        capture(picture, RawSettings(QUIET, 1.0, pattern="RGBW"))
    with pytest.raises(InputError, match="saturation"):
        RawSettings(QUIET, 0.0)
    with pytest.raises(InputError, match="three channels"):
        capture(picture[..., 0], RawSettings(QUIET, 1.0))
    with pytest.raises(InputError, match="darker than black"):
        Vignetting(radial=(-2.0,)).fraction((8, 8), (9.0, 9.0), (4.0, 4.0))
    with pytest.raises(InputError, match="one 16-bit count"):
        write_dng(tmp_path / "a.dng", np.zeros((2, 2, 3), np.uint16), behind, np.eye(3),
                  np.ones(3), "a")  # fmt: skip
    with pytest.raises(InputError, match="invertible"):
        write_dng(tmp_path / "a.dng", np.zeros((2, 2), np.uint16), behind, np.zeros((3, 3)),
                  np.ones(3), "a")  # fmt: skip
    with pytest.raises(InputError, match="uint8 or uint16"):
        write_codes(tmp_path / "a.tif", np.zeros((2, 2)))
