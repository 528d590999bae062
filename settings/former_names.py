"""Names that settings had in earlier versions, for files and command lines that have them."""

from __future__ import annotations

from collections.abc import Mapping

FORMER_NAMES = {
    "mirrored_things": "planar_reflections",
    "second_water_share": "second_water_fraction",
}
"""Former name: the present one."""


def in_present_names[Value](values: Mapping[str, Value]) -> dict[str, Value]:
    """Return settings by the names of this version.

    Examples
    --------
    >>> in_present_names({"second_water_share": 0.5})
    {'second_water_fraction': 0.5}
    """
    return {FORMER_NAMES.get(name, name): value for name, value in values.items()}
