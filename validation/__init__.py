"""Proofs that the extension never loads: photons one by one, and printed forms with their errors.

Photons are traced by numba, which Blender does not have.
"""
