"""The truth of a picture, written and read."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from underwater_spectral.datasets.axes import looking_at
from underwater_spectral.datasets.truth import image_truth, read_formation, write_truth
from underwater_spectral.datasets.view import DataSetView
from underwater_spectral.tests.datasets.scene_of_boxes import BENT
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    WaterDescription,
    resolve,
)
from underwater_spectral.uw_spectral.lamps import Lamp


@pytest.fixture(scope="module")
def reef():
    return resolve(
        Description(
            WaterDescription("jerlov:IB"),
            light=SunAndSky(zenith=40.0, azimuth=20.0),
            floor=FloorDescription(20.0),
            camera=CameraDescription("Nikon D7000", "depth"),
        )
    )


def _view(target=(3.0, 4.0, -8.0)) -> DataSetView:
    return DataSetView("a", "a.png", BENT, looking_at((0, 0, -5.0), target))


@pytest.mark.slow
def test_the_file_holds_what_the_colours_are_made_of(reef, tmp_path):
    lamp = Lamp((0.1, 0.2, -5.0), (0.0, 1.0, 0.0), np.full(8, 2.0))
    path = tmp_path / "truth.json"
    write_truth(path, image_truth(reef, _view(), [lamp]))
    truth = json.loads(path.read_text())
    bands, column = truth["bands"], reef.column
    assert bands["a"] == pytest.approx(column.absorption)
    assert bands["c"] == pytest.approx(np.add(bands["a"], bands["b"]))
    assert bands["bb"] == pytest.approx(column.scattering * reef.phase.backscatter_ratio)
    assert all(k > a for k, a in zip(bands["Kd"], bands["a"], strict=True))
    assert truth["camera_depth_m"] == 5.0
    assert truth["sun"]["zenith_deg"] == 40.0
    assert truth["sun"]["zenith_in_water_deg"] == pytest.approx(
        math.degrees(math.asin(math.sin(math.radians(40)) / 1.34))
    )
    assert truth["water"]["layers"][0]["name"] == reef.water.name
    assert truth["sensor"]["name"] == "Nikon D7000"
    assert truth["camera"]["K"] == BENT.K.tolist()
    assert tuple(truth["camera"]["distortion"]["coefficients"]) == BENT.distortion
    pose = np.array(truth["camera"]["camera_to_world"])
    np.testing.assert_allclose(pose, _view().camera_to_world, rtol=1e-8)
    assert truth["lamps"][0]["radiant_intensity"] == [2.0] * 8


@pytest.mark.slow
def test_the_gains_make_white_at_depth_grey(reef):
    sensor = image_truth(reef, _view())["sensor"]
    seen = np.array(sensor["response"]) @ reef.viewpoint(5.0).light
    balanced = seen * sensor["white_balance_gains"]
    assert balanced == pytest.approx(np.full(3, balanced[1]))
    rec709 = np.array(sensor["to_linear_rec709"]) @ seen
    assert rec709 == pytest.approx(np.full(3, rec709[0]))


@pytest.mark.slow
def test_both_directions_are_there_and_differ(reef, tmp_path):
    path = tmp_path / "truth.json"
    write_truth(path, image_truth(reef, _view()))
    level, axis = (read_formation(path, name) for name in ("level", "optical_axis"))
    assert level.z[-1] == 30.0
    assert axis.z[-1] < 15.0 * math.sqrt(34) / 3  # where the floor is
    # Light of the floor, scattered forward, comes from beyond: less of what is seen is near.
    assert (axis.beta_backscatter < 0.97 * level.beta_backscatter[: len(axis.z)]).all()
    content = json.loads(path.read_text())["formation"]
    assert content["level"]["direction"] == pytest.approx([0.6, 0.8, 0.0])
    fit = content["level"]["channels"]["fitted"]["beta_D"][0]
    z = level.z
    ours = fit["a"] * np.exp(fit["b"] * z) + fit["c"] * np.exp(fit["d"] * z)
    assert ours == pytest.approx(level.beta_direct[:, 0], rel=5e-3)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("target", [(1.0, 0.0, -5.0), (0.0, 0.0, -8.0)])
def test_cameras_that_look_level_or_straight_down(reef, target):
    formation = image_truth(reef, _view(target))["formation"]
    assert list(formation) == (["level"] if target[0] else ["level", "optical_axis"])
    assert formation["level"]["direction"][2] == 0.0


def test_a_camera_close_above_the_floor_has_level_coefficients():
    optics = resolve(Description(floor=FloorDescription(5.3)))
    assert list(image_truth(optics, _view((0.0, 0.0, -8.0)))["formation"]) == ["level"]


@pytest.mark.slow_but_first
@pytest.mark.parametrize("optimised", [False, True])
def test_the_channels_are_those_of_the_picture(optimised):
    bands = BandsDescription(5, optimised=optimised)
    optics = resolve(Description(camera=CameraDescription("Nikon D7000"), bands=bands))
    sensor = image_truth(optics, _view())["sensor"]
    weights = np.array(sensor["to_linear_rec709"]) @ sensor["response"]
    assert weights == pytest.approx(optics.viewpoint(5.0).reduction.weights)
    own = optics.sensor.response_in(optics.bands)
    assert (np.array(sensor["response"]) == pytest.approx(own, rel=1e-6)) is not optimised


@pytest.mark.slow
def test_water_in_layers_and_inelastic_light(tmp_path):
    rows = ["depth_m,wavelength_nm,a,b"]
    rows += [
        f"{y},{nm},{0.05 * k + (nm > 500)},{0.1 * k}"
        for y, k in ((0, 1), (20, 3))
        for nm in (400, 700)
    ]
    (tmp_path / "profile.csv").write_text("\n".join(rows))
    water = WaterDescription(f"file:{tmp_path / 'profile.csv'}")
    truth = image_truth(resolve(Description(water)), _view((3.0, 0.0, -9.0)))
    assert len(truth["water"]["layers"]) > 1
    axis = np.array(truth["formation"]["optical_axis"]["bands"]["beta_D"])
    assert axis[-1, 0] > 1.5 * axis[0, 0]  # the deeper water is thicker
    raman = image_truth(resolve(Description(WaterDescription(inelastic="raman"))), _view())
    without = image_truth(resolve(Description()), _view())
    more, less = (t["formation"]["level"]["bands"]["B_inf"][-1] for t in (raman, without))
    assert more > 1.05 * less


def test_what_is_no_truth_is_refused(reef, tmp_path):
    path = tmp_path / "truth.json"
    with pytest.raises(InputError, match="cannot read"):
        read_formation(path)
    path.write_text("[1]")
    with pytest.raises(InputError, match="holds no image-formation truth"):
        read_formation(path)
    truth = image_truth(reef, _view((1.0, 0.0, -5.0)))
    write_truth(path, truth)
    with pytest.raises(InputError, match="no direction 'optical_axis', but level"):
        read_formation(path, "optical_axis")
    write_truth(path, {**truth, "format": 2})
    with pytest.raises(InputError, match="format 2"):
        read_formation(path)
    above = DataSetView("b", "b.png", BENT, looking_at((0, 0, 5.0), (1, 0, 0)))
    with pytest.raises(InputError, match="move the camera"):
        image_truth(reef, above)
