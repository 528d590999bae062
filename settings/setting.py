"""What is known of a setting: everything that a panel, an option and a reference page say of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

ROW = "row"
"""Of a field of a dataclass: what is known of its setting."""

Audience = Literal["artist", "researcher"]


@dataclass(frozen=True)
class Section:
    """Settings that belong together; a panel, a group of options, a chapter of the reference."""

    title: str
    text: str


SECTIONS = {
    "water": Section("Water", "What is in the water"),
    "depth": Section("Depth and Floor", "Where the seabed is"),
    "waves": Section("Surface and Waves", "The surface, its waves and their caustics"),
    "particles": Section("Snow and Bubbles", "Particles that are seen one by one"),
    "sun": Section("Sun and Sky", "The light above the water"),
    "lamps": Section("Lamps", "Lamps, and how much daylight there is beside them"),
    "housing": Section("Housing", "The port and the lens that the camera looks through"),
    "sensor": Section("Camera Sensor", "The camera, and how its picture is developed"),
    "quality": Section("Quality", "How the water is rendered"),
}


@dataclass(frozen=True)
class Setting:
    """A row of the table of settings."""

    label: str  #: Its name in a panel.
    text: str  #: What it does, one sentence without a full stop.
    section: str  #: One of :data:`SECTIONS`.
    unit: str = ""
    #: Words that it may be: their labels, and what each means. Empty for any.
    choices: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    known: str = ""  #: What is suggested where any word may be (:func:`.known_words`).
    #: What a number may be, and the range of its slider.
    limits: tuple[float, float] = (float("-inf"), float("inf"))
    soft_limits: tuple[float, float] | None = None
    digits: int = 2  #: Behind the point, in a panel.
    animatable: bool = False  #: Whether it may differ from frame to frame.
    #: Other settings, and the values of theirs with which it has an effect; none for any that is
    #: not empty.
    needs: Mapping[str, tuple[object, ...]] = field(default_factory=dict)
    engine: str = ""  #: The one engine that it is for; empty for all.
    who: Audience = "artist"
    #: Of the field that it describes.
    name: str = ""
    default: str | float | bool = ""

    def applies(self, values: object) -> bool:
        """Whether it has an effect beside other settings, which are attributes of an object."""
        found = {name: getattr(values, name) for name in self.needs}
        return all(v in self.needs[n] if self.needs[n] else bool(v) for n, v in found.items())

    @property
    def facts(self) -> str:
        """Unit and limits in words, empty if there are none.

        Examples
        --------
        >>> Setting("Wind", "Wind that raises the waves", "waves", "m/s", limits=(0, 40)).facts
        'm/s, 0 to 40'
        """
        low, high = self.limits
        span = "" if low == float("-inf") else f"{low:g} to {high:g}"
        return ", ".join(filter(None, (self.unit, span)))


def stored[Default: str | float | bool](
    default: Default,
    label: str,
    text: str,
    section: str,
    **facts: Any,  # noqa: ANN401
) -> Default:
    """Return a field of a dataclass with what is known of a setting; its facts are its own."""
    return field(default=default, metadata={ROW: Setting(label, text, section, **facts)})


FORMER_NAMES = {
    "mirrored_things": "planar_reflections",
    "second_water_share": "second_water_fraction",
}
"""Names that settings had in earlier versions, of files and command lines: the present ones."""


def in_present_names[Value](values: Mapping[str, Value]) -> dict[str, Value]:
    """Return settings by the names of this version.

    Examples
    --------
    >>> in_present_names({"second_water_share": 0.5})
    {'second_water_fraction': 0.5}
    """
    return {FORMER_NAMES.get(name, name): value for name, value in values.items()}
