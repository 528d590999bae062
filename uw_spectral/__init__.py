"""Optics of water: pure numpy, never imports Blender; works in a notebook by itself.

``spectra`` (bands, light, sensors, colour) · ``water`` (absorption, scattering, phase
functions) · ``surface`` (refraction, waves, caustics) · ``transfer`` (light in the water,
what a pixel sees) · ``imaging`` (a camera in the water, read-outs). Each loads on demand.
"""
