"""The papers' way: analytic multiple scattering, short enough for shader nodes.

Nothing outside asks it but its node group, its engine and what is compared with it; the light
of the water is the solved field of :mod:`..transfer`.
"""

from .one_lobe import plain_water

__all__ = ["plain_water"]
