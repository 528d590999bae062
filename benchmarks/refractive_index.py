"""What one index for all wavelengths leaves out."""

from __future__ import annotations

from collections.abc import Mapping

from ..uw_spectral.surface.refraction import REFRACTIVE_INDEX, refractive_index_QuanFry1995
from ..validation.one_index import NM, SUNS, WATERS, light, row
from .runner import Ask, Page, table


def measure(_: Ask) -> Mapping[str, object]:
    """Compute both tables."""
    rows = [row(float(index)) for index in refractive_index_QuanFry1995(NM)]
    constant = row(REFRACTIVE_INDEX)
    cells = [
        [name, f"{r.index:.4f}", *(f"{100 * T:.2f} %" for T in r.transmittance.values()),
         f"{r.refracted:.2f}°", f"{r.window:.2f}°", f"{r.internal:.4f}"]
        for name, r in zip([*(f"{nm:g} nm" for nm in NM[::3]), "all, as drawn"],
                           [*rows[::3], constant], strict=True)
    ]  # fmt: skip
    lit = [
        [f"{name}, {zenith:g}°", *(f"{100 * (x.min() - 1):+.2f}…{100 * (x.max() - 1):+.2f} %"
                                   for x in light(name, zenith).values())]
        for name in WATERS
        for zenith in SUNS
    ]  # fmt: skip
    heads = ["", "n", *(f"T {z:g}°" for z in constant.transmittance), "refracted", "window", "back"]
    return {
        "indices": table(heads, cells), "light": table(("water, sun", "Ed", "Eu", "Kd"), lit),
        "rim": rows[-1].window - rows[0].window, "window": 2 * constant.window,
        "lower": rows[-1].refracted - rows[0].refracted,
    }  # fmt: skip


PAGE = Page(
    "One refractive index for all wavelengths",
    """
Index of seawater by Quan & Fry (1995), 35 g/kg, 20 °C: transmittance for the sun at 0, 30, 60, 80°,
angle of the refracted sun at 60°, half angle of Snell's window, fraction of uniform light that the
surface sends back down. From 0 to 30 °C the index changes by 0.003, from fresh water to the sea by
0.0065.

{indices}

Light at 5 m and Kd with the index of each wavelength against 1.34 for all, range of 400 to 700 nm,
clear sky:

{light}

**Verdict.** Brightness, colour and Kd change by less than a percent. What one index leaves out is a
rim: the edge of Snell's window lies {rim:.2f}° further out at 700 than at 400 nm, the sun at 60°
{lower:.2f}° lower; looking up under a flat surface, a reddish line of {rim:.1f}° around a window
of {window:.1f}°. It is left out.
""",
)
