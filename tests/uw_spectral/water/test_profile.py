"""Profiles: what a table over depth means, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.named import parse_uniform_water, parse_water
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.uw_spectral.water.profile import MOST_LAYERS, DepthProfile, read_profile

MEASURED = """# cast 7
depth_m,wavelength_nm,a,b
0,400,0.1,0.4
0,700,0.7,0.2
4,400,0.2,0.5
4,550,0.3,0.4
4,700,0.8,0.3
10,390,0.05,0.1
10,710,0.65,0.1
"""


def _read(tmp_path, text):
    path = tmp_path / "profile.csv"
    path.write_text(text)
    return parse_water(f"file:{path}")


def test_layers_meet_half_way_between_samples(tmp_path):
    profile = _read(tmp_path, MEASURED)
    assert profile.tops == (0.0, 2.0, 7.0)
    assert [water.a([400])[0] for water in profile.layers] == pytest.approx([0.1, 0.2, 0.05 + 0.6 / 32])  # fmt: skip # noqa: E501
    assert [water.b([550])[0] for water in profile.layers] == pytest.approx([0.3, 0.4, 0.1])
    assert profile.layers[1].name == "profile.csv at 4 m"
    assert profile.layers[1].source == "cast 7"
    for depth, layer in ((0.0, 0), (2.0, 0), (2.001, 1), (7.0, 1), (50.0, 2)):
        assert profile.at(depth) is profile.layers[layer]


def test_constituents_over_depth(tmp_path):
    profile = _read(tmp_path, "depth_m,cdom,chlorophyll\n1,0.1,2\n3,0.05,0.5\n")
    assert profile.tops == (0.0, 2.0)
    assert profile.layers == (Constituents(2.0, cdom=0.1), Constituents(0.5, cdom=0.05))


def _measured(*rows):
    return "depth_m,wavelength_nm,a,b\n" + "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (_measured("0,400,0.1,0.2", "0,700,0.1,0.2"), "needs two depths, and there is 1; leave depth_m out"),  # noqa: E501
        (_measured("5,400,0.1,0.2", "0,400,0.1,0.2"), "depth 0 m follows 5 m"),
        (_measured("0,400,1,1", "5,400,1,1", "0,700,1,1", "5,700,1,1"), "depth 0 m follows 5 m"),
        (_measured("-1,400,0.1,0.2", "5,400,0.1,0.2"), "depth -1 m lies above the surface"),
        (_measured("0,400,1,1", "5,400,1,1", "5,400,1,1"), "at 5 m: wavelengths must increase"),
        (_measured("0,400,0.1,0.2", "5,400,-0.1,0.2"), "at 5 m, row 400 nm, column a: -0.1 is negative"),  # noqa: E501
        (_measured("0,400,0.1,0.2", "5,400,0.1,nan"), "line 3, column b: 'nan' is not a finite"),
        (_measured("0,0.4,0.1,0.2", "5,0.4,0.1,0.2"), "at 0 m: wavelengths .* micrometres"),
        ("depth_m,wavelength_nm,a\n0,400,1\n5,400,1\n", "column b is missing"),
        ("depth_m\n0\n5\n", "depth_m alone; add wavelength_nm, a and b, or some of chlorophyll"),
        ("depth_m,chlorophyl\n0,1\n5,2\n", "unknown constituent 'chlorophyl'. Near names: chloro"),
        ("depth_m,chlorophyll\n0,1\n5,-2\n", "at 5 m: constituents: chlorophyll must be"),
        ("depth_m,chlorophyll\n0,1\n5,2\n5,3\n", "depth 5 m follows 5 m; depths must increase"),
        ("depth_m,cdom\n" + "\n".join(f"{y},0.1" for y in range(17)), "17 layers; at most 16"),
    ],
)  # fmt: skip
def test_what_is_no_profile_is_refused(tmp_path, text, message):
    with pytest.raises(InputError, match=rf"profile\.csv.*{message}"):
        _read(tmp_path, text)


def test_the_comment_states_what_holds_at_all_depths(tmp_path):
    path = tmp_path / "profile.csv"
    path.write_text(
        "# station 3\n# cdom-slope: 0.018\n# mineral-bb/b = 0.02\n# salinity: 7 g/kg\n"
        "depth_m,cdom,minerals\n0,0.1,1\n5,0.2,2\n"
    )
    for layer, cdom in zip(read_profile(path).layers, (0.1, 0.2), strict=True):
        assert layer == Constituents(
            cdom=cdom, minerals=10 * cdom, cdom_slope=0.018, salinity=7.0, mineral_backscatter=0.02
        )
    path.write_text("# mineral-slope: steep\ndepth_m,cdom\n0,0.1\n5,0.2\n")
    with pytest.raises(InputError, match="the comment gives mineral-slope as 'steep'"):
        read_profile(path)
    for line in ("cdom-slop: 0.018", "CDOM-slope: 0.018", "cdom_slope = 0.018"):
        path.write_text(f"# {line}\n# cast: 3\ndepth_m,cdom\n0,0.1\n5,0.2\n")
        with pytest.raises(InputError, match="write '# cdom-slope: '"):
            read_profile(path)


def test_each_depth_has_its_own_reach(tmp_path):
    profile = _read(tmp_path, MEASURED)
    assert profile.layers[2].a([395])[0] > 0
    with pytest.raises(InputError, match="a of profile.csv at 4 m is known from 400 to 700 nm"):
        profile.layers[1].a([395])


def test_one_water_is_asked_for(tmp_path):
    _read(tmp_path, MEASURED)
    with pytest.raises(InputError, match="differs with depth"):
        parse_uniform_water(f"file:{tmp_path / 'profile.csv'}")
    assert parse_uniform_water("jerlov:IB") == Water.jerlov("IB")


def test_layers_begin_at_increasing_depths():
    for tops in ((1.0, 2.0), (0.0, 0.0), (0.0,), ()):
        with pytest.raises(InputError, match="increasing from 0"):
            DepthProfile(tops, ("one", "two"))
    with pytest.raises(InputError, match="at most"):
        DepthProfile(tuple(np.arange(MOST_LAYERS + 1.0)), tuple(range(MOST_LAYERS + 1)))
