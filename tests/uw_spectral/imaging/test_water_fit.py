"""Water from pictures: amounts and intervals of a chart that was made up, what is refused."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.datasets import command_line, fit_command
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import water_fit
from underwater_spectral.uw_spectral.imaging.description import (
    BandsDescription,
    CameraDescription,
    Description,
    WaterDescription,
)
from underwater_spectral.uw_spectral.imaging.optics import resolve
from underwater_spectral.uw_spectral.imaging.water_fit import (
    FITTED,
    FittedWater,
    SeenSurfaces,
    fit_water,
)
from underwater_spectral.uw_spectral.spectra.reflectance import (
    colorchecker_patches,
    colorchecker_reflectance,
)
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.named import parse_water

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
SEA = Description(camera=CameraDescription("ARRI D21"))
TRUTH = Constituents(chlorophyll=1.5, cdom=0.08, minerals=0.4)
DISTANCES = (1.0, 2.0, 4.0)
PATCHES = colorchecker_patches()
FILE = "reflectance,distance_m,r,g,b,sd_r,sd_g,sd_b"


def _chart(truth=TRUTH, depth=5.0, distances=DISTANCES, seed=1, description=SEA):
    """What a chart, tilted, and open water look like on 241 bands, with noise of 1 %."""
    fine = replace(description, water=WaterDescription(truth), bands=BandsDescription(241))
    view = resolve(fine).viewpoint(depth)
    surfaces = [(colorchecker_reflectance(p), P) for p in PATCHES for P in distances]
    light = [
        view.seen_level(0.8 * rho.at(view.column.bands.centres) * view.light / np.pi, P)
        for rho, P in surfaces
    ]
    values = np.array([*light, view.background]) @ view.reduction.response.T
    values /= values.max()
    deviations = np.hypot(0.01 * values, 0.002)
    noise = deviations * np.random.default_rng(seed).standard_normal(values.shape)
    reflectances = [*(rho for rho, _ in surfaces), 0.0]
    away = np.array([*(P for _, P in surfaces), np.inf])
    return SeenSurfaces(reflectances, away, values + noise, deviations)


def _inside(fitted: FittedWater, truth: Constituents) -> list[bool]:
    return [
        getattr(fitted.low, name) <= getattr(truth, name) <= getattr(fitted.high, name)
        for name in FITTED
    ]


@pytest.fixture(scope="module")
def chart() -> SeenSurfaces:
    return _chart()


@pytest.fixture(scope="module")
def fitted(chart) -> FittedWater:
    return fit_water(chart, SEA, 5.0)


def test_amounts_of_a_chart_are_found_within_narrow_intervals(fitted):
    assert all(_inside(fitted, TRUTH))
    assert 0.8 < fitted.misfit < 1.2
    for name, narrow in (("chlorophyll", 0.2), ("cdom", 0.2), ("minerals", 0.2)):
        width = getattr(fitted.high, name) - getattr(fitted.low, name)
        assert 0 < width < 2 * narrow * getattr(TRUTH, name), name


@pytest.mark.slow
def test_a_channel_that_is_a_tenth_off_is_seen(chart):
    off = replace(chart, values=chart.values * [1.0, 1.1, 1.0])
    assert fit_water(off, SEA, 5.0).misfit > 2


@pytest.mark.slow
def test_what_is_not_there_is_found_to_be_none():
    truth = Constituents(chlorophyll=0.3, cdom=0.02)
    fitted = fit_water(_chart(truth), SEA, 5.0)
    assert fitted.low.minerals == 0
    assert fitted.high.minerals < 0.05
    assert all(_inside(fitted, truth))


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    rng, inside = np.random.default_rng(3), []
    ranges = ((0.05, 10.0), (0.01, 0.5), (0.02, 5.0))
    for seed in range(40):
        truth = Constituents(*(float(np.exp(rng.uniform(*np.log(each)))) for each in ranges))
        depth, near = rng.uniform(2.0, 12.0), rng.uniform(0.5, 1.5)
        seen = _chart(truth, depth, near * np.array([1.0, 2.0, 4.0]), seed)
        inside.append(_inside(fit_water(seen, SEA, depth), truth))
    assert np.mean(inside) >= 0.9


def test_greys_too_near_do_not_tell_the_water(monkeypatch):
    monkeypatch.setattr(water_fit, "_BANDS", BandsDescription(31))  # enough to refuse
    chart = _chart(distances=(0.05,))
    grey = slice(18, 24)
    assert PATCHES[grey][0] == "white 9.5 (.05 D)"
    near = SeenSurfaces(
        chart.reflectances[grey],
        chart.distances[grey],
        chart.values[grey],
        np.asarray(chart.deviations)[grey],
    )
    with pytest.raises(InputError, match=r"attenuation at 550 nm is .* within a factor of \d+"):
        fit_water(near, SEA, 5.0)


def test_too_few_values_are_refused(chart):
    few = SeenSurfaces([0.5], np.array([2.0]), chart.values[:1])
    with pytest.raises(InputError, match="3 values cannot tell 3 constituents"):
        fit_water(few, SEA, 5.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"values": np.full((2, 3), np.nan)}, "row 1 has a value"),
        ({"distances": np.array([1.0, -1.0])}, "row 2 has a value or distance"),
        ({"values": np.ones((2, 4))}, r"shapes \(2,\) and \(2, 4\)"),
        ({"distances": np.ones(3)}, r"shapes \(3,\) and \(2, 3\)"),
        ({"values": np.zeros((2, 3))}, "the picture is black"),
        ({"deviations": np.zeros((2, 3))}, "standard deviation above 0"),
    ],
)
def test_what_cannot_be_is_refused(changes, message):
    right = {"reflectances": [0.0, 0.5], "distances": np.ones(2), "values": np.ones((2, 3))}
    with pytest.raises(InputError, match=message):
        SeenSurfaces(**{**right, **changes})


def _written(folder, chart: SeenSurfaces):
    names = [*(p for p in PATCHES for _ in DISTANCES), "water"]
    numbers = np.concatenate([chart.values, chart.deviations], axis=1)
    rows = [
        f"{name},{'' if name == 'water' else P},{','.join(map(repr, row.tolist()))}"
        for name, P, row in zip(names, chart.distances, numbers, strict=True)
    ]
    table = folder / "chart.csv"
    table.write_text("\n".join([FILE, *rows]))
    return table


def test_command_reads_a_chart_and_writes_its_water(tmp_path, monkeypatch, capsys, chart, fitted):
    given = []
    monkeypatch.setattr(
        fit_command, "fit_water", lambda *a, **options: given.append((a, options)) or fitted
    )
    table, out = _written(tmp_path, chart), tmp_path / "water.csv"
    options = ["--camera", "ARRI D21", "--depth", "5", "--out", str(out)]
    assert command_line.main(["fit", str(table), *options]) == 0
    [((seen, description, depth), how)] = given
    assert (description.camera.sensor, depth, how) == ("ARRI D21", 5.0, {"facing_up": False})
    np.testing.assert_array_equal(seen.distances, chart.distances)
    np.testing.assert_array_equal(seen.values, chart.values)
    np.testing.assert_array_equal(seen.deviations, chart.deviations)
    assert seen.reflectances == chart.reflectances
    lines = capsys.readouterr().out.splitlines()
    nm = np.array([410.0, 550.0, 690.0])
    wanted = fitted.constituents.water()
    for text in (lines[0], f"file:{out}"):
        water = parse_water(text)
        np.testing.assert_allclose(water.a(nm), wanted.a(nm), rtol=1e-4)
        np.testing.assert_allclose(water.b(nm), wanted.b(nm), rtol=1e-4)
        assert water.particle_backscatter == pytest.approx(wanted.particle_backscatter, rel=1e-4)
    assert lines[1] == (
        f"chlorophyll: {fitted.constituents.chlorophyll:.3g} mg/m³, 95 % from "
        f"{fitted.low.chlorophyll:.3g} to {fitted.high.chlorophyll:.3g}"
    )
    assert not any(line.startswith("more than noise") for line in lines)
    monkeypatch.setattr(fit_command, "fit_water", lambda *_, **__: replace(fitted, misfit=2.5))
    assert command_line.main(["fit", str(table), *options]) == 0
    assert "more than noise: check camera, depth" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("distance_m,r,g,b\n1,1,1,1\n", "column reflectance is missing"),
        ("reflectance,distance_m,r,g,b,sd_r\n0.5,1,1,1,1,1\n", "column sd_g, sd_b is missing"),
        ("reflectance,distance_m,r,g,b\nwater,,1,1,1\n0.5,1,1,x,1\n", "line 3, column g: 'x'"),
        ("reflectance,distance_m,r,g,b\n0.5,near,1,1,1\n", "line 2: distance_m 'near'"),
        ("reflectance,distance_m,r,g,b\npinkish,1,1,1,1\n", "line 2: unknown ColorChecker patch"),
        ("reflectance,distance_m,r,g,b\n1.5,1,1,1,1\n", "line 2: reflectance 1.5 is not between"),
        ("reflectance,distance_m,r,g,b\nfile:no.csv,1,1,1,1\n", r"line 2: cannot read .*no\.csv"),
        ("reflectance,distance_m,r,g,b\n,1,1,1,1\n", "line 2: "),
    ],
)
def test_command_says_what_is_wrong_with_a_table(tmp_path, capsys, table, message):
    path = tmp_path / "chart.csv"
    path.write_text(table)
    assert command_line.main(["fit", str(path), "--camera", "cie1931", "--depth", "5"]) == 2
    assert re.search(message, capsys.readouterr().err)
