"""Plans that share what they have in common, so that a small change of settings costs little.

The development of a picture is fitted to the sensor, the bands and the light.
Plans made here hold the same objects for these, by which
:class:`~..uw_spectral.readouts.Viewpoint` knows that the fit can be kept.
"""

from __future__ import annotations

import contextlib
import functools
import warnings
from collections.abc import Iterator
from dataclasses import replace

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.spectra.sensor import Sensor, parse_sensor
from .render_plan import RenderPlan, make_plan
from .settings import SceneSettings

_DEFAULT = SceneSettings()


def plan_of(chosen: SceneSettings) -> RenderPlan:
    """Resolve settings as :func:`make_plan` does, without repeating caveats of the data.

    Raises
    ------
    InputError
        If a name is unknown or a file cannot be used.
    """
    with quiet():
        sensor = _sensor(chosen.sensor)
        optics = _optics(replace(chosen, sensor=_DEFAULT.sensor))
    return replace(optics, settings=chosen, sensor=sensor)


def clear() -> None:
    """Forget all plans, so that files are read again."""
    _optics.cache_clear()
    _sensor.cache_clear()
    _objects.cache_clear()


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep caveats of the data to the records of renders."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        yield


@functools.lru_cache(maxsize=32)
def _optics(chosen: SceneSettings) -> RenderPlan:
    plan = make_plan(chosen)
    bands, light = plan.bands, plan.illuminant
    bands = _first(bands, bands.centres.tobytes(), bands.widths.tobytes())
    light = _first(light, light.name, light.direct.values.tobytes(), light.diffuse.values.tobytes())
    return replace(plan, bands=bands, illuminant=light, column=replace(plan.column, bands=bands))


def _first[T](value: T, *content: object) -> T:
    """Return the object that first had a content."""
    known = _objects(content)
    if not known:
        known.append(value)
    return known[0]


@functools.lru_cache(maxsize=16)
def _objects(_: tuple[object, ...]) -> list:
    return []


@functools.lru_cache(maxsize=8)
def _sensor(text: str) -> Sensor:
    return parse_sensor(text)
