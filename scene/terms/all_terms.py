"""The list of the terms of light, in the order in which they are read and drawn."""

from __future__ import annotations

from ..water.term import Term
from .clouds import CloudTerm
from .fluorescence import FluorescenceTerm
from .hair import HairTerm
from .inelastic_layers import InelasticTerm
from .lamps import LampTerm
from .occlusion import OcclusionTerm
from .particles import ParticleTerm
from .port import PortTerm
from .sky import SkyTerm
from .view_from_air import AirTerm
from .waves import WaveTerm

TERMS: tuple[type[Term], ...] = (
    FluorescenceTerm, OcclusionTerm, HairTerm, AirTerm, PortTerm, LampTerm, CloudTerm, WaveTerm,
    ParticleTerm, InelasticTerm, SkyTerm,
)  # fmt: skip
