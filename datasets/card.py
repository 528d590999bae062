"""The data card of a set: what it is, whose, made of what, and by which conventions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..uw_spectral.errors import InputError
from .files import write_text
from .view import SPLITS, DataSetView, check_views

_WORLD = "World: metres, z up, z = 0 is the water surface."
_PICTURES = """\
- Image coordinates are counted from the upper left corner of the picture; in BOP, as in OpenCV,
  from the centre of the first pixel.
- `range` is the Euclidean distance from the camera's centre, `planar_depth` that along its optical
  axis, both in m. Depth in PNG is planar, in mm; 0 is *nothing seen*."""


@dataclass(frozen=True)
class Source:
    """What a set is made of: a scene, a table, a model."""

    name: str
    licence: str
    reference: str = ""


@dataclass(frozen=True)
class DataCard:
    """What a set says of itself; ``version`` is that of the set.

    Raises InputError if title or licence are empty.
    """

    title: str
    licence: str  #: Of the pictures, as SPDX writes it.
    sources: Sequence[Source] = ()
    #: Of the software that made it, by name.
    versions: Mapping[str, str] = field(default_factory=dict)
    version: str = "1.0"
    description: str = ""
    licence_url: str = ""
    conventions: Sequence[str] = ()  #: Of the poses in its formats, a line each.

    def __post_init__(self) -> None:
        for name in ("title", "licence"):
            if not getattr(self, name).strip():
                raise InputError(f"data card: the {name} is empty; nobody can use a set without")


def write_card(
    path: Path, card: DataCard, views: Sequence[DataSetView], notes: Sequence[str] = ()
) -> None:
    """Write a card as Markdown, with what can be counted in the views.

    ``notes`` tell what the set could not hold, a line each. Raises InputError if there are no
    views, two share a name, or the file cannot be written.
    """
    check_views(views)
    counted = Counter(view.split for view in views)
    cameras = dict.fromkeys((str(view.metadata.get("camera", "")), view.camera) for view in views)
    lines = [f"# {card.title}", ""]
    if card.description:
        lines += [card.description, ""]
    lines += [f"Version {card.version}. Licence: {card.licence}"]
    lines[-1] += f" (<{card.licence_url}>)." if card.licence_url else "."
    lines += ["", "## Content", "", "| split | views |", "|---|---|"]
    lines += [f"| {split} | {counted[split]} |" for split in SPLITS]
    lines += ["", f"Cameras: {len(cameras)}", ""]
    lines += [
        f"- {name}{': ' if name else ''}{c.width} × {c.height} pixels, fx {c.fx:.6g}, "
        f"fy {c.fy:.6g}, cx {c.cx:.6g}, cy {c.cy:.6g}, "
        f"distortion {', '.join(f'{k:g}' for k in c.distortion)}"
        for name, c in cameras
    ]
    waters = dict.fromkeys(str(v.metadata["water"]) for v in views if "water" in v.metadata)
    if waters:
        lines += ["", f"Waters: {', '.join(waters)}"]
    categories = Counter(item.category for view in views for item in view.instances)
    if categories:
        lines += ["", "| category | instances in views |", "|---|---|"]
        lines += [f"| {name} | {count} |" for name, count in sorted(categories.items())]
    if notes:
        lines += ["", "## Left out", "", *(f"- {note}" for note in notes)]
    lines += ["", "## Conventions", "", *(f"- {x}" for x in (_WORLD, *card.conventions))]
    lines += [_PICTURES, "", "## Sources", ""]
    lines += ["| what | licence | reference |", "|---|---|---|"]
    lines += [f"| {s.name} | {s.licence} | {s.reference} |" for s in card.sources]
    lines += ["", "## Made by", ""]
    lines += [f"- {name} {version}" for name, version in card.versions.items()]
    write_text(path, "\n".join(lines) + "\n")
