"""What is not drawn right of waves with height: said in log, record and panel."""

from __future__ import annotations


def raised_limits(
    tile: float, *, eevee: bool, above: bool = True, below: bool = True, live: bool = False
) -> list[str]:
    """Return what to know before waves with height are rendered, a line each.

    Caustics repeat after a ``tile``, m. ``above`` and ``below`` are whether the camera may be over
    them, or under them; ``live`` is whether the viewport shows them.
    """
    found = [f"waves longer than {tile:g} m and the swell move no caustics"]
    if eevee and above:
        found.append("EEVEE refracts objects under water as a level surface would")
    if eevee and below:
        found.append("from below, EEVEE shows open water where an object lies behind a trough")
    if live:
        found.append("the viewport has no waterline, it shows the side that the camera is on")
    return [f"waves with height: {text}" for text in found]
