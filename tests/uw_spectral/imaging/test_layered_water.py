"""Water in layers: from a description to a column, its light and what is read off it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
    resolve,
)
from underwater_spectral.uw_spectral.imaging.summary import readouts
from underwater_spectral.uw_spectral.imaging.visibility import (
    diffuse_attenuation,
    euphotic_depth,
    horizontal_visibility,
    transmitted_light,
)
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.uw_spectral.water.profile import DepthProfile
from underwater_spectral.validation.closed_form.light_field import light_field_of
from underwater_spectral.validation.monte_carlo import simulate

CLEAR, TURBID = Water.uniform(0.1, 0.1, "clear"), Water.uniform(0.3, 0.6, "turbid")
LAYERS = DepthProfile((0.0, 4.0), (CLEAR, TURBID))


def _resolved(water, **changes):
    if not isinstance(water, WaterDescription):
        water = WaterDescription(water, phase="hg:0.8")
    return resolve(replace(Description(water, bands=BandsDescription(4)), **changes))


def _cut(water, *tops):
    return DepthProfile((0.0, *tops), (water,) * (len(tops) + 1))


def test_each_layer_has_its_own_numbers():
    found = _resolved(LAYERS)
    (deeper,) = found.column.below
    assert deeper.top == 4.0
    np.testing.assert_allclose(found.column.absorption, 0.1)
    np.testing.assert_allclose(deeper.absorption, 0.3)
    np.testing.assert_allclose(deeper.scattering, 0.6)
    assert found.water.name == "clear"
    mixed = _resolved(
        WaterDescription(
            LAYERS, second=Water.uniform(0.5, 0.0), second_fraction=0.5, scattering_factor=2.0
        )
    )
    np.testing.assert_allclose(mixed.column.below[0].absorption, 0.4)
    np.testing.assert_allclose(mixed.column.below[0].scattering, 0.6)


def test_a_profile_is_not_mixed_in(tmp_path):
    path = tmp_path / "profile.csv"
    path.write_text("depth_m,cdom\n0,0.1\n5,0.2\n")
    with pytest.raises(InputError, match=r"profile.csv' differs with depth"):
        _resolved(WaterDescription(CLEAR, second=f"file:{path}", second_fraction=0.5))


def test_each_layer_has_its_own_phase_function():
    """By its own fraction of molecules; of constituents, as if they were all of the water."""
    found = _resolved(WaterDescription(LAYERS))
    deeper = found.column.below[0].phase
    assert np.all(deeper.weights[0] < 0.5 * found.phase.weights[0])
    much, little = Constituents(5.0), Constituents(0.2, minerals=1.0)
    found = _resolved(WaterDescription(DepthProfile((0.0, 4.0), (much, little))))
    assert found.phase == much.phase(found.bands.centres)
    assert found.column.below[0].phase == little.phase(found.bands.centres)


def test_columns_compare_by_their_layers():
    one, other = _resolved(LAYERS).column, _resolved(LAYERS).column
    assert one == other
    assert hash(one) == hash(other)
    assert one != _resolved(DepthProfile((0.0, 5.0), LAYERS.layers)).column
    assert one != _resolved(CLEAR).column


def test_a_column_refuses_layers_that_cannot_be():
    column, phase = _resolved(CLEAR).column, parse_phase("hg:0.8").for_bands(np.ones(4))
    for top in (0.0, -1.0, math.inf):
        with pytest.raises(InputError, match="depths must increase"):
            replace(column, below=(DeeperWater(top, 0.1, 0.1, phase),))
    with pytest.raises(InputError, match="scattering from 3 m is -0.1"):
        replace(column, below=(DeeperWater(3.0, 0.1, -0.1, phase),))


def test_one_water_cut_into_layers_is_one_water():
    light = {"floor": FloorDescription(9.0, "0.3"), "surface": SurfaceDescription("flat"),
             "light": SunAndSky(sky_radiance=0.1, zenith=50.0)}  # fmt: skip
    whole, cut = _resolved(TURBID, **light), _resolved(_cut(TURBID, 1.0, 3.0, 20.0), **light)
    fields = [found.column.solved_field(found.phase) for found in (whole, cut)]
    y = np.array([0.0, 0.9, 1.0, 2.0, 3.0, 6.0, 9.0])
    np.testing.assert_allclose(fields[1].Ed(y), fields[0].Ed(y), rtol=1e-9)
    w = (0.6, 0.0, 0.8), (0.0, 1.0, 0.0), (0.0, 0.6, -0.8)
    for direction in w:
        seen = [field.radiance(y, direction) for field in fields]
        np.testing.assert_allclose(seen[1], seen[0], rtol=1e-8)
    np.testing.assert_allclose(cut.column.decay, whole.column.decay)


def test_a_floor_ends_the_layers_and_comes_off_again():
    found = _resolved(_cut(CLEAR, 4.0, 8.0), floor=FloorDescription(6.0))
    assert [layer.bottom for layer in found.column.layers(found.phase)] == [4.0, 6.0]
    deep = replace(found.column, floor_depth=math.inf)
    assert [layer.bottom for layer in deep.layers(found.phase)] == [4.0, 8.0, math.inf]


def test_read_outs_of_one_water_in_layers_are_those_of_the_water():
    many = BandsDescription(12)
    views = [_resolved(water, bands=many).viewpoint(5.0) for water in (TURBID, _cut(TURBID, 2.0))]
    whole, cut = (readouts(view, view) for view in views)
    assert cut.visibility == pytest.approx(whole.visibility)
    assert cut.euphotic_depth == pytest.approx(whole.euphotic_depth, rel=1e-6)
    np.testing.assert_allclose(
        cut.transmitted_light.values, whole.transmitted_light.values, rtol=1e-6
    )
    np.testing.assert_allclose(cut.swatch, whole.swatch, rtol=1e-6)
    np.testing.assert_allclose(*(diffuse_attenuation(view) for view in views), rtol=1e-6)


def test_read_outs_are_those_of_the_camera_s_layer():
    found = _resolved(LAYERS)
    above, below = found.viewpoint(4.0), found.viewpoint(4.001)
    assert horizontal_visibility(above) == pytest.approx(-math.log(0.02) / 0.2)
    assert horizontal_visibility(below) == pytest.approx(-math.log(0.02) / 0.9)
    field = found.column.solved_field(found.phase)
    np.testing.assert_allclose(above.light, field.Ed(4.0), rtol=2e-3)
    np.testing.assert_allclose(above.background, field.radiance(4.0, above.level), rtol=0.02)
    np.testing.assert_allclose(transmitted_light(above), field.Ed(4.0) / field.Ed(0.0), rtol=2e-3)
    # A white wall far away is water, one close by is not.
    wall = np.ones(4)
    np.testing.assert_allclose(above.seen_level(wall, 1e3), above.background)
    np.testing.assert_allclose(above.seen_level(wall, 0.0), wall)
    depths = np.linspace(5.0, 5.5, 51)
    slopes = [diffuse_attenuation(found.viewpoint(depth)) for depth in depths]
    taken = np.exp(-np.trapezoid(slopes, depths, axis=0))
    np.testing.assert_allclose(taken, field.Ed(5.5) / field.Ed(5.0), rtol=1e-3)


def test_light_ends_where_two_absorbing_layers_say():
    """Without scattering it is Beer's law, layer by layer."""
    water = DepthProfile((0.0, 10.0), (Water.uniform(0.1, 0.0), Water.uniform(0.5, 0.0)))
    found = _resolved(water, floor=FloorDescription(11.0))
    wanted = 10.0 + (-math.log(0.01) * found.column.sun_cosine - 1.0) / 0.5
    assert euphotic_depth(found.column, found.phase) == pytest.approx(wanted, rel=1e-4)


def test_who_knows_one_layer_says_so():
    found = _resolved(LAYERS)
    message = "water of one layer only, and this has 2; leave them, or take"
    with pytest.raises(InputError, match=f"the closed form knows {message}"):
        light_field_of(found.column, found.phase)
    with pytest.raises(InputError, match=f"optimised bands know {message}"):
        _resolved(LAYERS, bands=BandsDescription(4, wavelengths=(450.0, 550.0), optimised=True))
    with pytest.raises(InputError, match=f"inelastic light knows {message}"):
        _resolved(WaterDescription(LAYERS, inelastic="all"))
    with pytest.raises(InputError, match=f"Monte Carlo knows {message}"):
        simulate(found.column, found.phase, [1.0], photons=10)


def test_a_picture_is_exposed_for_the_layered_light():
    found = _resolved(LAYERS, camera=CameraDescription("ARRI D21"))
    view = found.viewpoint(8.0)
    white = view.reduction.apply(view.light / math.pi)
    assert white @ [0.2126, 0.7152, 0.0722] == pytest.approx(0.9, rel=1e-3)
