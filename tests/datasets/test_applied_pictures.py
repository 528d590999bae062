"""Water put before pictures: tables against the pixel, sets on disk, going on, what is refused."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from underwater_spectral.datasets import applied_sets, command_line
from underwater_spectral.datasets.applied_pictures import AppliedSettings, PictureFilter
from underwater_spectral.datasets.camera import PinholeCamera
from underwater_spectral.datasets.cameras_and_rigs import CameraRig, RigLamp
from underwater_spectral.datasets.depth_maps import euclidean_range
from underwater_spectral.datasets.layer_file import read_layers
from underwater_spectral.datasets.picture_codes import read_rgb, srgb_codes
from underwater_spectral.datasets.rgbd_layouts import find_pairs
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.description import (
    Description,
    SurfaceDescription,
    WaterDescription,
)
from underwater_spectral.uw_spectral.spectra.colour_rendering import srgb_encode
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, write_codes

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
H, W = 36, 64
CAMERA = PinholeCamera.from_field_of_view(W, H, 70.0)
RNG = np.random.default_rng(5)
RGB = RNG.random((H, W, 3)).astype(np.float32)
DEPTH = np.exp(RNG.uniform(np.log(0.5), np.log(30.0), (H, W)))
LAMPS = CameraRig(
    "two",
    (
        RigLamp(3000.0, "lm", "led", (-0.4, 0.1, 0.0), (0.1, 0.0, -1.0), 80.0),
        RigLamp(2000.0, "lm", "halogen", (0.3, 0.0, 0.1), (0.0, 0.0, -1.0), 0.0),
    ),
)


def _sea(water: str = "jerlov:II") -> Description:
    return Description(WaterDescription(water), surface=SurfaceDescription("flat"))


@pytest.fixture(scope="module")
def water() -> PictureFilter:
    return PictureFilter(AppliedSettings(_sea(), rig=LAMPS, pitch=-10.0))


def _at_pixels(water: PictureFilter):
    rays = water.tables(CAMERA).rays
    return rays, euclidean_range(DEPTH, CAMERA)


def test_the_picture_is_the_pixel_of_the_channel_tables():
    sunlit = PictureFilter(AppliedSettings(_sea(), pitch=-10.0))
    found = sunlit.picture(RGB, DEPTH, CAMERA)
    w, P = _at_pixels(sunlit)
    _, arriving = sunlit.water.colours(w, P)
    seen = sunlit.water.unlit(w, P).total + np.einsum("hwck,hwk->hwc", arriving, RGB)
    wanted = seen @ sunlit.water.to_rec709.T
    off = np.abs(found - wanted)
    assert off.max() < 0.006
    assert off.mean() < 0.001


def test_lamps_are_those_of_the_channel_tables(water):
    w, P = _at_pixels(water)
    path, *surfaces = water.water.lamp_light(w, P)
    wanted = [path, *(np.einsum("hwck,hwk->hwc", x, RGB) for x in surfaces)]
    J, D, B, F = water.tables(CAMERA)._lamp_light(np.moveaxis(RGB, -1, 0), P.astype(np.float32))
    for found, exact in zip((B, J, D, F), wanted, strict=True):
        off = np.abs(found - exact)
        assert np.quantile(off, 0.99) < 0.01 * np.quantile(exact, 0.9)
        assert np.median(off / exact) < 0.003


def test_components_add_up_and_open_water_is_where_there_is_no_depth(water):
    depth = DEPTH.copy()
    depth[:6], depth[6:9] = 0.0, np.nan
    P = water.distances(depth, CAMERA, "depth")
    parts = water.tables(CAMERA).components(np.moveaxis(RGB, -1, 0), P)
    picture = water.picture(RGB, depth, CAMERA)
    total = (parts.D + parts.B + parts.F) @ water.water.to_rec709.T
    assert picture == pytest.approx(total, abs=1e-5)
    assert (picture[:9] == pytest.approx(
        water.water.open_water(water.tables(CAMERA).rays)[:9] @ water.water.to_rec709.T, rel=1e-3
    ))  # fmt: skip
    assert not parts.D[:9].any()


def test_blur_brightens_beside_what_is_bright():
    blur = PictureFilter(AppliedSettings(_sea("jerlov:3C"), blur=True))
    sharp = PictureFilter(AppliedSettings(_sea("jerlov:3C")))
    rgb = np.zeros((H, W, 3), np.float32)
    rgb[:, : W // 2] = 1.0
    depth = np.full((H, W), 4.0)
    more = (blur.picture(rgb, depth, CAMERA) - sharp.picture(rgb, depth, CAMERA)).sum(axis=-1)
    assert (more[:, W // 2 + 1] - more[:, -2]).min() > 0.006
    falling = more.mean(axis=0)[W // 2 : W // 2 + 8]
    assert np.diff(falling).max() < 0.0
    assert falling[0] - falling[-1] == pytest.approx(0.025, rel=0.1)
    even = blur.picture(np.ones((H, W, 3), np.float32), depth, CAMERA)
    assert np.abs(np.diff(even, axis=1)).max() < 0.005  # no edges of blocks, nor of the picture


def test_depth_may_be_filled_and_is_never_negative():
    settings = AppliedSettings(_sea(), invalid="fill")
    depth = np.full((H, W), 4.0)
    depth[5:9, 7:30], depth[20, 3] = 0.0, np.nan
    found = PictureFilter(settings).distances(depth, CAMERA, "depth")
    assert found == pytest.approx(euclidean_range(np.full((H, W), 4.0), CAMERA), rel=1e-5)
    depth[0, 0] = -1.0
    with pytest.raises(InputError, match="depth has negative values; give m"):
        PictureFilter(settings).distances(depth, CAMERA, "depth")


def test_noise_is_that_of_the_detector():
    clear = PictureFilter(AppliedSettings(_sea()))
    noisy = PictureFilter(AppliedSettings(_sea(), iso=400.0))
    even, depth = np.full((H, W, 3), 0.5, np.float32), np.full((H, W), 2.0)
    wanted = clear.picture(even, depth, CAMERA)
    one, other = (noisy.picture(even, depth, CAMERA, seed=seed) for seed in (1, 2))
    assert one.mean(axis=(0, 1)) == pytest.approx(wanted.mean(axis=(0, 1)), rel=0.01, abs=2e-3)
    assert (one == noisy.picture(even, depth, CAMERA, seed=1)).all()
    assert 0.002 < (one - other).std() / np.sqrt(2) < 0.05


def test_codes_are_srgb():
    linear = RNG.random((3, 5, 7)).astype(np.float32)
    wanted = np.round(255 * srgb_encode(np.moveaxis(linear, 0, -1)))
    off = np.abs(srgb_codes(linear) - wanted)
    assert off.max() <= 1
    assert off.mean() < 0.02


def main(arguments):
    return command_line.main(["apply", *arguments])


def _codes(path, values, kind=np.uint16):
    path.parent.mkdir(parents=True, exist_ok=True)
    write_codes(path, values.astype(kind))
    return path


def _rgb(path, size=(H, W)):
    return _codes(path, RNG.integers(0, 256, (*size, 3)), np.uint8)


K3 = "500 0 31.5\n0 501 17.5\n0 0 1\n"
K4 = "500 0 31.5 0\n0 501 17.5 0\n0 0 1 0\n0 0 0 1\n"


def _plain(root):
    for name in ("2", "10"):
        _rgb(root / "rgb" / f"{name}.png")
        _codes(root / "depth" / f"{name}.png", np.full((H, W), 3000))
    return [root / "rgb", root / "depth", "--fov", "60"], ["2", "10"]


def test_a_brighter_floor_brightens_the_water(tmp_path):
    """It sends light up: the colour of a black object far away is that of the water."""
    rgb = _codes(tmp_path / "a.png", np.zeros((H, W, 3)), np.uint8)
    depth = _codes(tmp_path / "d.png", np.full((H, W), 50_000))
    options = ["--fov", "60", "--floor-depth", "7", "--exposure", "2", "--file", "exr"]
    seen = []
    for floor in ("0.05", "0.8"):
        out = tmp_path / floor
        assert not main([str(rgb), str(depth), "--out", str(out), *options,
                         "--floor-reflectance", floor])  # fmt: skip
        seen.append(read_exr(out / "images" / "a.exr")[0])
    assert (seen[1][..., 2] > 1.3 * seen[0][..., 2]).all()


def _tum(root):
    root.mkdir()
    rows = {"rgb": [(1.0, "rgb/1.0.png"), (2.0, "rgb/2.0.png"), (9.0, "rgb/9.0.png")]}
    rows["depth"] = [(1.015, "depth/a.png"), (1.99, "depth/b.png")]
    for kind, listed in rows.items():
        (root / f"{kind}.txt").write_text("# x\n" + "".join(f"{t} {f}\n" for t, f in listed))
        for _, file in listed:
            if kind == "rgb":
                _rgb(root / file, (480, 640))
            else:
                _codes(root / file, np.full((480, 640), 15000))
    return [root, "--layout", "tum"], ["1.0", "2.0"]


def _kitti(root):
    for number in ("0000000005", "0000000006"):
        _rgb(root / "image_02" / "data" / f"{number}.png")
    depth = np.zeros((H, W))
    depth[H // 2 :] = 768
    _codes(root / "proj_depth" / "groundtruth" / "image_02" / "0000000005.png", depth)
    (root / "calib_cam_to_cam.txt").write_text(
        f"S_rect_02: {W} {H}\nP_rect_02: 500 0 31.5 0 0 501 17.5 0 0 0 1 0\n"
    )
    return [root, "--layout", "kitti"], ["image_02_0000000005"]


def _kitti_selection(root):
    name = "d_sync_image_0000000005_image_02"
    _rgb(root / "image" / f"{name}.png")
    depth = name.replace("_sync_image_", "_sync_groundtruth_depth_")
    _codes(root / "groundtruth_depth" / f"{depth}.png", np.full((H, W), 768))
    (root / "intrinsics").mkdir()
    (root / "intrinsics" / f"{name}.txt").write_text(K3)
    return [root, "--layout", "kitti"], [name]


def _scannet(root):
    _rgb(root / "color" / "0.png")
    _codes(root / "depth" / "0.png", np.full((H // 2, W // 2), 3000))
    (root / "intrinsic").mkdir()
    (root / "intrinsic" / "intrinsic_color.txt").write_text(K4)
    return [root, "--layout", "scannet"], ["0"]


@pytest.mark.parametrize("made", [_plain, _tum, _kitti, _kitti_selection, _scannet])
def test_each_layout_is_read(made, tmp_path, capsys):
    arguments, names = made(tmp_path / "set")
    out = tmp_path / "out"
    said = main([*map(str, arguments), "--out", str(out), "--truth", "--bands", "3"])
    assert said == 0, capsys.readouterr().err
    assert [x.stem for x in sorted((out / "images").iterdir())] == sorted(names)
    assert capsys.readouterr().out.split()[: len(names)] == names
    layers = read_layers(out / "layers" / f"{names[0]}.exr")
    depth = layers["planar_depth"]
    assert depth[-1] == pytest.approx(3.0, rel=1e-3)  # as all layouts have it in their codes
    truth = json.loads((out / "truth" / f"{names[0]}.json").read_text())
    focal = {_plain: W / 2 / np.tan(np.radians(30.0)), _tum: 525.0}.get(made, 500.0)
    assert truth["camera"]["K"][0][0] == pytest.approx(focal)
    D, J, T = layers["D"], layers["J"], layers["T"]
    assert D[-1] == pytest.approx(J[-1] * T[-1], rel=5e-3, abs=1e-6)


def _apply(root, *more):
    arguments, _ = _plain(root / "set") if not (root / "set").exists() else (
        [root / "set" / "rgb", root / "set" / "depth", "--fov", "60"], ())  # fmt: skip
    return main([*map(str, arguments), "--out", str(root / "out"), "--bands", "3", *more])


def test_a_set_goes_on_where_it_was_stopped(tmp_path, monkeypatch, capsys):
    write = applied_sets.write_picture

    def stopped(path, linear):
        if path.stem == "10":
            raise KeyboardInterrupt
        write(path, linear)

    monkeypatch.setattr(applied_sets, "write_picture", stopped)
    with pytest.raises(KeyboardInterrupt):
        _apply(tmp_path)
    images = tmp_path / "out" / "images"
    assert [x.name for x in images.iterdir()] == ["2.png"]
    first = (images / "2.png").stat().st_mtime_ns
    (images / "10.tmp.png").write_bytes(b"half")
    monkeypatch.undo()
    capsys.readouterr()
    assert _apply(tmp_path) == 0
    assert "10\n" in capsys.readouterr().out
    assert (images / "2.png").stat().st_mtime_ns == first
    assert read_rgb(images / "10.png").shape == (H, W, 3)
    assert _apply(tmp_path) == 0
    assert "0 of them new" in capsys.readouterr().out


def test_a_folder_has_pictures_of_one_kind(tmp_path, capsys):
    assert _apply(tmp_path) == 0
    assert _apply(tmp_path, "--water", "jerlov:3C") == 2
    assert "other settings (description)" in capsys.readouterr().err


def test_what_is_refused_leaves_the_folder_to_others(tmp_path, capsys):
    root = tmp_path / "set"
    _plain(root)
    arguments = [str(root / "rgb"), str(root / "depth"), "--out", str(tmp_path / "out")]
    assert main([*arguments, "--water", "jerlov:II"]) == 2
    error = capsys.readouterr().err
    assert "2.png" in error
    assert "--fov DEGREES" in error
    assert main([*arguments, "--fov", "60", "--bands", "3"]) == 0


@pytest.mark.parametrize(
    ("depth", "more", "message"),
    [
        (None, (), r"1 of 2 pictures have no depth, such as .*2\.png.* no file '2'; add it"),
        (np.full((H, W + 2), 3000), (), r"depth/2\.png has \(66, 36\) pixels, .* \(64, 36\); give"),
        (np.zeros((H, W)), (), r"2\.png has no pixel with depth; .* leave the picture out"),
        (np.full((H, W), 5), (), r"2\.png has a median of 0\.005 m, .*--scale, 1000 of mm"),
        (np.full((H, W), 3000), ("--water", "jerlov:4"), r"jerlov:4|type '4'"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_named(depth, more, message, tmp_path, capsys):
    _plain(tmp_path / "set")
    capsys.readouterr()
    path = tmp_path / "set" / "depth" / "2.png"
    if depth is None:
        path.unlink()
    else:
        _codes(path, depth)
    assert _apply(tmp_path, *more) == 2
    assert not (tmp_path / "out").exists()
    assert re.search(message, capsys.readouterr().err)


def test_depth_of_arrays_has_a_unit_too(tmp_path, capsys):
    root = tmp_path / "set"
    _rgb(root / "rgb" / "a.png")
    (root / "depth").mkdir()
    np.save(root / "depth" / "a.npy", np.full((H, W), 9000.0))
    arguments = [str(root / x) for x in ("rgb", "depth")]
    arguments += ["--out", str(tmp_path / "out"), "--fov", "60", "--bands", "3"]
    assert main(arguments) == 2
    assert "median of 9e+03 m" in capsys.readouterr().err
    assert main([*arguments, "--scale", "1000"]) == 0


def test_intrinsics_are_four_numbers(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main([str(tmp_path), str(tmp_path), "--out", "x", "--intrinsics", "1,2,b,3"])
    assert "'1,2,b,3': give four numbers in pixels" in capsys.readouterr().err


def test_a_picture_that_is_not_finite_is_refused():
    rgb = RGB.copy()
    rgb[3, 4, 1] = np.nan
    with pytest.raises(InputError, match="1 pixels are negative or not finite, .*row 3, column 4"):
        PictureFilter(AppliedSettings(_sea())).picture(rgb, DEPTH, CAMERA)


def test_a_folder_without_pictures_is_refused(tmp_path):
    with pytest.raises(InputError, match="no picture with depth; plain is a picture and its depth"):
        find_pairs("plain", tmp_path, tmp_path)
