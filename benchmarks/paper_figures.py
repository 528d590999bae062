"""Figures and tables of the papers in our numbers: docs/measured/paper_figures.md, two pictures.

``python3 dev.py run -m benchmarks paper_figures`` takes about a CPU minute; numpy alone.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.sensor import Sensor, list_sensors, parse_sensor, standard_observer
from ..uw_spectral.water.bio_optics import Constituents, named_waters
from ..validation.colour_errors import srgb_rmse
from . import _paper_scenes as scenes
from . import _printed_water as printed
from . import gutierrez_figures
from ._outside import grid
from ._outside_water import TABLE2
from ._paper_scenes import FINE, SCENES, PaperScene, Setting, setting
from .path_radiance_table import ROOT

Array = NDArray[np.float64]

EIGHT = Bands.uniform(8)
"""The paper's choice."""
COUNTS = (3, 4, 5, 6, 8, 12, 16, 32, 64, 128, 250)
PRINTED_COUNTS = (3, 6, 8, 12, 32, 250)
MANY = Bands.uniform(400)
"""What the number of bands is compared with."""
USSIM = {"3C 3 m": 0.138, "3C 9 m": 0.057, "I 5 m": 0.333, "IA 9 m": 0.249, "IB 5 m": 0.239,
         "II 3 m": 0.212}  # fmt: skip
"""sRGB RMSE of Chen et al. (2022) in Table 2 of Monzon et al. (2024)."""
SPECTRAL, RGB_MEANS, RGB_WAVES = "ours, 8 bands", "ours, RGB: means", "ours, RGB: wavelengths"
PAPER, PAPER_RGB = "Eqs 9, 10 printed, 8 bands", "Eqs 9, 10 printed, RGB: wavelengths"
AS_DESCRIBED = "Chen et al. as described: XYZ, one light"
METHODS = (SPECTRAL, "closed form, 8 bands", RGB_MEANS, RGB_WAVES, PAPER, PAPER_RGB)
LOOKS = (
    ("8", ("I", "IA", "IB", "II"), (4.0, 10.0, 20.0)),
    ("10", ("1C", "3C", "5C"), (4.0, 7.0, 10.0)),
)
"""Figures of waters: number, types, depths of the floor of which the first is printed."""
_RAYS = 2000
_TRIALS = 5


@dataclass(frozen=True)
class Error:
    """Of a picture's colours: sRGB RMSE and mean ΔE2000."""

    rmse: float
    delta_e: float

    @classmethod
    def of(cls, rgb: Array, reference: Array) -> Error:
        """Compare linear RGB."""
        return cls(srgb_rmse(rgb, reference), float(delta_e_CIE2000_images(rgb, reference).mean()))


Errors = dict[tuple[str, str], dict[str, Error]]
"""By scene and camera, of each method."""


def cameras() -> list[Sensor]:
    """All cameras that need no file."""
    return [parse_sensor(name) for name in list_sensors("camera")]


def figure14(
    sensors: Sequence[Sensor], places: Sequence[PaperScene] = SCENES, *, balanced: bool = False
) -> Errors:
    """Errors of :data:`METHODS` against the solved light in many bands.

    Parameters
    ----------
    sensors : sequence of Sensor
    places : sequence of PaperScene
    balanced : bool
        Whether pictures are developed, or show the responses as RGB, as Equation 12 reads.
    """
    found: Errors = {}
    for scene in places:
        fine, eight = setting(scene), setting(scene, EIGHT)
        truth = scenes.tables(fine)
        in_bands = {
            SPECTRAL: scenes.tables(eight),
            METHODS[1]: scenes.closed_form(eight),
            PAPER: scenes.paper_printed(eight),
        }
        in_channels = channels(fine, sensors)
        for k, sensor in enumerate(sensors):
            exposed = scenes.development(fine, sensor, balanced=balanced)
            pictures = {name: exposed.of_bands(L, EIGHT) for name, L in in_bands.items()}
            for name, responses in in_channels.items():
                pictures[name] = exposed.of_channels(responses[:, 3 * k : 3 * k + 3])
            reference = exposed.of_bands(truth)
            found[scene.title, sensor.name] = {
                name: Error.of(pictures[name], reference) for name in METHODS
            }
    return found


def channels(fine: Setting, sensors: Sequence[Sensor]) -> dict[str, Array]:
    """Responses of the RGB methods, three columns for each sensor."""
    weights = np.vstack([sensor.response_in(FINE) for sensor in sensors])
    means, waves = fine.mixed(weights), fine.representative(weights)
    return {
        RGB_MEANS: scenes.tables(means),
        RGB_WAVES: scenes.tables(waves),
        PAPER_RGB: scenes.paper_printed(waves),
    }


def figure12(
    sensors: Sequence[Sensor],
    counts: Sequence[int] = COUNTS,
    places: Sequence[PaperScene] = SCENES,
    reference: Bands = MANY,
) -> dict[int, list[Error]]:
    """Mean error over scenes and sensors by number of equal bands.

    Parameters
    ----------
    sensors : sequence of Sensor
    counts : sequence of int
        Numbers of bands.
    places : sequence of PaperScene
    reference : Bands
        What they are compared with.

    Returns
    -------
    dict
        For each number the tables against tables in many bands, the closed form against its own
        in many bands, and the closed form against the tables.
    """
    found: dict[int, list[list[Error]]] = {n: [] for n in counts}
    for scene in places:
        fine, many = setting(scene), setting(scene, reference)
        truth, closed = scenes.tables(many), scenes.closed_form(many)
        few = {n: setting(scene, Bands.uniform(n)) for n in counts}
        spectra = {n: (scenes.tables(at), scenes.closed_form(at)) for n, at in few.items()}
        for sensor in sensors:
            exposed = scenes.development(fine, sensor, balanced=True)
            references = [exposed.of_bands(L, reference) for L in (truth, closed, truth)]
            for n, (tables, form) in spectra.items():
                rgb = [exposed.of_bands(L, few[n].column.bands) for L in (tables, form, form)]
                found[n].append([Error.of(*pair) for pair in zip(rgb, references, strict=True)])
    return {n: [_mean(column) for column in zip(*rows, strict=True)] for n, rows in found.items()}


def _mean(errors: Sequence[Error]) -> Error:
    return Error(
        float(np.mean([e.rmse for e in errors])), float(np.mean([e.delta_e for e in errors]))
    )


def costs(counts: Sequence[int] = COUNTS) -> dict[int, tuple[float, float]]:
    """Process time of open water along rays in numpy over that of 8 bands: tables, closed form."""
    angle = np.linspace(0.0, 2.0 * np.pi, _RAYS, endpoint=False)[:, None]
    up = np.linspace(-0.9, 0.9, _RAYS)[:, None]
    across = np.sqrt(1.0 - up**2)
    w = (across * np.cos(angle), across * np.sin(angle), up)
    y = np.full_like(up, SCENES[4].depth)
    seconds = {}
    for n in dict.fromkeys((8, *counts)):
        at = setting(SCENES[4], Bands.uniform(n))
        each = []
        for water in (at.tables, at.closed_form):
            trials = []
            for _ in range(_TRIALS):
                start = time.process_time()
                _ = water.open_water(y, w).total
                trials.append(time.process_time() - start)
            each.append(min(trials))
        seconds[n] = each
    return {n: (seconds[n][0] / seconds[8][0], seconds[n][1] / seconds[8][1]) for n in counts}


def table2() -> dict[str, dict[str, float]]:
    """Return sRGB RMSE of CIE XYZ pictures taken to sRGB, by method and scene."""
    eye = standard_observer()
    found: dict[str, dict[str, float]] = {}
    for scene in SCENES:
        fine, eight = setting(scene), setting(scene, EIGHT)
        exposed = scenes.development(fine, eye, balanced=True)
        reference = exposed.of_bands(scenes.tables(fine))
        mixed = fine.mixed(eye.response_in(FINE))
        pictures = {
            AS_DESCRIBED: exposed.of_channels(scenes.one_light(mixed)),
            PAPER: exposed.of_bands(scenes.paper_printed(eight), EIGHT),
            "Eqs 9, 10 corrected, 8 bands": exposed.of_bands(scenes.paper_corrected(eight), EIGHT),
            "ours, closed form, 8 bands": exposed.of_bands(scenes.closed_form(eight), EIGHT),
            "ours, tables, 8 bands": exposed.of_bands(scenes.tables(eight), EIGHT),
        }
        for name, rgb in pictures.items():
            found.setdefault(name, {})[scene.title] = srgb_rmse(rgb, reference)
    return found


@dataclass(frozen=True)
class Look:
    """Level open water of a figure.

    Attributes
    ----------
    single : float
        Share of single scattering in its luminance.
    amount : float
        Luminance of single scattering over that of a white diffuser at the camera.
    left : float
        Luminance of the light at the camera over that below the surface.
    rgb : tuple of float
        As sRGB.
    """

    single: float
    amount: float
    left: float
    rgb: tuple[float, ...]


def look(scene: PaperScene, sensor: Sensor | None = None, *, balanced: bool = True) -> Look:
    """Level open water at a scene's camera, at right angles to the sun."""
    at, eye = setting(scene), standard_observer()
    w = tuple(np.full((1, 1), x) for x in scenes.level_ray(at.column))
    pixel = at.tables.open_water(np.full((1, 1), scene.depth), w)
    luminous = eye.response_in(FINE)[1]
    single, total = (float(luminous @ L[0]) for L in (pixel.single_scattering, pixel.total))
    exposed = scenes.development(at, sensor or eye, balanced=balanced)
    light = float(luminous @ at.light)
    return Look(
        single / total,
        single / (light / np.pi),
        light / float(luminous @ at.column.sun_irradiance),
        tuple(srgb_encode(exposed.of_bands(pixel.total[0])).tolist()),
    )


def green_over_blue(scene: PaperScene, sensor: Sensor) -> float:
    """Response of the green channel to level open water over that of the blue."""
    at = setting(scene)
    w = tuple(np.full((1, 1), x) for x in scenes.level_ray(at.column))
    L = at.tables.open_water(np.full((1, 1), scene.depth), w).total[0]
    _, green, blue = sensor.response_in(FINE) @ L
    return float(green / blue)


def _spread(errors: Errors, title: str, method: str) -> tuple[list[float], list[float]]:
    chosen = [each[method] for (scene, _), each in errors.items() if scene == title]
    return [e.rmse for e in chosen], [e.delta_e for e in chosen]


def main(_arguments: list[str]) -> None:
    """Measure, write docs/measured/paper_figures.md and its pictures."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)  # sensors reach beyond 400 to 700 nm
        text = page(ROOT / "docs" / "measured")
    (ROOT / "docs" / "measured" / "paper_figures.md").write_text(text, encoding="utf-8")
    print(text)


def page(folder: Path) -> str:
    """Return the text; draw the pictures into a folder."""
    sensors = cameras()
    raw, balanced = (figure14(sensors, balanced=each) for each in (False, True))
    eye_and_cameras = [parse_sensor(x) for x in ("cie1931", "ARRI D21", "Canon EOS 600D")]
    bands = figure12(eye_and_cameras)
    draw(folder / "paper_figures.png", raw, bands)
    draw_looks(folder / "paper_waters.png")
    return "\n".join(
        [
            _head(),
            _figure14_text(raw, balanced),
            _figure12_text(bands),
            _looks_text(),
            _table2_text(),
            _gutierrez_text(),
            "\nWritten by `python3 dev.py run -m benchmarks paper_figures`.\n",
        ]
    )


def draw(path: Path, errors: Errors, bands: dict[int, list[Error]]) -> None:
    """Draw Figure 14 with its spread over cameras, and the error over the number of bands."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    sheet, axes = plt.subplots(1, 3, figsize=(10.0, 3.0), dpi=80)
    place = np.arange(len(SCENES))
    for part, (axis, label) in enumerate(zip(axes[:2], ("sRGB RMSE", "ΔE2000"), strict=True)):
        for shift, (name, colour) in enumerate(((RGB_WAVES, "C0"), (SPECTRAL, "C1"))):
            values = [_spread(errors, scene.title, name)[part] for scene in SCENES]
            mean = np.mean(values, axis=1)
            reach = np.abs(np.array([np.min(values, axis=1), np.max(values, axis=1)]) - mean)
            axis.bar(place + 0.4 * shift, mean, 0.38, yerr=reach, color=colour, label=name)
        axis.set_xticks(place + 0.2, [scene.title for scene in SCENES], fontsize=7)
        axis.set_title(f"{label}, mean and range of cameras", fontsize=8)
        axis.legend(fontsize=7)
    for k, label in enumerate(("tables", "closed form", "closed form against tables")):
        values = [each[k].delta_e for each in bands.values()]
        axes[2].loglog(list(bands), values, ".-", label=label)
    axes[2].set_title("ΔE2000 over the number of bands", fontsize=8)
    axes[2].legend(fontsize=7)
    sheet.tight_layout()
    sheet.savefig(path, metadata={"Software": None})
    plt.close(sheet)


def draw_looks(path: Path) -> None:
    """Draw the colours of Figures 8 and 10."""
    import matplotlib.pyplot as plt

    sheet, axes = plt.subplots(1, 2, figsize=(7.0, 2.6), dpi=72)
    for axis, (number, waters, floors) in zip(axes, LOOKS, strict=True):
        axis.imshow(
            [[look(PaperScene(w, floor - 1.0, 1.0)).rgb for w in waters] for floor in floors],
            aspect="auto",
        )
        axis.set_xticks(range(len(waters)), waters, fontsize=8)
        axis.set_yticks(range(len(floors)), [f"{x:g} m" for x in floors], fontsize=8)
        axis.set_title(f"Figure {number}", fontsize=8)
    sheet.tight_layout()
    sheet.savefig(path, metadata={"Software": None})
    plt.close(sheet)


def _head() -> str:
    return f"""# The papers' figures in our numbers

Monzon et al. (2024, 2022) and Gutierrez et al. (2008) print few numbers, and no scene, texture or
exposure: compare order and ratio, not digits.

Our colours: sun D65 at {scenes.SUN_ZENITH:g}°, no sky, HG {scenes.ASYMMETRY:g} (their path
tracer's), water of Solonenko & Mobley (2015), floor {scenes.CAMERA_ABOVE:g} m below the camera,
{24 * len(scenes.DISTANCES)} patches of the ColorChecker and open water as sRGB, against the
solved field in {len(FINE)} bands.
"""


def _cells(errors: Errors, method: str) -> str:
    """Mean of scenes and cameras, and the worst scene."""
    means = []
    for scene in SCENES:
        rmse, delta_e = _spread(errors, scene.title, method)
        means.append((np.mean(rmse), np.mean(delta_e), scene.title))
    rmse, delta_e = (np.mean([x[i] for x in means]) for i in range(2))
    worst = max(means, key=lambda x: x[1])
    return f"{rmse:.3f}/{delta_e:.1f} | {worst[1]:.1f} ({worst[2]})"


def _wins(errors: Errors, better: str, worse: str) -> str:
    both = [e[better].rmse < e[worse].rmse for e in errors.values()]
    seen = [e[better].delta_e < e[worse].delta_e for e in errors.values()]
    return f"{sum(both)} by RMSE and {sum(seen)} by ΔE of {len(errors)}"


def _figure14_text(raw: Errors, balanced: Errors) -> str:
    lines = [f"| {name} | {_cells(raw, name)} | {_cells(balanced, name)} |" for name in METHODS]
    table = grid("| | as RGB | worst scene, ΔE | developed | worst scene, ΔE |", lines)
    return f"""## Monzon 2024, Figures 13 and 14: RGB against spectral, by camera
Theirs: 28 cameras, bars without values, spectral closer to the path tracer. Ours: mean sRGB
RMSE/ΔE2000 of {len(raw) // len(SCENES)} cameras and the scenes of Table 2, responses as RGB
(Equation 12) and developed. *Wavelengths*: each channel at its mean wavelength; *means*:
coefficients and reflectances averaged over it.

{table}

- Spectral is closer than RGB in {_wins(raw, SPECTRAL, RGB_WAVES)} cameras and scenes for our
  light, in {_wins(raw, PAPER, PAPER_RGB)} for their formula (as RGB); developed,
  in {_wins(balanced, SPECTRAL, RGB_WAVES)} and {_wins(balanced, PAPER, PAPER_RGB)}.
- In 3C at 3 m and in II the light of Equations 9 and 10 errs more than the bands do, so that RGB
  comes out closer for many cameras.

![Figure 14 in our numbers, and the error over bands](paper_figures.png)
"""


def _figure12_text(bands: dict[int, list[Error]]) -> str:
    ours = costs((32, 250))
    t_8 = 1.17 + 0.056 * 8
    lines = []
    for n in PRINTED_COUNTS:
        cells = " | ".join(f"{e.rmse:.4f}/{e.delta_e:.2f}" for e in bands[n][::2])
        lines.append(f"| {n} | {cells} |")
    table = grid("| bands | tables | closed form |", lines)
    return f"""## Monzon 2024, Figure 12: the number of bands
Theirs: 15.81 + 0.056 n ms for n bands (the text measured 0.2 ms more at 8, 0.5 less at 32); eight
are their compromise. Ours: sRGB RMSE/ΔE2000 against tables in {len(MANY)} bands, mean over scenes
and three cameras. Open water in numpy costs {ours[32][0]:.2f} and {ours[250][0]:.2f} times that
of 8 bands at 32 and 250, by their fit {(1.17 + 0.056 * 32) / t_8:.2f} and
{(1.17 + 0.056 * 250) / t_8:.2f}.

{table}

From 12 bands on the closed form's own error is the larger one.
"""


def _looks_text() -> str:
    left = {water: look(PaperScene(water, 10.0, 1.0)).left for water in ("1C", "3C", "5C")}
    at_ten = ", ".join(f"{100 * x:.2g} % ({water})" for water, x in left.items())
    clear = PaperScene("IA", 5.0)
    every = {s.name: green_over_blue(clear, s) for s in cameras()}
    low, high = min(every, key=every.__getitem__), max(every, key=every.__getitem__)
    ends = [
        (
            water,
            [look(PaperScene(water, floor - 1.0, 1.0)).single for floor in (floors[0], floors[-1])],
        )
        for _, waters, floors in LOOKS
        for water in (waters[0], waters[-1])
    ]
    single = ", ".join(f"{100 * a:.2g} to {100 * b:.2g} % ({w})" for w, (a, b) in ends)
    amounts = "/".join(f"{100 * look(PaperScene(w, 3.0, 1.0)).amount:.2g}" for w in LOOKS[0][1])
    return f"""## Monzon 2024, Figures 7, 8 and 10; Monzon 2022, Figure 1: how waters look
![Colours of the open water](paper_waters.png)

Figures 8 and 10: at 10 m {at_ten} of the luminance at the surface is left, {_stops(left)} stops.
The fraction of single scattering falls with depth as they say:
{single}. Beside a white diffuser over a floor at 4 m it is
{amounts} % in I / IA / IB / II: up to IB as they have it, less in II.
Figure 7, IA by Canon A2200 (which does not ship) and Arriflex D21: green over blue in open water is
from {every[low]:.2f} ({low}) to {every[high]:.2f} ({high}).
The sensors of Monzon 2022, Figure 1, are not named. Not repeated: 1 to 6 and 9; 15 is in
[outside.md](outside.md).
"""


def _stops(left: dict[str, float]) -> str:
    return "/".join(f"{-np.log2(x):.1f}" for x in left.values())


def _table2_text() -> str:
    found = table2()
    titles = list(TABLE2)

    def line(name: str, values: dict[str, float]) -> str:
        each = [values[t] for t in titles]
        return f"| {name} | {np.mean(each):.3f} | {min(each):.3f}…{max(each):.3f} |"

    lines = [
        line("*Chen et al., printed, their scenes*", USSIM),
        line("*Monzon et al., printed, their scenes*", TABLE2),
        *(line(name, values) for name, values in found.items()),
    ]
    theirs = {t: USSIM[t] / TABLE2[t] for t in titles}
    here = {t: found[AS_DESCRIBED][t] / found[PAPER][t] for t in titles}
    ratios = [
        f"{label} {'/'.join(f'{x:.1f}' for x in each.values())}"
        for label, each in (("printed", theirs), ("here", here))
    ]
    return f"""## Monzon 2024, Table 2 and Figure 11: against the XYZ method
sRGB RMSE against path tracing, CIE XYZ taken to sRGB, mean and range of the six scenes. Chen et al.
(USSim) average coefficients in XYZ and have one light by depth and a veil without direction; the
text has no formula.

{grid("| | mean | range |", lines)}

Error of Chen et al. over that of Monzon et al. in {", ".join(titles)}: {ratios[0]}; {ratios[1]}.
In clear water the order comes out.
"""


def _gutierrez_text() -> str:
    waters = {
        "C 0.1": Constituents(0.1),
        "C 0.1, a_y 0.1": Constituents(0.1, cdom=0.1),
        "C 1, a_d 0.1": Constituents(1.0, detritus=0.1),
    }
    lines = []
    for name, element in printed.ELEMENTS.items():
        changes = [printed.compare(water, element) for water in waters.values()]
        bright, off = ([getattr(c, x) for c in changes] for x in ("brightness", "delta_e"))
        lines.append(
            f"| {name} | {min(bright):.2f}…{max(bright):.2f} | {min(off):.1f}…{max(off):.1f} |"
        )
    baltic = named_waters()["baltic"].constituents
    shares = [printed.inelastic_shares(water) for water in (*waters.values(), baltic)]
    every = {name: [100 * x[name] for x in shares] for name in shares[0]}
    inelastic = "; ".join(f"{name}, {min(x):.2g}…{max(x):.2g} %" for name, x in every.items())
    gaining = ", ".join(f"{100 * printed.gaining_bands(w):.0f} %" for w in waters.values())
    return f"""## Gutierrez 2008: what Tables 1, 2 and 5 change
Level open water at {gutierrez_figures.DEPTH:g} m in {"/".join(waters)}, closed form, clear sky:
luminance over ours with one printed element in place of ours, and ΔE2000 made equally bright.

{grid("| | × luminance | ΔE2000 |", lines)}

As printed, the phase function 1/π of phytoplankton integrates to 4: in {gaining} of the bands
scattering then gives back more than is lost, and deep water has no solution. Fraction of inelastic
light in the luminance, these waters and the Baltic: {inelastic}; *printed* has the absorption of
water for the Raman coefficient (§3.3.2) and a quantum yield of {printed.QUANTUM_YIELD:g}. Their
text has less than 2 %. See [bio_optics.md](bio_optics.md) for Figures 2 to 4.
"""
