"""Angular profiles, and the photometric files they come from."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.lamps.ies import Photometry, parse_ies, read_ies
from underwater_spectral.uw_spectral.lamps.port import BehindFlatPort
from underwater_spectral.uw_spectral.lamps.profile import (
    IsotropicProfile,
    SpotProfile,
    SpreadProfile,
    TableProfile,
    profile_from_csv,
    rov_lamp,
    sample_place,
)

PROFILES = [
    IsotropicProfile(),
    *(SpotProfile(math.radians(s), b) for s in (1, 45, 120, 180) for b in (0, 0.15, 1)),
    *(SpreadProfile(math.radians(s)) for s in (1, 60, 170)),
    rov_lamp(),
    TableProfile.of_angles([0, 30], [1, 1]),
    TableProfile.of_angles([0, 30, 60, 180], [0.5, 1, 0.2, 0.1]),
]


@pytest.mark.parametrize("profile", PROFILES, ids=str)
def test_a_profile_integrates_to_its_solid_angle(profile):
    # Even in the angle: fine enough for a spot of 1°.
    edges = np.union1d(np.linspace(0, math.radians(2), 20001), np.linspace(0, math.pi, 200001))
    theta, width = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    found = 2 * math.pi * (profile.value(np.cos(theta)) * np.sin(theta) * width).sum()
    assert found == pytest.approx(profile.solid_angle, rel=2e-4)
    assert profile.value(np.cos(theta)).min() >= 0
    assert profile.value(np.cos(theta)).max() <= 1 + 1e-12
    if profile.edge is not None:
        outside = np.cos(theta) < profile.edge - 1e-12
        assert not profile.value(np.cos(theta[outside])).any()


def test_the_spot_is_blenders_smoothstep():
    spot = SpotProfile(math.radians(60), 0.4)
    k = math.cos(math.radians(30))
    for theta in (0, 10, 20, 25, 29, 30, 31):
        x = min(max((math.cos(math.radians(theta)) - k) / ((1 - k) * 0.4), 0.0), 1.0)
        wanted = x * x * (3 - 2 * x)
        assert spot.value(math.cos(math.radians(theta))) == pytest.approx(wanted, abs=1e-12)


def test_the_measured_lamp_is_as_published():
    angles = [0, 10, 20, 30, 40, 50, 60, 90]
    wanted = [1, 0.96, 0.87, 0.75, 0.5, 0.2, 0.12, 0]
    assert rov_lamp().value(np.cos(np.radians(angles))) == pytest.approx(wanted, abs=1e-9)
    assert rov_lamp().value(np.cos(np.radians([91, 135, 180]))).max() == 0


def test_few_points_draw_a_long_table():
    angles = np.linspace(0, 90, 181)
    values = np.exp(-((angles / 25) ** 2))
    full, thin = (TableProfile.of_angles(angles, values, points=n) for n in (None, 20))
    assert len(thin.cosines) == 20
    at = np.linspace(0, 1, 500)
    assert np.abs(full.value(at) - thin.value(at)).max() < 0.02
    assert thin.solid_angle == pytest.approx(full.solid_angle, rel=0.02)


@pytest.mark.parametrize(
    ("angles", "values", "words"),
    [
        ([5, 90], [1, 0], "start at 0"),
        ([0, 90, 40], [1, 0, 0], "increase"),
        ([0, 190], [1, 0], "180"),
        ([0, 90], [1, -1], "-1 at 90° is negative"),
        ([0, 90], [math.nan, 1], "nan at 0°"),
        ([0, 90], [0, 0], "no light"),
        ([0], [1], "at least two"),
    ],
)
def test_tables_that_cannot_be_are_refused(angles, values, words):
    with pytest.raises(InputError, match=words):
        TableProfile.of_angles(angles, values)


def test_spots_that_cannot_be_are_refused():
    for size, blend in ((0, 0.1), (4, 0.1), (1, -0.1), (1, 2), (math.nan, 0.1)):
        with pytest.raises(InputError, match="spot: the"):
            SpotProfile(size, blend)


def test_a_profile_of_the_users(tmp_path):
    path = tmp_path / "lamp.csv"
    path.write_text("angle_deg,intensity\n0,200\n60,100\n90,0\n")
    assert profile_from_csv(str(path)).value(0.5) == pytest.approx(0.5)
    path.write_text("angle,intensity\n0,200\n")
    with pytest.raises(InputError, match="angle_deg"):
        profile_from_csv(str(path))


HEAD = "IESNA:LM-63-2002\n[TEST] by hand\n[MANUFAC] nobody\nTILT=NONE\n"
QUADRANT = HEAD + "1 1000 2 3 3 1 2 0.1 0.1 0\n0.5 1 50\n0 45\n90\n0 45 90\n" + (
    "100 50 0\n100 60 0\n100 70 0\n"
)  # fmt: skip


def test_a_file_is_read_and_averaged_over_the_azimuth(tmp_path):
    path = tmp_path / "lamp.ies"
    path.write_text(QUADRANT)
    lamp = read_ies(path)
    assert lamp.candela.shape == (3, 3)
    assert lamp.candela[1] == pytest.approx([100, 60, 0])  # multiplier 2, ballast 0.5
    assert lamp.mean_candela == pytest.approx([100, 60, 0])
    assert lamp.asymmetry == pytest.approx(0.1)
    profile = lamp.profile()
    assert profile.value(np.cos(np.radians([0, 45, 90, 120]))) == pytest.approx([1, 0.6, 0, 0])
    assert lamp.lumens == pytest.approx(100 * profile.solid_angle)


def test_the_flux_of_an_isotropic_file_is_4_pi_times_its_candela():
    lamp = parse_ies(HEAD + "1 -1 1 3 1 1 1 0 0 0 1 1 5\n0 90 180\n0\n10 10 10")
    assert lamp.lumens == pytest.approx(40 * math.pi)


@pytest.mark.parametrize("tilt", ["INCLUDE\n1\n2\n0 90\n1 1", "lamp.tlt", " none"])
def test_the_candela_are_those_of_no_tilt(tilt):
    assert parse_ies(QUADRANT.replace("NONE", tilt)) == parse_ies(QUADRANT)


def test_candela_count_by_both_factors_of_the_ballast():
    """As they do in Cycles (util/ies.cpp); 2019 has another number there."""
    whole = parse_ies(QUADRANT)
    for head in ("IESNA:LM-63-2002", "IESNA:LM-63-1995", "IESNA91", "A lamp of 1986"):
        half = QUADRANT.replace("0.5 1 50", "0.5 0.5 50").replace("IESNA:LM-63-2002", head)
        assert parse_ies(half).candela == pytest.approx(whole.candela / 2)
        assert parse_ies(half).lumens == pytest.approx(whole.lumens / 2)
    new = QUADRANT.replace("IESNA:LM-63-2002", "IES:LM-63-2019")
    assert parse_ies(new.replace("0.5 1 50", "0.5 1.1001 50")).candela == pytest.approx(
        whole.candela
    )
    with pytest.raises(InputError, match="file generation type of LM-63-2019 is 0.5"):
        parse_ies(new.replace("0.5 1 50", "0.5 0.5 50"))


def _lamp(kind: int, vertical, horizontal, candela) -> Photometry:
    """A lamp from its angles and candela, shape (h, v)."""
    rows = [vertical, horizontal, *candela]
    counts = f"1 -1 1 {len(vertical)} {len(horizontal)} {kind} 2 0 0 0\n1 1 50\n"
    return parse_ies(HEAD + counts + "\n".join(" ".join(map(repr, map(float, r))) for r in rows))


@pytest.mark.parametrize(
    "horizontal", [[0], [0, 90], [0, 45, 180], [90, 180, 270], [0, 180, 360], [0, 90, 180, 270]]
)
def test_planes_may_be_any_that_the_format_has(horizontal):
    """A floor lamp, 1 + cos θ / 2 + sin θ sin φ / 4 all round: its flux is 4π."""
    theta = np.linspace(0, 180, 181)
    c, s = np.cos(np.radians(theta)), np.sin(np.radians(theta))
    even = _lamp(1, theta, horizontal, [1 + c / 2 for _ in horizontal])
    assert even.lumens == pytest.approx(4 * math.pi, rel=1e-3)
    assert even.asymmetry < 1e-9
    if len(horizontal) == 4:  # all round, without the plane at 360
        phi = np.radians(horizontal)
        odd = _lamp(1, theta, horizontal, [1 + c / 2 + s * np.sin(x) / 4 for x in phi])
        assert odd.mean_candela == pytest.approx(even.mean_candela, abs=1e-9)


def test_a_lamp_may_shine_back():
    theta = np.linspace(90, 180, 91)
    lamp = _lamp(1, theta, [0], [30 * np.sin(np.radians(theta - 90))])
    assert lamp.lumens == pytest.approx(30 * math.pi, rel=1e-3)
    assert lamp.profile().value(np.cos(np.radians([0, 60, 80]))) == pytest.approx(0)


@pytest.mark.parametrize("first", [0, -90])
def test_types_a_and_b_are_turned_about_the_beam(first):
    angles = np.linspace(first, 90, 91 if first else 46)
    v, h = np.radians(angles), np.radians(angles)[:, None]
    matt = 20 * np.cos(v) * np.cos(h)  # the cosine from the beam, in either
    across = {2: np.sin(h) ** 2 + 0 * v, 3: (np.cos(v) * np.sin(h)) ** 2}  # to the right, squared
    for kind, right in across.items():
        lamp = _lamp(kind, angles, angles, matt)
        assert lamp.lumens == pytest.approx(20 * math.pi, rel=2e-3)
        assert lamp.asymmetry < 2e-3
        lamp = _lamp(kind, angles, angles, right)
        theta = np.radians(lamp.vertical)
        assert lamp.mean_candela == pytest.approx(np.sin(theta) ** 2 / 2, abs=2e-3)
        assert lamp.candela[0] == pytest.approx(np.sin(theta) ** 2, abs=2e-3)
        assert lamp.candela[18] == pytest.approx(0, abs=2e-3)  # up


def test_text_of_windows_is_read(tmp_path):
    path = tmp_path / "lamp.ies"
    path.write_bytes(QUADRANT.replace("nobody", "Schröder, 45° – ½ beam").encode("cp1252"))
    assert read_ies(path).lumens == parse_ies(QUADRANT).lumens
    path.write_bytes(QUADRANT.replace("\n", "\r\n").encode() + b"\x1a")
    assert read_ies(path).lumens == parse_ies(QUADRANT).lumens


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ("", "no line TILT="),
        ("a photograph of a lamp", "no IES LM-63 file"),
        (QUADRANT[:-8], "ends after 7 of 9 numbers of its candela"),
        (HEAD, "ends after 0 of 13 numbers of its header"),
        (QUADRANT.replace("60", "sixty"), "line 11: 'sixty' of its candela"),
        (QUADRANT.replace("3 3 1 2", "3 3 4 2"), "photometric type is 4"),
        (QUADRANT.replace("3 3 1 2", "3 3 2 2").replace("0 45 90\n100", "9 45 90\n100"), "A and B"),
        (QUADRANT + "7 7", "line 13: '7' follows the last candela"),
        (QUADRANT.replace("100 50 0", "100,5 50 0"), "line 12: '0' follows the last candela"),
        (QUADRANT.replace("3 3 1 2", "3.5 3 1 2"), "number of vertical angles"),
        (QUADRANT.replace("3 3 1 2", "3 1e9 1 2"), "number of horizontal angles"),
        (QUADRANT.replace("0 45\n90", "0 90\n45"), "vertical angles do not increase"),
        (QUADRANT.replace("0 45\n90", "30 120\n180"), "vertical angles from 30"),
        (QUADRANT.replace("0 45 90\n100", "0 45 80\n100"), "0 to 90, 180 or 360"),
        (QUADRANT.replace("60", "-60"), "must not be negative"),
        (QUADRANT.replace("1000 2 3", "1000 0 3"), "nor all zero"),
        (QUADRANT.replace("60", "nan"), "not a finite number"),
    ],
)
def test_broken_files_are_refused(broken, words):
    with pytest.raises(InputError, match=words):
        parse_ies(broken)


@pytest.mark.parametrize("blend", [0.1, 1.0])
@pytest.mark.parametrize("size", [1.0, 3.0, 60.0])
def test_the_table_of_a_beam_has_its_light(size, blend):
    """As shaders look it up, of any width; outside it is dark."""
    spot, count = SpotProfile(math.radians(size), blend), 256
    theta = np.linspace(0.0, math.radians(size), 20001)
    place = sample_place(np.cos(theta), count, edge=spot.edge)
    looked_up = np.interp(place, np.arange(count), spot.sampled(count))
    light = 2.0 * math.pi * np.trapezoid(looked_up * np.sin(theta), theta)
    assert light == pytest.approx(spot.solid_angle, rel=5e-3)
    assert not looked_up[theta > math.radians(size) / 2.0 + 1e-9].any()


@pytest.mark.parametrize(
    "air",
    [SpotProfile(math.radians(20), 0.5), SpotProfile(math.radians(120), 1.0), rov_lamp()],
    ids=str,
)
def test_a_port_narrows_and_keeps_the_power(air):
    n, theta = 1.34, np.linspace(0.0, math.pi / 2, 400001)
    water = BehindFlatPort(air, n)
    power = 2.0 * math.pi * np.trapezoid(water.value(np.cos(theta)) * np.sin(theta), theta)
    assert power == pytest.approx(air.solid_angle, rel=1e-3)
    assert water.solid_angle == pytest.approx(air.solid_angle, rel=1e-3)
    at = math.radians(9.0)
    refracted = math.cos(math.asin(math.sin(at) / n))
    gain = n * n * refracted / math.cos(at)
    assert water.value(refracted) == pytest.approx(air.value(math.cos(at)) * gain, rel=1e-9)
    with pytest.raises(InputError, match="above 1"):
        BehindFlatPort(air, 1.0)


def test_a_spread_is_that_of_cycles():
    """The softbox of Cycles' area_light_spread_attenuation, its power kept."""
    with pytest.raises(InputError, match="spread"):
        SpreadProfile(math.pi)
    grid, half = SpreadProfile(math.radians(60)), math.radians(30)
    for theta in (0.0, 0.1, 0.3, 0.5, 0.6):
        passed = max(math.tan(half) - math.tan(theta), 0.0) / (math.tan(half) - half)
        wanted = math.cos(theta) * passed * grid.solid_angle / math.pi
        assert float(grid.value(math.cos(theta))) == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_a_beam_ends_where_a_tenth_is_left():
    assert IsotropicProfile().beam == -1.0
    for profile in (rov_lamp(), SpotProfile(1.0, 0.4)):
        assert float(profile.value(profile.beam)) == pytest.approx(0.1, abs=0.015)
    assert TableProfile.of_angles([0, 60], [2.0, 2.0]).beam == pytest.approx(0.5, abs=1e-3)
