"""The layers that a picture comes apart in: one table of names, units and meanings.

    I = D + B + F,   D = J T,   B = B_single + B_multiple + B_lamps

The symbols are those of Akkaynak & Treibitz (2018) and Jaffe (1990).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..errors import InputError

Kind = Literal["radiance", "irradiance", "fraction", "map"]

ALL, NONE = "all", "none"


@dataclass(frozen=True)
class Layer:
    """A layer."""

    name: str
    text: str
    #: ``radiance``, ``irradiance`` and ``fraction`` are given for the channels of the sensor, and
    #: for each band where bands are rendered; a ``map`` is the same for all light.
    kind: Kind = "radiance"
    units: str = ""  #: Of a fraction or a map; those of light are the picture's.
    channels: tuple[str, ...] = ("",)  #: Of a map; one without a name is the map itself.
    whole: bool = False  #: Whether it needs 32 bits.

    @property
    def is_map(self) -> bool:
        """Whether it is the same for all light."""
        return self.kind == "map"


_XYZ = ("X", "Y", "Z")

LAYERS = (
    Layer("I", "the image"),
    Layer("J", "what is seen, as lit there, without water before the camera"),
    Layer("D", "direct: light of J that arrives unscattered, J T"),
    Layer("B", "backscatter: light that the water on the way sends to the camera, the sum below"),
    Layer("B_single", "backscatter of sunlight scattered once"),
    Layer("B_multiple", "the rest of the backscatter of sun and sky"),
    Layer("B_lamps", "backscatter of lamps, and lamps that are seen themselves"),
    Layer("F", "forward-scattered: light of the surroundings, blurred over what is seen"),
    Layer(
        "T", "transmittance: exp(-c z) in a band, D / J of a sensor's channel", "fraction", "1",
        whole=True,
    ),
    Layer("E", "illumination: irradiance on the surface that is seen", "irradiance"),
    Layer("albedo", "base colour, linear Rec.709, and its reflectance in bands", "fraction", "1"),
    Layer("caustics", "factor of the waves on the unscattered sun", "map", "1"),
    Layer("shadow", "fraction of the direct sun that objects leave", "map", "1"),
    Layer("range", "Euclidean distance from the camera", "map", "m", whole=True),
    Layer("planar_depth", "distance along the optical axis", "map", "m", whole=True),
    Layer("position", "place in the world, z up from the surface", "map", "m", _XYZ, whole=True),
    Layer("normal", "unit normal in the world", "map", "1", _XYZ),
    Layer(
        "motion",
        "shift to the frame before (X, Y) and from the frame after (Z, W), y up",
        "map", "pixels", (*_XYZ, "W"),
    ),
    Layer("instance", "number of the object, 0 where none is", "map", "1", whole=True),
    Layer("material", "number of the material, 0 where none is", "map", "1", whole=True),
    Layer("cryptomatte", "coverage of objects and materials", "map", "1", whole=True),
)  # fmt: skip
"""All layers, in the order in which they are listed."""

NAMES = tuple(layer.name for layer in LAYERS)
BACKSCATTER = ("B_single", "B_multiple", "B_lamps")
"""What B is the sum of."""


def layer(name: str) -> Layer:
    """Return the layer of a name."""
    return LAYERS[NAMES.index(name)]


def parse_layers(text: str) -> tuple[str, ...]:
    """Read a list of layers, in the order of the table.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    found = {name for name in (part.strip() for part in text.split(",")) if name}
    if found <= {NONE}:
        return ()
    if found == {ALL}:
        return NAMES
    strange = sorted(found - set(NAMES))
    if strange:
        raise InputError(
            f"--layers: {strange[0]!r} is not one of {', '.join(NAMES)}; {ALL} and {NONE} are "
            "words of their own"
        )
    return tuple(name for name in NAMES if name in found)
