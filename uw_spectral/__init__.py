"""Optics of water: spectra, bands, phase functions, light field, sensors.

Pure numpy; never imports Blender. Modules load on demand, so importing the
package costs nothing.
"""
