"""Radiative transfer: the light in the water, and what a pixel sees of it."""

from .water_column import DeeperWater, WaterColumn

__all__ = ["DeeperWater", "WaterColumn"]
