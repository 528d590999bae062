"""Try the installed wheel: what an import brings, a Kd against the published one, its examples.

Run by tools/build_wheel.py, where the wheel can be imported and nothing of the checkout.
"""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import platform
import sys
import time
import warnings

_NM = (450.0, 550.0, 650.0)
_WITHIN = 0.03
"""HydroLight's Kd of types I to IB is printed to two digits (docs/validation.md)."""


def _kd() -> tuple[list[float], list[float]]:
    """Kd of Jerlov IB to a tenth of the light, solved and published, 1/m."""
    import numpy as np
    from underwater_spectral.uw_spectral.imaging import (
        BandsDescription,
        Description,
        SunAndSky,
        SurfaceDescription,
        WaterDescription,
        resolve,
    )
    from underwater_spectral.uw_spectral.water import Water

    optics = resolve(
        Description(
            WaterDescription("jerlov:IB"),
            SunAndSky(zenith=30.0),
            SurfaceDescription("flat"),
            bands=BandsDescription(wavelengths=_NM),
        )
    )
    y, field = np.geomspace(0.02, 400.0, 500), optics.solved_field()
    lost = -np.log(field.Ed(y) / field.Ed(0.0))
    tenth = np.log(10.0)
    solved = [float(tenth / np.interp(tenth, band, y)) for band in lost.T]
    return solved, Water.jerlov("IB").Kd(_NM).tolist()


def main() -> None:
    """Try it; an exception or a status other than 0 says that it does not work."""
    start = time.perf_counter()
    import underwater_spectral.uw_spectral.imaging  # noqa: F401

    took = time.perf_counter() - start
    brought = {"bpy", "colour", "jerlov", "OpenImageIO"} & set(sys.modules)
    assert not brought, f"an import brings {brought}"
    warnings.simplefilter("ignore")  # caveats of the data
    solved, published = _kd()
    for nm, ours, theirs in zip(_NM, solved, published, strict=True):
        assert abs(theirs / ours - 1.0) < _WITHIN, f"Kd({nm:g}) is {ours:g}, not {theirs:g} 1/m"
    package = sys.modules["underwater_spectral"]
    names = [m.name for m in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
    results = [doctest.testmod(importlib.import_module(name)) for name in names]
    failed, examples = (sum(counts) for counts in zip(*results, strict=True))
    assert not failed, f"{failed} of {examples} examples fail"
    assert "bpy" not in sys.modules
    kd = ", ".join(
        f"{ours:.4f} / {theirs:.4f}" for ours, theirs in zip(solved, published, strict=True)
    )
    sys.stdout.write(
        f"Python {platform.python_version()}: imported in {took:.2f} s; Kd of Jerlov IB at "
        f"450, 550, 650 nm, solved / published: {kd} 1/m; {examples} examples pass\n"
    )


if __name__ == "__main__":
    main()
