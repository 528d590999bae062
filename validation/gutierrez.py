"""Forms of Gutierrez et al. 2008 as printed, errors included: baselines to compare with.

D. Gutierrez, F. J. Serón, A. Muñoz & O. Anson, Visualizing Underwater Ocean Optics, Computer
Graphics Forum 27(2), 547 (2008).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.spectra.spectrum import Spectrum
from ..uw_spectral.water.bio_optics import Constituents
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase_functions import henyey_greenstein
from ..uw_spectral.water.pure_water import molecular_scattering, pure_water_absorption

_WAVELENGTHS = np.arange(300.0, 800.1, 2.5)


def particle_scattering_Gordon1983(
    chlorophyll: float, wavelengths: ArrayLike
) -> NDArray[np.float64]:
    """Scattering of particles, 0.30 C^0.62 (550/λ), 1/m, as Gutierrez et al. (2008) print it.

    H. R. Gordon & A. Morel, Lecture Notes 4, Springer (1983); the factor ranges from 0.12 to
    0.45 in nature.
    """
    nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    return 0.30 * chlorophyll**0.62 * 550.0 / nm


def water_Gutierrez2008(constituents: Constituents) -> Water:
    """Return the water as the paper's equations print it, errors included.

    Smith & Baker's a_w for its Table 1; b_w taken for β_w(90°), thus 16.06
    times too high. The printed a*(λ) of one phytoplankton species is
    replaced by Bricaud et al. (1998), its detritus scattering left out.
    """
    nm = _WAVELENGTHS
    parts = constituents.absorptions(nm)
    parts["water"] = pure_water_absorption(nm, "smith_baker_1981")
    b = 16.06 * molecular_scattering(nm, "smith_baker_1981_sea")
    b = b + particle_scattering_Gordon1983(constituents.chlorophyll, nm)
    name = f"{constituents.described()} as printed in Gutierrez et al. 2008"
    return Water(
        Spectrum(nm, np.sum(list(parts.values()), axis=0), f"a of {name}"),
        Spectrum(nm, b, f"b of {name}"),
        None,
        name,
        "Gutierrez et al., Comput. Graph. Forum 27, 547 (2008)",
        ("printed form, for comparison only: scattering of water is 16 times too high",),
    )


def raman_coefficient_Gutierrez2008(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Raman coefficient as the paper has it, the absorption of water: far too strong.

    For comparison only; 300 to 800 nm.
    """
    return pure_water_absorption(wavelengths)


def isotropic_Gutierrez2008(s2: Operand, m: Mathematics = NUMPY) -> Operand:
    """Isotropic phase function as printed, 1/π; it integrates to 4."""
    del m
    return 0.0 * s2 + 1.0 / math.pi


def henyey_greenstein_Gutierrez2008(g: Operand, s2: Operand, m: Mathematics = NUMPY) -> Operand:
    """Henyey-Greenstein as printed, without 1/(4π); it integrates to 4π."""
    return 4.0 * math.pi * henyey_greenstein(g, s2, m)
