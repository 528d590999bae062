"""Colour error and cost of every combination of bands and options of the water.

A few rays of the camera are coloured by the closed form once with everything,
and once without each thing that can be left out; every choice of bands is
coloured with everything elastic. These differences of colour are added, ray
by ray and with their signs, for every combination of options, so that the
error of a combination is one ΔE2000 per ray and no rule for adding up ΔE is
needed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.transfer.water_column import SURFACES
from .costs import Costs, Method, Options
from .light_reach import clip_to_display
from .seen_points import (
    AUREOLE,
    DIFFUSE_SHADOWS,
    INELASTIC,
    SHAFTS,
    Optics,
    Picture,
    SeenPoints,
    picture,
)

SURFACE, FLOOR = "surface", "floor"
SWITCHES = (AUREOLE, SHAFTS, INELASTIC, DIFFUSE_SHADOWS, SURFACE, FLOOR)
"""What can be left out of the water."""

RAYS = 144
"""Rays of all views together that are coloured."""

_CHUNK = 48
_HARDLY, _UNSEEN = 1.02, 0.01  # factor and ΔE that are not worth a cost


@dataclass(frozen=True, eq=False)
class BandChoice:
    """Some bands, by name, and the elastic optics on them.

    ``settings`` are what a caller does to get them; they are handed back.
    """

    name: str
    optics: Optics
    settings: dict[str, object]

    @property
    def count(self) -> int:
        """Number of bands."""
        return len(self.optics.view.column.bands)


@dataclass(frozen=True)
class Workload:
    """What a picture takes besides its water.

    Parameters
    ----------
    method : {"realtime", "bands", "cycles"}
    bands_per_pass : int
        Of band passes.
    megapixels : float
        Of a frame.
    frames : int
    samples : int, optional
        Per pixel; None leaves them to :func:`decide`.
    shaft_end : float
        How far the renderer draws shafts, m.
    """

    method: Method = "realtime"
    bands_per_pass: int = 3
    megapixels: float = 1.0
    frames: int = 1
    samples: int | None = None
    shaft_end: float = 200.0


@dataclass(frozen=True, eq=False)
class Combination:
    """Bands and options with their cost."""

    bands: BandChoice
    options: Options
    floor: bool
    cost: float


class ErrorEstimate:
    """Colours of a few rays with and without everything; arguments as for :func:`decide`."""

    def __init__(
        self,
        seen: Sequence[SeenPoints],
        reference: Optics,
        choices: Sequence[BandChoice],
        rays: int = RAYS,
    ) -> None:
        if not seen or not choices:
            raise InputError("what a scene requires: give at least one view and one set of bands")
        few = [view.subsample(max(rays // len(seen), 1)) for view in seen]
        self.seen, self.reference, column = few, reference, reference.view.column
        self._weight = np.concatenate([view.weight for view in few]) / len(few)
        level = SURFACES.index(column.surface)
        self.surfaces = SURFACES[level::-1]
        self.floors = (True, False) if math.isfinite(column.floor_depth) else (True,)
        self._pictures = {
            (surface, floor): self._picture(reference, surface=surface, floor=floor)
            for surface in self.surfaces
            for floor in self.floors
        }
        self.full = self._pictures[column.surface, True]
        self.has = {name for name in self.full.parts if np.abs(self.full.parts[name]).max() > 0}
        # Waves change what is seen of the bands too little to be baked for each of them.
        calm = "flat" if column.surface == "waves" else column.surface
        plain = self._pictures[calm, True].without(INELASTIC, SHAFTS, DIFFUSE_SHADOWS)
        lit = [
            replace(
                view,
                path_sunlit=np.ones((len(view), 1), dtype=bool),
                openness=np.ones(len(view)),
            )
            for view in few
        ]
        self._bands = {
            id(choice): self._picture(choice.optics, lit, surface=calm).without(INELASTIC) - plain
            for choice in choices
        }
        self.choices = choices

    def _picture(
        self, optics: Optics, seen: Sequence[SeenPoints] | None = None, **how: object
    ) -> Picture:
        found = [picture(optics, view, **how) for view in seen or self.seen]
        names = set().union(*(f.parts for f in found))
        parts = {
            name: np.vstack([f.parts.get(name, np.zeros_like(f.plain)) for f in found])
            for name in names
        }
        return Picture(np.vstack([f.plain for f in found]), parts)

    def rgb(
        self, bands: BandChoice | None, options: Options, *, floor: bool = True
    ) -> NDArray[np.float64]:
        """Colours of a combination, shape (m, 3); many bands without a choice."""
        parts = (AUREOLE, SHAFTS, INELASTIC, DIFFUSE_SHADOWS)
        off = [name for name in parts if not getattr(options, name)]
        rgb = self._pictures[options.surface, floor].without(*off)
        return rgb if bands is None else rgb + self._bands[id(bands)]

    def errors(self, pictures: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Mean ΔE2000 of pictures against everything with many bands.

        The mean of the views, each with objects, floor and open water counting
        equally: :attr:`.SeenPoints.weight`.
        """
        truth = clip_to_display(self.full.without())
        difference = delta_e_CIE2000_images(clip_to_display(np.array(pictures)), truth[None])
        return np.asarray(difference @ self._weight)

    def everything(self) -> Options:
        """Options with all that the scene has."""
        inelastic, shafts, diffuse_shadows = (
            name in self.has for name in (INELASTIC, SHAFTS, DIFFUSE_SHADOWS)
        )
        return Options(True, self.surfaces[0], inelastic, shafts, diffuse_shadows)

    def light_effect(self, name: str) -> float:
        """Mean ΔE2000 of a light that cannot be switched off by itself."""
        return float(self.errors([self._picture(self.reference, without=name).without()])[0])

    def combinations(
        self,
        workload: Workload,
        costs: Costs,
        keep: Collection[str] = (),
        off: Collection[str] = (),
    ) -> list[Combination]:
        """Every combination, the cheapest first; of equals the one with more in it.

        What is named in ``keep`` stays on, in ``off`` off. Cycles leaves
        nothing out: that it would save time was not measured.
        """
        everything = self.everything()
        fixed = set(SWITCHES if workload.method == "cycles" else keep)
        surfaces = self.surfaces[:1] if SURFACE in fixed else self.surfaces
        aureoles, inelastics, shafts, diffuse_shadows = (
            (False,) if name in off else (True, False) if on and name not in fixed else (on,)
            for name, on in (
                (AUREOLE, everything.aureole),
                (INELASTIC, everything.inelastic),
                (SHAFTS, everything.shafts or SHAFTS in keep),
                (DIFFUSE_SHADOWS, everything.diffuse_shadows or DIFFUSE_SHADOWS in keep),
            )
        )
        floors = (True,) if FLOOR in fixed else self.floors
        found = []
        for choice, *switches, floor in itertools.product(
            self.choices, aureoles, surfaces, inelastics, shafts, diffuse_shadows, floors
        ):
            options = Options(*switches)
            cost = costs.sample(workload.method, choice.count, workload.bands_per_pass, options)
            found.append(Combination(choice, options, floor, cost))
        return sorted(found, key=lambda c: (c.cost, -_content(c)))

    def search(
        self, combinations: Sequence[Combination], target: float
    ) -> tuple[Combination, float]:
        """Return what :func:`cheapest_within` picks, and its error."""
        errors = np.empty(0)
        for chunk in _chunks(combinations):
            found = self.errors([self.rgb(c.bands, c.options, floor=c.floor) for c in chunk])
            errors = np.append(errors, found)
            if (found <= target).any():
                break
        index = cheapest_within(errors, target)
        return combinations[index], float(errors[index])


def cheapest_within(errors: NDArray[np.float64], target: float) -> int:
    """Index of the first error within a target; without one, of the first that is hardly worse.

    Examples
    --------
    >>> errors = np.array([3.0, 1.0, 2.0, 0.99])
    >>> cheapest_within(errors, 2.5), cheapest_within(errors, 0.5)
    (1, 1)
    """
    allowed = max(target, _HARDLY * float(errors.min()) + _UNSEEN)
    return int(np.argmax(errors <= allowed))


def _content(combination: Combination) -> int:
    o = combination.options
    terms = o.aureole + o.shafts + o.inelastic + o.diffuse_shadows
    return combination.floor + terms + SURFACES.index(o.surface)


def _chunks(combinations: Sequence[Combination]) -> Iterator[Sequence[Combination]]:
    for first in range(0, len(combinations), _CHUNK):
        yield combinations[first : first + _CHUNK]
