"""Caustics against the sea and a photon trace."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.caustics import caustic_pattern
from ..uw_spectral.surface.refraction import sun_travel_direction
from ..uw_spectral.surface.waves import WaveSpectrum, slope_variance_CoxMunk1954
from ..validation import caustics_at_sea as sea
from .runner import Ask, Page, joined, pyplot, table


def figure(path: Path, found: list[tuple[NDArray, NDArray, NDArray]]) -> None:
    """One sea at four depths, and the CV against Darecki et al."""
    from PIL import Image

    plt = pyplot()
    water = sea.darecki_water(sea.DARECKI_ZENITH)
    waves = WaveSpectrum(5.25, 0.0).realise(8.0, 1024, 1)
    (depths, cv, calm), (_, _, modelled) = found[:2]
    plot, axes = plt.subplots(1, 4, figsize=(10, 2.6), layout="constrained", dpi=90)
    for axis, depth in zip(axes, (0.5, 2.0, 8.0), strict=False):
        image = caustic_pattern(waves, np.asarray(water.field.sun), depth, 0.0, 1024)
        axis.imshow(image[:384:2, :384:2], cmap="gray", vmin=0, vmax=3)
        axis.set(title=f"{depth:g} m, 3 × 3 m", xticks=[], yticks=[])
    for band, (wavelength, colour) in enumerate(
        zip(sea.SEEN_WATER, ("tab:blue", "tab:green", "tab:red"), strict=True)
    ):
        axes[3].plot(depths, cv[:, band], "o", color=colour, ms=4, label=f"{wavelength:g} nm")
        axes[3].fill_between(depths, modelled[:, band], calm[:, band], color=colour, alpha=0.3)
    axes[3].set(yscale="log", xlabel="depth, m", title="CV of Ed: sea (dots), 4.1-5.25 m/s")
    axes[3].title.set_fontsize(9)
    axes[3].legend(fontsize=7)
    plot.savefig(path)
    plt.close(plot)
    with Image.open(path) as picture:  # a palette keeps the file small
        small = picture.convert("RGB").quantize(128)
    small.save(path, optimize=True)


def _published(wind: float) -> float:
    k = np.geomspace(1e-3, 6000, 20000)
    return float(np.trapezoid(WaveSpectrum(wind).curvature_Elfouhaily1997(k), np.log(k)))


def measure(ask: Ask) -> Mapping[str, object]:
    """Compare with the sea, and with photons."""
    found = [sea.against_darecki(wind) for wind in sea.DARECKI_WINDS]
    figure(ask.shown("caustics.png"), found)
    depths, cv, _ = found[0]
    darecki = [
        [f"{depth:g}", *(joined(model[i] / cv[i], ".2f") for *_, model in found)]
        for i, depth in enumerate(depths.tolist())
    ]
    winds, at_days, on_days = sea.against_days()
    others = [sea.against_days(patchy=False)[2], sea.against_days(acceptance=0.0)[2]]
    days = [
        [f"{wind:g}", *(joined(model[i] / at_days[i]) for model in (on_days, *others))]
        for i, wind in enumerate(winds.tolist())
    ]
    buoy = [sea.against_gernez(zenith) for zenith in (20.0, 40.0, 60.0)]
    even = sea.against_darecki(sea.DARECKI_WINDS[1], patchy=False)[2] / cv
    seen = sea.against_darecki(sea.DARECKI_WINDS[1], acceptance=0.0)[2] / cv
    slopes = [
        [f"{wind:g}", *("+".join(f"{x:.4f}" for x in pair) for pair in
                        (slope_variance_CoxMunk1954(wind), WaveSpectrum(wind).slope_variance())),
         f"{_published(wind):.4f}"]
        for wind in (2.0, 5.0, 10.0)
    ]  # fmt: skip
    traces = []
    for wind in sea.TRACE_WINDS:
        pairs = [sea.traced(wind, depth) for depth in sea.TRACE_DEPTHS]
        cv_off = max(abs(a.std() / b.std() - 1.0) for a, b in pairs)
        apart = max(sea.histogram_distance(*pair) for pair in pairs)
        alike = min(np.corrcoef(a.ravel(), b.ravel())[0, 1] for a, b in pairs)
        traces.append([f"{wind:g}", f"{100 * cv_off:.1f} %", f"{apart:.3f}", f"{alike:.3f}"])
    layers = [
        [f"{depth:g}", *(joined(100 * x, "+.0f") for x in both)]
        for depth, *both in sea.layer_cost(5.0)
    ]
    waves = WaveSpectrum(5.0).realise(16.0, 1024, 1)
    start = time.process_time()
    caustic_pattern(waves, sun_travel_direction(0.0, 0.0), 4.0, 0.0, 1024)
    return {
        "darecki": table(("depth, m", *(f"{w:g} m/s" for w in sea.DARECKI_WINDS)), darecki),
        "inside": ", ".join(str(int(np.sum(np.abs(x / cv - 1) <= 0.1))) for *_, x in found),
        "days": table(("wind, m/s", "now", "even ripples", "b as the meter sees it"), days),
        "mean": (on_days / at_days).mean(), "within": 100 * np.abs(on_days / at_days - 1).max(),
        "even": joined(even[:2, 1]), "seen": joined(seen[-2:, 1]),
        "at_once": joined([row[0] for row in buoy]),
        "slow": joined([row[-1] for row in buoy]),
        "slopes": table(
            ("wind, m/s", "Cox & Munk 1954", "spectrum used", "Elfouhaily 1997, sum"), slopes
        ),
        "traces": table(("wind, m/s", "CV off", "cumulative histogram off", "correlation"), traces),
        "layers": table(("depth, m", "with gain", "plain"), layers),
        "seconds": time.process_time() - start,
    }  # fmt: skip


PAGE = Page(
    "Caustics",
    """
![One sea at three depths; coefficient of variation against the sea](caustics.png)

Waves of Elfouhaily et al. (1997), shorter ones scaled to Cox & Munk (1954), ripples in patches as
the peakedness of their slopes says (`WaveSpectrum.ripples`); refracted rays (`caustic_pattern`),
contrast lost by scattering (`SunlitWater`). No number is fitted to what follows; that ripples begin
at 6 cm, and not at the 30 cm of a slick, was decided with it at hand.

## Against the sea: Darecki et al. 2011

Variation of Ed, modelled over measured, at 443 / 532 / 670 nm, sun at 31.5°, collector 2.5 mm. Of
the water only c(555) is published; what a meter of 0.93° counts as not scattered, a quarter of b,
is added. The wind was 4.1 to 6.4 m/s. Wanted: 0.9 to 1.1.

{darecki}

{inside} of 18 values are within a tenth at 4.1, 5.25 and 6.4 m/s.

Five other days with winds of their own, about 1.1 m deep, sun at 44°:

{days}

Their mean is × {mean:.2f}, the worst {within:.0f} % off. With ripples that lie evenly, 0.86 and
1.7 m above would have {even} (532 nm, 5.25 m/s); with the b that a meter sees, 6.7 and 9.6 m
{seen}.

## Against the sea: Gernez & Antoine 2009

510 nm, 3.2 m, their sky; wind and chlorophyll are not published. Model over sea with the sun at
20 / 40 / 60°: {at_once}, **missed**; averaged over ⅓ s, which a record of 6 Hz does not resolve,
{slow}.

## Slope variance

Along + across the wind; the scatter of Cox & Munk is ± 0.004 (along, sum) and ± 0.002.

{slopes}

## Against a photon trace

8 million photons through the same waves, sun at 30°, 0.5 to 10 m: worst of four depths (photon
noise alone takes the correlation below 1).

{traces}

## One grey image for all bands and depths

Octave layers blended in log depth; error of the CV of Ed at 443 / 532 / 670 nm in %, with the gain
of `CausticLayers.contrast` and plainly blended. In turbid water the gain is held at 1.5 from 2.8 m
down, where hardly any sun is left: **caustics are too weak there**.

{layers}

A pattern of 1024² takes {seconds:.2f} s on one core.
""",
)
