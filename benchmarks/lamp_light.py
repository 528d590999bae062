"""How far the light of lamps is right: scattered once against the integral, more by photons."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps import lamp_path
from ..uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from ..uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from ..uw_spectral.lamps.multiple_scattering import lamp_light, lamp_water
from ..uw_spectral.lamps.profile import IsotropicProfile
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import HenyeyGreenstein, parse_phase, seawater_mixture
from ..validation import lamp_cases
from ..validation.lamp_photons import summed
from .runner import Ask, Page, spread, table

_ALBEDOS = (0.3, 0.5, 0.7, 0.8, 0.9, 0.95)
_NOISE = 0.12
_PANELS = 400
type Row = tuple[lamp_cases.Case, float, float, float, float]
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
    return float(lamp_path.single_scattering(lamp, ray, one, c * one, phase, nodes=nodes)[0])


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


def solved(case: lamp_cases.Case, albedo: float) -> tuple[float, float]:
    """Light scattered once, and all of it; of a patch with what is not scattered in both."""
    water = lamp_water([1.0 - albedo], [albedo], case.function)
    lamp = case.lamp()
    if case.kind == "patch":
        patch = patch_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        parts = [float(E[0]) for E in surface_irradiance(lamp, patch, water)]
        return parts[0], sum(parts)
    ray = ray_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), min(case.P, 1e6))
    single, more = (float(L[0]) for L in lamp_light(lamp, ray, water))
    return single, single + more


def photon_errors(count: int, traced: NDArray[np.float64]) -> list[Row]:
    """Case, albedo, value over photons of what is scattered once and of all, less 1, and noise."""
    rows = []
    for case, found in zip(lamp_cases.unseen(count), traced, strict=True):
        for albedo in _ALBEDOS:
            value, error = summed(found, albedo)
            single, whole = solved(case, albedo)
            if case.kind == "patch":
                value += single
            if error < _NOISE * value:
                rows.append((case, albedo, single / value - 1, whole / value - 1, error / value))
    return rows


def _transport_lengths(row: Row) -> float:
    """Distance of the lamp in units of 1/(b (1 - g))."""
    case, albedo = row[:2]
    lost = 1.0 - float(case.function.chi1[0])
    return float(np.linalg.norm(case.position)) * albedo * lost


def _distance(row: Row) -> float:
    return float(np.linalg.norm(row[0].position))


_GROUPS: dict[str, Callable[[Row], bool]] = {
    "lamp beside the camera": lambda row: row[0].kind == "beside",
    "lamp in view": lambda row: row[0].kind == "in view",
    "lamp shining across": lambda row: row[0].kind == "across",
    "patch that faces the lamp": lambda row: row[0].kind == "patch",
    "c r below 0.5": lambda row: _distance(row) < 0.5,
    "c r 0.5 to 2": lambda row: 0.5 <= _distance(row) < 2,
    "c r 2 to 6": lambda row: _distance(row) >= 2,
    "transport lengths below 0.2": lambda row: _transport_lengths(row) < 0.2,
    "transport lengths above 0.2": lambda row: _transport_lengths(row) >= 0.2,
    "all": lambda _: True,
}


def measure(ask: Ask) -> Mapping[str, object]:
    """Integrate and trace the cases."""
    single = []
    for in_view, (name, phase) in itertools.product((False, True), _PHASES.items()):
        errors = quadrature_errors(in_view, phase)
        where = "in view" if in_view else "beside the camera"
        cells = (spread(100 * x, ".2g", (0.95, 1.0)) for x in errors.values())
        single.append([f"{where}, {name}", *cells])

    def traced() -> list[NDArray[np.float64]]:
        cases = enumerate(lamp_cases.unseen(ask.cases))
        return [lamp_cases.traced(case, ask.photons, 10_000 + i) for i, case in cases]

    rows, more = photon_errors(ask.cases, ask.kept("photons", traced)), []
    for name, belongs in _GROUPS.items():
        chosen = np.abs([row[2:4] for row in rows if belongs(row)]) * 100
        if len(chosen):
            more.append([name, len(chosen), *(spread(x, ".0f") for x in chosen.T)])
    return {
        "once": table(("lamp", "ξ", "ξ^⅓"), single),
        "noise": 100 * float(np.median([row[4] for row in rows])),
        "counted": f"{len(rows)} of {ask.cases * len(_ALBEDOS)}",
        "more": table(("cases", "number", "once only", "all of it"), more),
    }


PAGE = Page(
    "The light of lamps",
    """
## Scattered once
`uw_spectral.lamps.lamp_path`: the integral over the angle of the lamp by Gauss and Legendre, 12
nodes, in ξ and in its cube root, which is used: sea particles' phase function rises to ξ = 0 as a
power. Random cases, c 0.03 to 3 1/m, beside the camera and in view, against 400 panels of 12 nodes;
95 %/worst in %:

{once}

## Scattered more often
What turns light by more than some seven degrees is solved by spherical harmonics
(`uw_spectral.lamps.lamp_harmonics`), the rest by the deflection after any number of scatterings
(Goudsmit and Saunderson; patches: Wells). Nothing is fitted. {cases} random cases, {photons}
photons each traced back from the camera: three kinds of lamps, 0.1/c to 6/c away, HG 0.8 to 0.924
or particles, albedos 0.3, 0.5, 0.7, 0.8, 0.9, 0.95; counted is what photons know within 12 %
({noise:.1f} % in the median): {counted}. Median/95 %/worst error in %:

{more}

Photons know a forward-peaked phase function badly: a mean without rare ones is too low by more than
its scatter tells. Paths beside the camera end; what comes back from beyond counts for the photons
only.
""",
    settings={"cases": 60, "photons": 40_000},
)
