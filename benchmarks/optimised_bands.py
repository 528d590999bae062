"""Optimised against equal bands: colour error over all waters, cameras and films."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.imaging.band_selection import fitted_reduction, optimised_bands
from ..uw_spectral.imaging.description import REFERENCE_BANDS
from ..uw_spectral.imaging.viewpoint import Viewpoint
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, luminance
from ..uw_spectral.spectra.illuminant import Illuminant, parse_illuminant
from ..uw_spectral.spectra.reflectance import colorchecker_patches, colorchecker_reflectance, uplift
from ..uw_spectral.spectra.sensor import Sensor, list_sensors, parse_sensor
from ..uw_spectral.water.optical_properties import JERLOV_TYPES, Water
from ..validation.viewpoints import make_viewpoint
from .runner import Ask, Page, table

TUNED_WATERS = ("I", "IB", "II", "3C")
TUNED_SENSORS = ("cie1931", "Nikon D7000", "ARRI D21", "Canon EOS 5D Mark II")
"""What the constants of the method were chosen on; all else is held out."""

# The expected spectra have none of these depths, directions, distances, patches or RGB colours.
_DEPTHS = (1.0, 5.0, 20.0)
_PLACED, _SEEN = 30.0, 55.0  # sun zenith for placing the bands, and for the pictures
_DIRECTIONS = ((-1.0, 0.0, 0.0), (0.3, 0.7, -0.648), (-0.6, 0.67, 0.437), (0.2, 0.1, -0.975))
_DISTANCES = (0.2, 0.7, 1.5)  # mean free paths
_EQUAL, _OPTIMISED = (6, 8, 16), (3, 6, 9)
_HERE = "optimised 6, for its depth"
_PLAIN = "optimised 6, midpoint weights"
_SIXTY = "equal 60"
_EVERY = 5.0  # depth at which every camera is tried; elsewhere every third
_FINE = Bands.uniform(REFERENCE_BANDS)
_FINER = Bands.uniform(150)
_Errors = dict[str, NDArray[np.float64]]
_Case = tuple[str, float, str]  # water, depth, camera


@functools.lru_cache(maxsize=64)
def _patches(bands: Bands) -> NDArray[np.float64]:
    """The ColorChecker and as many random RGB colours, as reflectances."""
    chart = [colorchecker_reflectance(patch).at(bands.centres) for patch in colorchecker_patches()]
    colours = np.random.default_rng(1).uniform(0.0, 1.0, (len(chart), 3))
    return np.vstack([chart, uplift(colours, bands)])


def _spectra(view: Viewpoint, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Open water and patches, seen at distances in four directions, shape (s, n)."""
    spectra = []
    for direction in _DIRECTIONS:
        w = np.array(direction) / np.linalg.norm(direction)
        background = view.field.radiance(view.depth, w)
        spectra.append(background[None])
        for length in lengths:
            depth = max(view.depth - w[2] * length, 0.0)
            P = (view.depth - depth) / w[2] if w[2] else length
            patches = _patches(view.column.bands) * view.field.Ed(depth) / math.pi
            transmittance = np.exp(-view.attenuation * P)
            spectra.append(background + transmittance * (patches - view.field.radiance(depth, w)))
    return np.vstack(spectra)


class _Scene:
    """Everything about one water at one depth that does not depend on the camera."""

    def __init__(self, name: str, depth: float) -> None:
        self.water, self.depth = Water.jerlov(name), depth
        fine = self.view(_FINE, parse_sensor("cie1931"))
        seen = luminance(fine.reduction.weights.T) * fine.light
        self.lengths = np.array(_DISTANCES) * seen.sum() / (seen @ fine.column.attenuation)
        self.bands = {f"equal {n}": Bands.uniform(n) for n in _EQUAL}
        placing = self.view(_FINE, fine.sensor, _PLACED)
        for n in _OPTIMISED:
            self.bands[f"optimised {n}"] = _placed(name, n)
        self.bands[_HERE] = optimised_bands(6, placing, (depth,)).bands
        self.bands[_PLAIN] = self.bands["optimised 6"]
        # Only the weights depend on the camera.
        self.spectra = {
            label: _spectra(self.view(bands, fine.sensor), self.lengths)
            for label, bands in {**self.bands, "fine": _FINE, "finer": _FINER}.items()
        }

    def view(self, bands: Bands, sensor: Sensor, zenith: float = _SEEN) -> Viewpoint:
        """Camera at the depth of the scene."""
        return make_viewpoint(self.water, _light(), sensor, self.depth, bands, sun_zenith=zenith)

    def errors(self, sensor: Sensor) -> _Errors:
        """ΔE2000 of every spectrum for every choice of bands, against 150 bands."""
        finer, fine = self.view(_FINER, sensor), self.view(_FINE, sensor)
        truth = finer.reduction.apply(self.spectra["finer"])
        result = {}
        for label, bands in self.bands.items():
            view = self.view(bands, sensor)
            plain = label == _PLAIN or label.startswith("equal")
            develop = view.reduction if plain else fitted_reduction(view, fine)
            result[label] = delta_e_CIE2000_images(develop.apply(self.spectra[label]), truth)
        result[_SIXTY] = delta_e_CIE2000_images(fine.reduction.apply(self.spectra["fine"]), truth)
        return result


@functools.cache
def _light() -> Illuminant:
    return parse_illuminant("d65")


@functools.cache
def _placed(name: str, count: int) -> Bands:
    """Bands for a water at the usual depths."""
    view = make_viewpoint(
        Water.jerlov(name), _light(), parse_sensor("cie1931"), 1.0, _FINE, sun_zenith=_PLACED
    )
    return optimised_bands(count, view).bands


def _measured() -> dict[_Case, _Errors]:
    """ΔE2000 of every case: each camera in each water, at one depth or more."""
    sensors = [parse_sensor(name) for name in list_sensors()]
    some = [s for i, s in enumerate(sensors) if i % 3 == 0 or s.name in TUNED_SENSORS]
    found = {}
    for water in JERLOV_TYPES:
        for depth in _DEPTHS:
            scene = _Scene(water, depth)
            for sensor in sensors if depth == _EVERY else some:
                found[water, depth, sensor.name] = scene.errors(sensor)
        print(f"{water}: {len(found)} cases", flush=True)
    return found


def _cell(errors: list[NDArray[np.float64]]) -> str:
    """Mean, 95 % and the worst case's mean."""
    every = np.concatenate(errors)
    worst = max(float(e.mean()) for e in errors)
    return f"{every.mean():.2f}/{np.percentile(every, 95):.2f}/{worst:.2f}"


def _chosen(found: dict[_Case, _Errors], label: str, **wanted: object) -> list[NDArray[np.float64]]:
    """Errors of one choice of bands where water, depth or sensor are among those wanted."""
    names = ("water", "depth", "sensor")
    return [
        errors[label]
        for case, errors in found.items()
        if all(value in wanted.get(name, [value]) for name, value in zip(names, case, strict=True))
    ]


def _listed(parts: Iterable[str]) -> str:
    *first, last = parts
    return f"{', '.join(first)} and {last}"


def _spread(found: dict[_Case, _Errors], label: str, of: str, names: Sequence[str]) -> str:
    """Median and largest of the means of waters or cameras at one depth, and the largest's name."""
    means = {
        name: float(np.concatenate(_chosen(found, label, depth=[_EVERY], **{of: [name]})).mean())
        for name in names
    }
    most = max(means, key=means.__getitem__)
    return f"{np.median(list(means.values())):.2f}/{means[most]:.2f} ({most})"


def _times() -> str:
    """Process seconds of the search and of the fit, by number of bands."""
    said, eye = [], parse_sensor("cie1931")
    for count in (*_OPTIMISED, 12):
        search, fit = [], []
        for _ in range(3):
            fine = make_viewpoint(Water.jerlov("IB"), _light(), eye, 5.0, _FINE)
            start = time.process_time()
            bands = optimised_bands(count, fine).bands
            search.append(time.process_time() - start)
            few = make_viewpoint(Water.jerlov("IB"), _light(), eye, 5.0, bands)
            start = time.process_time()
            fitted_reduction(few, fine)
            fit.append(time.process_time() - start)
        said.append(f"{count}: {min(search):.2f} and {min(fit):.3f}")
    return ", ".join(said)


def measure(_: Ask) -> Mapping[str, object]:
    """Try all cases."""
    found, times = _measured(), _times()
    labels = [*(f"equal {n}" for n in _EQUAL), *(f"optimised {n}" for n in _OPTIMISED)]
    labels += [_HERE, _PLAIN, _SIXTY]
    sensors = list(dict.fromkeys(case[2] for case in found))
    held = {
        "water": [w for w in JERLOV_TYPES if w not in TUNED_WATERS],
        "sensor": [s for s in sensors if s not in TUNED_SENSORS],
    }

    def wins(few: str, depth: float) -> str:
        pairs = zip(*(_chosen(found, x, depth=[depth]) for x in (few, "equal 16")), strict=True)
        return f"{100 * np.mean([float(a.mean() <= b.mean()) for a, b in pairs]):.0f} %"

    shown = ("equal 16", "optimised 6", "optimised 9")
    tuned = {"water": TUNED_WATERS, "sensor": TUNED_SENSORS}
    groups = {"tuned waters, tuned cameras": tuned, "held-out waters and cameras": held}
    rows = [
        [name, *(_cell(_chosen(found, label, **of)) for label in shown)]
        for name, of in groups.items()
    ]
    for name, of, names in (("waters", "water", JERLOV_TYPES), ("cameras", "sensor", sensors)):
        rows.append([name, *(_spread(found, label, of, names) for label in shown)])
    worst = max(found, key=lambda case: found[case]["optimised 6"].mean())
    errors = [[x, *(_cell(_chosen(found, x, depth=[d])) for d in _DEPTHS)] for x in labels]
    six, sixteen = (f"{found[worst][x].mean():.2f}" for x in ("optimised 6", "equal 16"))
    return {
        "six": _listed(wins("optimised 6", d) for d in _DEPTHS),
        "nine": _listed(wins("optimised 9", d) for d in _DEPTHS),
        "count": len(sensors), "cases": len(found), "times": times,
        "errors": table(("bands", *(f"{d:g} m" for d in _DEPTHS)), errors),
        "held": table(("", *shown), rows),
        "worst": f"{worst[0]}, {worst[1]:g} m, {worst[2]}, {six} (16 equal bands {sixteen})",
    }  # fmt: skip


PAGE = Page(
    "Optimised bands",
    """
Target: 6 optimised bands at or below the error of 16 equal ones. Met in {six} of the cases at 1, 5
and 20 m; with 9 bands in {nine}. Near the surface six samples do not tell all colours apart; deeper
down, where equal bands err most, they do.

ΔE2000 against 150 equal bands, D65: 10 Jerlov waters and {count} cameras, films and observers (all
at 5 m, every third elsewhere), {cases} cases. Bands are placed for the eye with the sun at 30°,
weights fitted to 60 bands for camera and depth; seen, with the sun at 55°, are colours, directions
and distances that the fit does not know. Waters and cameras other than I, IB, II, 3C and cie1931,
Nikon D7000, ARRI D21, Canon EOS 5D Mark II are held out of the method's constants. *Midpoint
weights* are all there is where nobody knows the water.

Mean/95 % of all spectra/mean of the worst case:

{errors}

The same on what was held out; means of waters and cameras at 5 m, median / largest:

{held}

Worst case of 6 optimised bands: {worst}.

Process seconds on one core, IB at 5 m, wavelengths and weights, by bands: {times}.
""",
)
