"""Colour error and cost of every combination of bands and options of the water.

A few rays of the camera are coloured once with everything, and once without each thing that can be
left out; every choice of bands is coloured with everything elastic. These differences of colour are
added, ray by ray and with their signs, so that the error of a combination of options is one ΔE2000
per ray and no rule for adding up ΔE is needed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from .costs import Costs, priced
from .light_reach import clip_to_display
from .methods import REALTIME, Method
from .picture import Optics, Picture, picture
from .seen_points import SeenPoints
from .terms import SINGLE, TERMS, WAVES, Options, column_of, in_column, subsets

RAYS = 144
"""Rays of all views together that are coloured."""

_CHUNK = 48
_HARDLY, _UNSEEN = 1.02, 0.01  # factor and ΔE that are not worth a cost


@dataclass(frozen=True)
class BandChoice:
    """Some bands, known by their name, and the elastic optics on them.

    ``settings`` are what a caller does to get them; they are handed back. ``cycles_passes`` are
    what they take in Cycles: by default one for three bands.
    """

    name: str
    optics: Optics = field(compare=False)
    settings: dict[str, object] = field(compare=False)
    cycles_passes: int | None = field(default=None, compare=False)

    @property
    def count(self) -> int:
        """Number of bands."""
        return len(self.optics.view.column.bands)

    def passes(self, method: Method) -> int:
        """Passes of a frame."""
        if method.draws_colours:
            return 1
        in_threes = math.ceil(self.count / 3)
        return (self.cycles_passes or in_threes) if method.traced else in_threes


@dataclass(frozen=True)
class Workload:
    """What a picture takes besides its water.

    ``samples`` are per pixel, None leaves them to :func:`decide`; ``shaft_end`` is how far the
    renderer draws shafts, m; ``denoise`` is of pictures of Cycles.
    """

    method: Method = REALTIME
    megapixels: float = 1.0
    frames: int = 1
    samples: int | None = None
    shaft_end: float = 200.0
    denoise: bool = False


@dataclass(frozen=True, eq=False)
class Combination:
    """Bands and options with their cost."""

    bands: BandChoice
    options: Options
    cost: float


class ErrorEstimate:
    """Colours of a few rays with and without everything; arguments as for :func:`decide`.

    ``everything`` holds the terms that the scene has.
    """

    def __init__(
        self, seen: Sequence[SeenPoints], reference: Optics, choices: Sequence[BandChoice]
    ) -> None:
        if not seen or not choices:
            raise InputError("what a scene requires: give at least one view and one set of bands")
        if len(set(choices)) < len(choices):
            raise InputError("what a scene requires: give every set of bands a name of its own")
        few = [view.subsample(max(RAYS // len(seen), 1)) for view in seen]
        self.seen, self.reference, column = few, reference, reference.view.column
        self._weight = np.concatenate([view.weight for view in few]) / len(few)
        self._in_column = in_column(column)
        self._pictures: dict[Options, Picture] = {}
        self.full = self._in_full(self._in_column)
        parts = {name for name, part in self.full.parts.items() if np.abs(part).max() > 0}
        self.everything: Options = self._in_column | parts
        # Waves change what is seen of the bands too little to be baked for each of them.
        calm = self._in_column - {WAVES}
        whole = self._in_full(calm)
        if reference.clouds:
            # Bands are compared without clouds, which have numbers of their own in each.
            whole = self._picture(replace(reference, clouds=()), column_of(calm))
        lit = [view.unoccluded() for view in few]
        self._bands = {}
        for choice in choices:
            found = self._picture(choice.optics, column_of(calm), seen=lit)
            plain = whole.without(*(whole.parts.keys() - found.parts.keys()))
            self._bands[choice] = found.without() - plain
        self.choices = choices

    def _in_full(self, options: Options) -> Picture:
        """Many bands with some of the terms of the column."""
        if options not in self._pictures:
            self._pictures[options] = self._picture(self.reference, column_of(options))
        return self._pictures[options]

    def _picture(
        self,
        optics: Optics,
        column: dict[str, object],
        *,
        seen: Sequence[SeenPoints] | None = None,
        without: str = "",
    ) -> Picture:
        found = [picture(optics, view, without=without, **column) for view in seen or self.seen]
        names = dict.fromkeys(name for f in found for name in f.parts)
        parts = {
            name: np.vstack([f.parts.get(name, np.zeros_like(f.plain)) for f in found])
            for name in names
        }
        plain, single = (
            np.vstack(x) for x in zip(*((f.plain, f.single) for f in found), strict=True)
        )
        return Picture(plain, parts, single)

    def rgb(self, bands: BandChoice | None, options: Options) -> NDArray[np.float64]:
        """Colours of a combination, shape (m, 3); many bands without a choice."""
        found = self._in_full(options & self._in_column)
        rgb = found.without(*(found.parts.keys() - options))
        return rgb if bands is None else rgb + self._bands[bands]

    def errors(self, pictures: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Mean ΔE2000 of pictures against everything with many bands.

        The mean of the views, each by :attr:`.SeenPoints.weight`.
        """
        truth = clip_to_display(self.full.without())
        difference = delta_e_CIE2000_images(clip_to_display(np.array(pictures)), truth[None])
        return np.asarray(difference @ self._weight)

    def light_effect(self, name: str) -> float:
        """Mean ΔE2000 of a light that cannot be switched off by itself."""
        if name == SINGLE:
            return float(self.errors([self.full.without() - self.full.single])[0])
        return float(self.errors([self._picture(self.reference, {}, without=name).without()])[0])

    def combinations(
        self,
        workload: Workload,
        costs: Costs,
        keep: Collection[str] = (),
        off: Collection[str] = (),
    ) -> list[Combination]:
        """Every combination, the cheapest first; of equals the one with more in it.

        What costs nothing is not left out, nor is anything in Cycles: that it would save time there
        was not measured.
        """
        kept = {term.name for term in TERMS if term.is_part and term.name in keep}
        wanted = (self.everything | kept) - set(off)
        free = frozenset() if workload.method.traced else priced(wanted) - set(keep)
        found = []
        for choice, options in itertools.product(self.choices, subsets(free, wanted - free)):
            method = workload.method
            cost = costs.sample(method, choice.passes(method), options)
            found.append(Combination(choice, options, cost))
        return sorted(found, key=lambda c: (c.cost, -len(c.options)))

    def search(
        self, combinations: Sequence[Combination], target: float
    ) -> tuple[Combination, float]:
        """Return what :func:`cheapest_within` picks, and its error."""
        errors = np.empty(0)
        for chunk in itertools.batched(combinations, _CHUNK, strict=False):
            found = self.errors([self.rgb(c.bands, c.options) for c in chunk])
            errors = np.append(errors, found)
            if (found <= target).any():
                break
        index = cheapest_within(errors, target)
        return combinations[index], float(errors[index])


def cheapest_within(errors: NDArray[np.float64], target: float) -> int:
    """Index of the first error within a target; without one, of the first that is hardly worse."""
    allowed = max(target, _HARDLY * float(errors.min()) + _UNSEEN)
    return int(np.argmax(errors <= allowed))
