"""How far the light of lamps is right: scattered once against the integral, more against photons.

    python3 dev.py run -m benchmarks lamp_light [--cases N] [--photons N]

writes docs/measured/lamp_light.md. Takes about a quarter of an hour. Photons are kept.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps import lamp_path
from ..uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from ..uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from ..uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from ..uw_spectral.lamps.profile import IsotropicProfile
from ..uw_spectral.spectra.spectral_image import replacing
from ..uw_spectral.water.phase import BandPhase, HenyeyGreenstein, parse_phase, seawater_mixture
from . import _lamp_cases
from ._lamp_photons import summed

_ALBEDOS = (0.3, 0.5, 0.7, 0.8, 0.9, 0.95)
_NOISE = 0.12
_PANELS = 400
_ROOT = Path(__file__).resolve().parent.parent
type Row = tuple[_lamp_cases.Case, float, float, float, float]
_PHASES = {
    "HG 0.8": BandPhase((HenyeyGreenstein(0.8),), np.ones((1, 1))),
    "HG 0.924": BandPhase((HenyeyGreenstein(0.924),), np.ones((1, 1))),
    "mixture": seawater_mixture([1.0], [0.02]),
    "Petzold": parse_phase("petzold").for_bands([1.0]),
}


def exact(lamp: Lamp, P: float, c: float, phase: BandPhase) -> float:
    """Light of an isotropic lamp scattered once along z from the origin, by fine panels."""
    ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), P)
    h, t0 = float(ray.h), float(ray.t0)
    edges = np.linspace(math.asinh(-t0 / h), math.asinh((P - t0) / h), _PANELS + 1)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    tangent = np.exp(middle + half * nodes)
    s2 = tangent**2 / (1 + tangent**2)
    p = phase.per_steradian(s2[..., None])[..., 0]
    dxi = half * weights * tangent / (1 + tangent**2)
    return float((2 / h * p * np.exp(-c * (t0 + h * tangent)) * dxi).sum())


def even_in_angle(lamp: Lamp, P: float, c: float, phase: BandPhase, nodes: int) -> float:
    """The same by Gauss-Legendre in ξ itself."""
    ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), P)
    h, t0 = float(ray.h), float(ray.t0)
    start, end = (math.pi / 4 + math.atan2(s, h) / 2 for s in (-t0, P - t0))
    place, weight = lamp_path.gauss(nodes)
    tangent = np.tan(start + (end - start) * place)
    p = phase.per_steradian((tangent**2 / (1 + tangent**2))[:, None])[:, 0]
    return float((2 / h * p * np.exp(-c * (t0 + h * tangent)) * weight).sum() * (end - start))


def _by_nodes(lamp: Lamp, P: float, c: float, phase: BandPhase, nodes: int) -> float:
    ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), P)
    one = np.ones(1)
    return float(lamp_path.scattered_once(lamp, ray, one, c * one, phase, nodes=nodes)[0])


def quadrature_errors(
    in_view: bool, phase: BandPhase, count: int = 200
) -> dict[str, NDArray[np.float64]]:
    """Relative errors of random cases by way."""
    rng = np.random.default_rng(1)
    ways: dict[str, Callable[..., float]] = {"ξ": even_in_angle, "ξ^⅓": _by_nodes}
    found = {name: np.empty(count) for name in ways}

    def even(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    for i in range(count):
        c = even(0.03, 3.0)
        if in_view:
            t0 = even(0.5, 30.0)
            h, P = t0 * even(1e-3, 1.0), t0 * rng.uniform(1.2, 5.0)
        else:
            t0, h, P = rng.uniform(-0.3, 0.3), even(0.1, 1.0), even(0.5, 30.0)
        lamp = Lamp((h, 0.0, t0), (0.0, 0.0, 1.0), np.ones(1), IsotropicProfile(), 1e-4)
        wanted = exact(lamp, P, c, phase)
        for name in found:
            value = ways[name](lamp, P, c, phase, lamp_path.NODES)
            found[name][i] = abs(value / wanted - 1)
    return found


def _quadrature_table() -> str:
    rows = []
    for in_view, (name, phase) in itertools.product((False, True), _PHASES.items()):
        errors = quadrature_errors(in_view, phase)
        cells = [
            f"{100 * np.quantile(errors[key], 0.95):.2g}/{100 * errors[key].max():.2g}"
            for key in errors
        ]
        where = "in view" if in_view else "beside the camera"
        rows.append(f"| {where}, {name} | {' | '.join(cells)} |")
    return "| lamp | ξ | ξ^⅓ |\n|---|---|---|\n" + "\n".join(rows)


def solved(case: _lamp_cases.Case, albedo: float) -> tuple[float, float]:
    """Light scattered once, and all of it; of a patch with what is not scattered in both."""
    water = lamp_water([1.0 - albedo], [albedo], case.function)
    lamp = case.lamp()
    if case.kind == "patch":
        patch = patch_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        parts = [float(E[0]) for E in surface_irradiance(lamp, patch, water)]
        return parts[0], sum(parts)
    ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), min(case.P, 1e6))
    once, more = (float(L[0]) for L in lamp_light(lamp, ray, water))
    return once, once + more


def traced(count: int, photons: int, keep: Path) -> NDArray[np.float64]:
    """Light of each case by batch and order, from a file if it is kept."""
    kept = keep / f"unseen_{count}_{photons}.npy"
    if not kept.exists():
        found = []
        for i, case in enumerate(_lamp_cases.unseen(count)):
            found.append(_lamp_cases.traced(case, photons, 10_000 + i))
            if i % 20 == 19:
                print(f"{i + 1} of {count} cases", flush=True)
        keep.mkdir(parents=True, exist_ok=True)
        with replacing(kept) as temporary, temporary.open("wb") as file:
            np.save(file, found)
    return np.load(kept)


def photon_errors(count: int, photons: int, keep: Path) -> list[Row]:
    """Case, albedo, value over photons of what is scattered once and of all, less 1, and noise."""
    rows = []
    for case, found in zip(_lamp_cases.unseen(count), traced(count, photons, keep), strict=True):
        for albedo in _ALBEDOS:
            value, error = summed(found, albedo)
            once, whole = solved(case, albedo)
            if case.kind == "patch":
                value += once
            if error < _NOISE * value:
                rows.append((case, albedo, once / value - 1, whole / value - 1, error / value))
    return rows


def _spread(errors: Sequence[float]) -> str:
    size = np.abs(np.asarray(errors)) * 100
    return f"{np.median(size):.0f}/{np.quantile(size, 0.95):.0f}/{size.max():.0f}"


def _transport_lengths(row: Row) -> float:
    """Distance of the lamp in units of 1/(b (1 - g))."""
    case, albedo = row[:2]
    lost = 1.0 - float(case.function.chi1[0])
    return float(np.linalg.norm(case.position)) * albedo * lost


def _table(rows: list[Row]) -> str:
    def distance(case: _lamp_cases.Case) -> float:
        return float(np.linalg.norm(case.position))

    groups: dict[str, Callable[[Row], bool]] = {
        "lamp beside the camera": lambda row: row[0].kind == "beside",
        "lamp in view": lambda row: row[0].kind == "in view",
        "lamp shining across": lambda row: row[0].kind == "across",
        "patch that faces the lamp": lambda row: row[0].kind == "patch",
        "c r below 0.5": lambda row: distance(row[0]) < 0.5,
        "c r 0.5 to 2": lambda row: 0.5 <= distance(row[0]) < 2,
        "c r 2 to 6": lambda row: distance(row[0]) >= 2,
        "transport lengths below 0.2": lambda row: _transport_lengths(row) < 0.2,
        "transport lengths above 0.2": lambda row: _transport_lengths(row) >= 0.2,
        "all": lambda _: True,
    }
    lines = []
    for name, belongs in groups.items():
        chosen = [row for row in rows if belongs(row)]
        if chosen:
            once, whole = _spread([r[2] for r in chosen]), _spread([r[3] for r in chosen])
            lines.append(f"| {name} | {len(chosen)} | {once} | {whole} |")
    return "| cases | number | once only | all of it |\n|---|---|---|---|\n" + "\n".join(lines)


def main(arguments: Sequence[str]) -> None:
    """Measure everything and write the report."""
    parser = argparse.ArgumentParser(prog="lamp_light")
    parser.add_argument("--cases", type=int, default=160)
    parser.add_argument("--photons", type=int, default=40000)
    parser.add_argument("--keep", type=Path, default=_ROOT / "out" / "lamp_light")
    options = parser.parse_args(arguments)
    rows = photon_errors(options.cases, options.photons, options.keep)
    (_ROOT / "docs" / "measured" / "lamp_light.md").write_text(
        _report(rows, options), encoding="utf-8"
    )


def _report(rows: list[Row], options: argparse.Namespace) -> str:
    quadrature, photons = _quadrature_table(), _table(rows)
    noise = float(np.median([row[4] for row in rows]))
    return f"""# The light of lamps

Written by `python3 dev.py run -m benchmarks lamp_light`.

## Scattered once
`uw_spectral.lamps.lamp_path`: the integral over the angle of the lamp by Gauss and Legendre, 12
nodes, in ξ and in its cube root, which is used: sea particles' phase function rises to ξ = 0 as a
power. Random cases, c 0.03 to 3 1/m, beside the camera and in view, against {_PANELS} panels of 12
nodes; 95 %/worst in %:

{quadrature}

## Scattered more often
What turns light by more than some seven degrees is solved by spherical harmonics
(`uw_spectral.lamps.lamp_harmonics`), the rest by the deflection after any number of scatterings
(Goudsmit and Saunderson; patches: Wells). Nothing is fitted. {options.cases} random cases,
{options.photons} photons each traced back from the camera: three kinds of lamps, 0.1/c to 6/c
away, HG 0.8 to 0.924 or particles, albedos {", ".join(map(str, _ALBEDOS))}; counted is what
photons know within {100 * _NOISE:g} % ({100 * noise:.1f} % in the median): {len(rows)} of
{options.cases * len(_ALBEDOS)}. Median/95 %/worst error in %:

{photons}

Photons know a forward-peaked phase function badly: a mean without rare ones is too low by more
than its scatter tells. Paths beside the camera end; what comes back from beyond counts for the
photons only.
"""
