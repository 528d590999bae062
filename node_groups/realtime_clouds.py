"""Node group of what clouds before a pixel do to it; formulas of uw_spectral/clouds."""

from __future__ import annotations

import functools
from collections.abc import Callable

from ..uw_spectral.clouds.cloud_light import Clouds
from ..uw_spectral.clouds.cloud_numbers import Veil
from ..uw_spectral.clouds.cloud_shadow import daylit_fractions
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.transfer.sun_beam import half_angle2
from .chance import chance
from .cloud_table import NAME
from .group_sockets import FLOAT, VECTOR, OpenGroup
from .loops import followed, summed
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel
from .realtime_rays import camera_place, place_here, view_direction, view_distance
from .realtime_values import FLOOR_DEPTH, FRAME, SUN, Values
from .realtime_water import in_group, options

UNSCATTERED, PASSED, LIGHT, MIDDLE, FORWARD = (
    "Unscattered", "Passed", "Light", "Middle", "Forward",
)  # fmt: skip
SUNLIT, DAYLIT, _RATE = "Sunlit", "Daylit", "Rate"
SUNLIGHT, SKYLIGHT = "Sunlight", "Skylight"
_OUTPUTS = (UNSCATTERED, PASSED, LIGHT, MIDDLE, FORWARD, SUNLIT, DAYLIT)


def clouds_before(pixel: Pixel, clouds_of: Callable[[Graph], Clouds]) -> dict[str, NodeValue]:
    """Put the group of clouds before an object, or up to the boundary, into a pixel's tree.

    Before an object there are :data:`SUNLIGHT` and :data:`SKYLIGHT`: fractions of the sun's and of
    other light that clouds leave on it.
    """
    ahead, shape, sources = pixel.given is None, pixel.shape, pixel.sources
    names = _OUTPUTS if ahead else (*_OUTPUTS, SUNLIGHT, SKYLIGHT)
    outputs: dict[str, str] = dict.fromkeys(names, VECTOR)
    outputs[MIDDLE] = FLOAT
    group = OpenGroup(NAME, {_RATE: FLOAT}, outputs, **options(shape, sources))
    graph = group.graph
    found = Values(graph, sources.values, shape)
    clouds, w = clouds_of(graph), view_direction(graph)
    if ahead:
        origin = camera_place(graph, found.of(*FRAME))
        y_o = NODES.maximum(-origin[2], 0.0)
        P = distance_in_water(y_o, -w[2], found[FLOOR_DEPTH], NODES)
    else:
        P = view_distance(graph)
        origin = [x - along * P for x, along in zip(place_here(graph), w, strict=True)]

    def add_up(count: int, terms: object) -> tuple[NodeValue, ...]:
        return summed(graph, count, terms)  # pyright: ignore[reportArgumentType]

    follow = functools.partial(followed, graph)
    rate, drawn = group.given[_RATE], chance(graph, w)[0]
    daylit = daylit_fractions(clouds, origin, w, P, rate, drawn, add_up)
    veil = clouds.veil(origin, w, P, half_angle2(w, found.of(*SUN), NODES), add_up, follow)
    results: dict[str, Operand] = {
        UNSCATTERED: veil.unscattered,
        PASSED: veil.passed,
        LIGHT: veil.light,
        MIDDLE: veil.middle,
        FORWARD: veil.forward,
        SUNLIT: daylit[0],
        DAYLIT: daylit[1],
    }
    if not ahead:
        results[SUNLIGHT] = clouds.sunlight_transmittance(place_here(graph))
        results[SKYLIGHT] = clouds.skylight_transmittance(place_here(graph))
    return in_group(pixel.graph, group.finished(results), {_RATE: pixel.rates[1]})


def veil_of(found: dict[str, NodeValue]) -> Veil:
    """Return the veil that the outputs of the group tell."""
    return Veil(*(found[name] for name in _OUTPUTS))
