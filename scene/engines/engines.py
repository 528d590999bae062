"""The engines that can render a frame: each puts water into a scene and takes it out."""

from __future__ import annotations

from ...quality.methods import method_of
from . import cycles_engine, eevee_engine
from .band_engine import BandEngine, Engine, RenderPass
from .cycles_engine import cycles_bands
from .eevee_engine import eevee_bands, eevee_realtime

__all__ = [
    "ENGINES", "BandEngine", "Engine", "RenderPass",
    "cycles_bands", "eevee_bands", "eevee_realtime", "engine_of",
]  # fmt: skip

ENGINES = (cycles_engine.BANDS, eevee_engine.BANDS, eevee_engine.REALTIME)


def engine_of(name: str, mode: str) -> Engine:
    """Return the engine of a name and a mode."""
    method = method_of(name, mode)
    return next(engine for engine in ENGINES if engine.method is method)
