"""What a camera sees along a few of its rays: places, normals, colours and shadows."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.occlusion.point_spread import blocked_along
from ..uw_spectral.occlusion.visibility_buffer import VisibilityBuffer
from ..uw_spectral.water.phase import PhaseFunction

_WHOLE = 0.01  # fraction of a picture from which on something counts as much as what fills it
_SEED = 1


@dataclass(frozen=True, eq=False)
class SeenPoints:
    """What a camera sees at one moment along m rays; x, y horizontal, z up, z = 0 the surface.

    Raises InputError if the camera is not under water, there is no ray, or shapes differ.
    """

    origin: NDArray[np.float64]  #: Shape (m, 3): Where the rays leave the camera, m.
    direction: NDArray[np.float64]  #: Shape (m, 3): Unit view directions, away from the camera.
    #: Shape (m,): To what the ray meets, m; infinite for open water and the surface.
    distance: NDArray[np.float64]
    normal: NDArray[np.float64]  #: Shape (m, 3): Unit normal there, towards the camera.
    colour: NDArray[np.float64]  #: Shape (m, 3): Base colour there, linear Rec.709.
    sunlit: NDArray[np.bool_]  #: Shape (m,): Whether nothing stands between the point and the sun.
    #: Shape (m, k): The same in the middle of k equal steps along the ray.
    path_sunlit: NDArray[np.bool_]
    reach: float  #: Distance up to which those steps go, at most up to the point, m.
    #: Shape (m,): Whether the point lies on the floor of the water column.
    on_floor: NDArray[np.bool_]
    #: Shape (m,): Fraction of the light from above, the direct sun apart, that nothing keeps from
    #: the point: see :func:`openness`. 1 for open water.
    openness: NDArray[np.float64]
    #: Shape (m,): The same of the light that the water along the ray scatters; may be more than 1
    #: before bright objects.
    path_openness: NDArray[np.float64]
    #: Shape (m,): Fraction of the picture that each ray stands for; they add up to 1.
    pixels: NDArray[np.float64]
    #: What objects fill of the view, where they keep light from it that is scattered forward.
    buffer: VisibilityBuffer | None = None

    def __post_init__(self) -> None:
        count = len(self.direction)
        if not count:
            raise InputError("seen points: there is no ray; give at least one")
        if not self.depth > 0:
            raise InputError(
                f"seen points: the camera is {-self.depth:g} m above the water; the surface is "
                "z = 0, move the camera below it"
            )
        for name in self._per_ray():
            if len(getattr(self, name)) != count:
                raise InputError(
                    f"seen points: {name} has {len(getattr(self, name))} rows for {count} rays"
                )

    def __len__(self) -> int:
        return len(self.direction)

    @property
    def depth(self) -> float:
        """Mean depth of the camera's rays, m."""
        return -float(self.origin[:, 2].mean())

    @property
    def reached(self) -> NDArray[np.float64]:
        """How far each ray was looked at for shadows, m."""
        return np.minimum(self.distance, self.reach)

    @property
    def is_free(self) -> bool:
        """Whether nothing keeps light from what is seen, the direct sun's apart."""
        left = np.concatenate([self.openness, self.path_openness])
        return self.buffer is None and bool((left == 1.0).all())

    def blocked(
        self, components: Sequence[PhaseFunction], parts: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Fraction of scattering on the rays that stays within objects: :func:`.blocked_along`."""
        if self.buffer is None:
            return None
        return blocked_along(self.buffer, components, parts, self.direction, self.on_floor)

    def unoccluded(self) -> SeenPoints:
        """Return the same with nothing in the way of any light."""
        whole, sunlit = np.ones(len(self)), np.ones((len(self), 1), bool)
        return dataclasses.replace(
            self, path_sunlit=sunlit, openness=whole, path_openness=whole, buffer=None
        )

    @property
    def occluded_path(self) -> float:
        """Fraction of the paths that lies in shadow, mean over the picture."""
        return float(self.pixels @ (1.0 - self.path_sunlit.mean(axis=1)))

    @property
    def kind(self) -> NDArray[np.int64]:
        """What each ray meets: 0 open water or the surface, 1 the column's floor, 2 an object."""
        return np.where(self.on_floor, 1, np.where(np.isfinite(self.distance), 2, 0))

    @property
    def weight(self) -> NDArray[np.float64]:
        """Weights of the rays in the mean ΔE2000 of a picture, shape (m,); they add up to 1.

        Objects, floor and open water with the surface count equally, each by the mean over its
        pixels: a picture's subject may be small. What fills less than 1 % of the picture counts in
        proportion, so that no single ray decides.
        """
        weight = np.zeros(len(self))
        for of in self._kinds():
            fraction = self.pixels[of].sum()
            weight[of] = min(fraction / _WHOLE, 1.0) * self.pixels[of] / fraction
        return weight / weight.sum()

    def subsample(self, count: int) -> SeenPoints:
        """Return about so many of the rays, spread over the picture and what they meet.

        Each kind gets as many, or all it has; :attr:`pixels` keeps its fraction of the picture.
        """
        if count >= len(self):
            return self
        random = np.random.default_rng(_SEED)
        left, chosen, pixels = count, [], np.zeros(len(self))
        kinds = sorted(self._kinds(), key=len)
        for index, of in enumerate(kinds):
            take = min(len(of), max(left // (len(kinds) - index), 1))
            left -= take
            # One of each stretch, at random: even steps could all fall into one column.
            edges = np.linspace(0, len(of), take + 1)
            which = of[(edges[:-1] + random.random(take) * np.diff(edges)).astype(int)]
            pixels[which] = self.pixels[of].sum() / take
            chosen.append(which)
        rows = np.sort(np.concatenate(chosen))
        values = {name: getattr(self, name)[rows] for name in self._per_ray()}
        return dataclasses.replace(self, **values | {"pixels": pixels[rows]})

    def _kinds(self) -> list[NDArray[np.int64]]:
        """Indices of the rays of each kind that is there."""
        kind = self.kind
        return [np.flatnonzero(kind == which) for which in np.unique(kind)]

    def _per_ray(self) -> list[str]:
        return [f.name for f in dataclasses.fields(self) if f.name not in {"reach", "buffer"}]


def openness(
    normal: NDArray[np.float64], directions: NDArray[np.float64], clear: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Fraction of the light from above that reaches surfaces, by the cosine, shape (m,).

    It is 1 where none of the light meets the surface at all. ``normal``, shape (m, 3), are unit
    normals, ``directions``, shape (k, 3), those of :func:`.light_from_above`; ``clear``, shape (m,
    k), is whether nothing stands between a surface and the water's surface.
    """
    cosine = np.maximum(normal @ directions.T, 0.0)
    total = cosine.sum(axis=1)
    return np.where(total > 0, (cosine * clear).sum(axis=1) / np.where(total > 0, total, 1.0), 1.0)
