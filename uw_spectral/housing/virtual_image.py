"""Where a port makes objects seem to lie, for focus: the paraxial image."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .housing import Housing
from .port import DomePort, FlatPort, NoPort

Array = NDArray[np.float64]


def focus_distance(housing: Housing, distance: ArrayLike, wavelength: ArrayLike) -> Array:
    """Distance from the pupil on which to focus, for an object on the axis of the port.

    Gauss's equation at each face, n'/s' = n/s + (n' - n)/R, which is n'/s' = n/s if it is flat.
    It holds along the axis of the port; for a dome, whose pupil lies beside the optical axis, along
    the line through its centre that is parallel to that.

    Distances from the pupil, m; infinite for an object at infinity behind a flat port.

    E. Hecht, Optics, 5.2. For far objects a thin dome of radius R images at R / (n - 1) before its
    face, some three radii.
    """
    port = housing.port
    if isinstance(port, NoPort):
        return np.asarray(distance, dtype=np.float64) * np.ones_like(np.asarray(wavelength, float))
    if isinstance(port, FlatPort):
        faces, pupil = (np.inf, np.inf), port.distance
    elif isinstance(port, DomePort):
        faces, pupil = (port.radius, port.inner_radius), port.inner_radius - port.pupil[2]
    else:
        raise TypeError(f"no paraxial image behind {type(port).__name__}")
    thickness = port.thickness
    glass = port.glass.refractive_index(wavelength)
    water = housing.water.refractive_index(wavelength)
    # Lengths count outwards, so that 1/s is positive before a face whose centre lies behind it.
    to_outer = np.asarray(distance, dtype=np.float64) - pupil - thickness
    with np.errstate(divide="ignore"):
        outer = water / to_outer + (water - glass) / faces[0]
        seen_in_glass = glass / outer
        inner = glass / (seen_in_glass + thickness) + (glass - 1.0) / faces[1]
        return pupil + 1.0 / inner


def defocus_factor(housing: Housing, distance: float, wavelength: float) -> float:
    """How much larger discs of defocus are than without a port, by the aperture alone.

    An object is blurred by the difference of the inverse distances of its image and of the focus,
    and the port changes these; close to the index of water for any port.

    ``distance`` is that of the focus from the pupil, m, in water.
    """
    ends = np.array([distance, 2.0 * distance])
    near, far = 1.0 / focus_distance(housing, ends, wavelength)
    return float((near - far) / (1.0 / ends[0] - 1.0 / ends[1]))
