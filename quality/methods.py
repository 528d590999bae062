"""The ways to render, and what follows from each: facts that nobody asks an engine's name for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Engine = Literal["cycles", "eevee"]
Mode = Literal["bands", "realtime"]
Device = Literal["cpu", "gpu"]


@dataclass(frozen=True)
class Method:
    """A way to render.

    ``name`` is as panels and qualities know it, ``engine`` and ``mode`` as options name them,
    ``label`` and ``text`` what a panel says of it. ``default_bands`` are for settings that leave
    their number open. A method that ``draws_colours`` draws the picture, all bands in one pass;
    others draw bands, which are developed. Where light is ``traced``, noise and bounces are what
    cost, objects cast their own occlusion, and nothing of the water is left out.
    """

    name: str
    engine: Engine
    mode: Mode
    label: str
    text: str
    default_bands: int = 8
    draws_colours: bool = False
    traced: bool = False


REALTIME = Method(
    "realtime", "eevee", "realtime", "Real-time",
    "EEVEE, all bands in one pass: animation, look development",
    # They cost a pixel nothing; more change a picture by a mean ΔE2000 below 0.1.
    default_bands=40, draws_colours=True,
)  # fmt: skip
BANDS = Method(
    "bands", "eevee", "bands", "Bands",
    "EEVEE, three bands a pass: spectra, and the camera can be changed after rendering",
)  # fmt: skip
REFERENCE = Method(
    "reference", "cycles", "bands", "Reference",
    "Cycles, light scattered any number of times: the truth to compare with, slow",
    traced=True,
)  # fmt: skip

METHODS = {method.name: method for method in (REALTIME, BANDS, REFERENCE)}
DRAWN = (REALTIME, BANDS)
"""Those of EEVEE."""


def method_of(engine: str, mode: str) -> Method:
    """Return the method of an engine's mode; raise KeyError if there is none."""
    for method in METHODS.values():
        if (method.engine, method.mode) == (engine, mode):
            return method
    raise KeyError(f"{engine} has no mode {mode!r}")


@dataclass(frozen=True)
class Quality:
    """How a quality is rendered, one of :data:`METHODS`, and the mean ΔE2000 that Auto aims at."""

    method: str
    target: float


QUALITIES = {
    "draft": Quality("realtime", 4.0),
    "preview": Quality("realtime", 2.0),
    "final": Quality("bands", 1.0),
    "reference": Quality("reference", 0.5),
}
