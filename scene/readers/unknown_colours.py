"""What surfaces reflect in the mean, where nodes of their materials are not evaluated."""

from __future__ import annotations

from ...uw_spectral.errors import first_of
from .surroundings import Surroundings


def notes(around: Surroundings | None) -> list[str]:
    """Name materials about the cameras whose mean colour is a guess, and the nodes that are why."""
    found: dict[str, set[str]] = {}
    for surface in () if around is None else around.surfaces:
        for material, nodes in surface.unknown:
            found.setdefault(material, set()).update(nodes)
    if not found:
        return []
    named = [f"{name!r} ({', '.join(sorted(nodes))})" for name, nodes in sorted(found.items())]
    return [
        f"nodes of materials {first_of(named)} are not evaluated for the light "
        "that objects throw back: what they give counts as 0.5; bake them into a picture"
    ]
