"""Node group of every number that the real-time groups need: UW Values.

The other groups hold an instance of it. A change of water, camera or sun
writes numbers here and reaches every material; no node is added or removed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.wave_patterns import KNOTS
from ..uw_spectral.transfer.closed_form import ClosedForm
from ..uw_spectral.transfer.depth_scale import Zone
from ..uw_spectral.transfer.light_field import LightField
from ..uw_spectral.transfer.radiance_table import RadianceTable
from ..uw_spectral.transfer.sky import UNIFORM
from ..uw_spectral.transfer.sun_beam import SunBeam
from ..uw_spectral.water.phase import Mixture, PhaseFunction
from . import realtime_inelastic, realtime_lamps, realtime_shade
from .node_mathematics import Graph, new_group

NAME = "UW Values"
SHAPE = "uw_shape"

FIELD_NUMBERS = ("mu_s", "y_f")
NOT_PER_PIXEL = ("R",)
FIELD_BANDS = tuple(
    f.name for f in fields(LightField) if f.name not in (*FIELD_NUMBERS, *NOT_PER_PIXEL)
)
BEAM_BANDS = ("b", "c", "cp", "E")
LAYERED_BANDS = ("E",)
TABLE_SCALE, TABLE_DECAY = "table scale", "table decay"
FLOOR = "floor radiance"
ZONE = tuple(f.name for f in fields(Zone))
SUN = ("sun x", "sun y", "sun z")
SUN_IN_AIR = ("sun in air x", "sun in air y", "sun in air z")
SMOOTH = tuple(f"aureole moment {i}" for i in range(3))
CAMERA_DEPTH = "camera depth"
IN_AIR, RAY_INDEX = "camera in air", "index of rays"
CAMERA = ("camera x", "camera y", "camera z")
DRAWN_SUN = ("drawn sun x", "drawn sun y", "drawn sun z")
MIRRORED_SHARE = "mirrored sky"
SUN_ABOVE, SKY_ABOVE = "sun above", "sky above"
INDEX = "refractive index"
SKY = "sky radiance"
REFLECTANCE = tuple(f"reflectance {c}" for c in ("red", "green", "blue"))
EMISSION = tuple(f"emission {c}" for c in ("red", "green", "blue"))
SENSOR = tuple(f"sensor {c}" for c in ("red", "green", "blue"))
LAYERS_SENSOR = tuple(f"layers {c}" for c in ("red", "green", "blue"))
SHAFT_END = "shaft end"
SHAFT_SCALE = "shaft scale"
WAVES_PER_METRE = "waves per metre"
WAVES_HALF_CELL = "waves half cell"
WAVES_LOG_DEPTH = "waves log depth"
WAVES_PER_LOG = "waves per log"
GLITTER = "glitter"
GLITTER_WIDTH = "glitter width"
CAUSTIC_STRENGTH = "caustic strength"
CONTRAST = tuple(f"caustic contrast {i}" for i in range(KNOTS))
_WAVES = (
    WAVES_PER_METRE,
    WAVES_HALF_CELL,
    WAVES_LOG_DEPTH,
    WAVES_PER_LOG,
    GLITTER,
    GLITTER_WIDTH,
    CAUSTIC_STRENGTH,
)


@dataclass(frozen=True)
class Shape:
    """What decides the nodes of the groups; everything else is a number in them.

    Parameters
    ----------
    bands : int
        Number of bands n.
    components : tuple of PhaseFunction
        Parts of the phase function; their weights per band are numbers.
    lobes : int
        Terms of the sun's aureole, 0 leaves it out.
    flat : bool
        Whether the water has a surface that reflects.
    shafts : bool
        Whether single scattering comes from the volume.
    waves : bool
        Whether the surface moves and throws caustics.
    inelastic : tuple of bool
        Exponentials of depth of the inelastic light: whether each rises to the floor.
    diffuse_shadows : bool
        Whether things keep light from above other than the direct sun away.
    solved : bool
        Whether the light is looked up in tables of the solved field; it has no aureole and
        no inelastic exponentials then.
    sky : str
        Distribution of the sky's radiance.
    layered : bool
        Whether the water differs with depth; it is solved and has no shafts then.
    zones, slices : int
        Of the scale of depths of solved water.
    shade : bool
        Whether things keep all kinds of light away, and throw some back; of solved water.
    lamps : int
        Lamps in the water.
    layers : tuple of str
        What is written beside the picture, of :mod:`.realtime_layers`.
    above : bool
        Whether the camera may be above the water.
    mirrors : bool
        Whether things mirror the water; where it is solved and the same at every depth.
    """

    bands: int
    components: tuple[PhaseFunction, ...]
    lobes: int
    flat: bool
    shafts: bool
    waves: bool = False
    inelastic: tuple[bool, ...] = ()
    diffuse_shadows: bool = False
    solved: bool = False
    sky: str = UNIFORM
    layered: bool = False
    zones: int = 0
    slices: int = 0
    shade: bool = False
    lamps: int = 0
    layers: tuple[str, ...] = ()
    above: bool = False
    mirrors: bool = False

    @property
    def triples(self) -> int:
        """Number of vectors that carry the bands."""
        return math.ceil(self.bands / 3)

    @property
    def layered_components(self) -> int:
        """Parts of the phase function that layered water has tables for."""
        return len(self.components) if self.layered else 0


@dataclass(frozen=True, eq=False)
class Numbers:
    """The contents of UW Values.

    Parameters
    ----------
    bands : mapping of str to array, shape (n,)
        Quantities per band.
    single : mapping of str to float
        The others.
    """

    bands: Mapping[str, NDArray[np.float64]]
    single: Mapping[str, float]


def band_names(shape: Shape) -> list[str]:
    """Names of the quantities per band."""
    of_light = FIELD_BANDS
    if shape.solved:
        of_beam = LAYERED_BANDS if shape.layered else BEAM_BANDS
        of_light = (*of_beam, TABLE_SCALE, TABLE_DECAY, FLOOR)
    names = [*of_light, SKY, *REFLECTANCE, *EMISSION, *SENSOR]
    if len(shape.components) > 1 and not shape.layered:
        names += [f"phase {i}" for i in range(len(shape.components))]
    if shape.lobes:
        names += ["aureole single", *SMOOTH]
        names += [
            f"lobe {kind} {i}" for kind in ("weight", "asymmetry") for i in range(shape.lobes)
        ]
    if shape.waves:
        names += CONTRAST
    if shape.shade:
        names.append(realtime_shade.SPECTRUM)
    if shape.lamps:
        names += realtime_lamps.band_names(shape.components)
    if shape.layers:
        names += LAYERS_SENSOR
    if shape.above:
        names += [SUN_ABOVE, SKY_ABOVE]
    return [*names, *realtime_inelastic.band_names(shape.inelastic)]


def single_names(shape: Shape) -> list[str]:
    """Names of the quantities that are the same in every band."""
    names = [*FIELD_NUMBERS, *SUN, *SUN_IN_AIR, CAMERA_DEPTH, INDEX, SHAFT_END, SHAFT_SCALE]
    names += _WAVES if shape.waves else ()
    names += realtime_shade.NUMBERS if shape.shade else ()
    names += (IN_AIR, RAY_INDEX, *CAMERA, *DRAWN_SUN, MIRRORED_SHARE) if shape.above else ()
    return [*names, *realtime_lamps.NUMBERS] if shape.lamps else names


def _zone_names(shape: Shape) -> list[str]:
    return [name_of_zone(field, place) for place in range(shape.zones) for field in ZONE]


def of_table(beam: SunBeam, table: RadianceTable, floor: NDArray[np.float64]) -> Numbers:
    """Return the numbers of the sun, and of tables of the solved field over a floor's radiance.

    The beam is that of the water, or of the first of its layers.
    """
    bands = {name: getattr(beam, name) for name in BEAM_BANDS}
    bands |= {TABLE_SCALE: table.scale, TABLE_DECAY: table.decay, FLOOR: floor}
    depths = {
        name_of_zone(field, place): getattr(zone, field)
        for place, zone in enumerate(table.depth_scale.zones)
        for field in ZONE
    }
    return Numbers(bands | _phase(beam.phase), _sun(beam) | depths)


def name_of_zone(field: str, place: int) -> str:
    """Name of a quantity of one of the zones of depth."""
    return f"zone {place} {field}"


def of_water(water: ClosedForm, shape: Shape) -> Numbers:
    """Return the numbers of the closed form itself."""
    bands = {name: getattr(water.field, name) for name in FIELD_BANDS} | _phase(water.phase)
    if shape.lobes:
        aureole = water.aureole
        bands["aureole single"] = aureole.single
        bands |= dict(zip(SMOOTH, aureole.smooth, strict=True))
        for kind, rows in (("weight", aureole.weights), ("asymmetry", aureole.asymmetries)):
            bands |= {f"lobe {kind} {i}": row for i, row in enumerate(rows)}
    return Numbers(bands, _sun(water.beam))


def _phase(phase: Mixture) -> dict[str, NDArray[np.float64]]:
    if len(phase.components) == 1:
        return {}
    return {f"phase {i}": row for i, row in enumerate(phase.weights)}


def _sun(beam: SunBeam) -> dict[str, float]:
    numbers = {name: getattr(beam, name) for name in FIELD_NUMBERS}
    return numbers | dict(zip(SUN, beam.sun, strict=True))


def build(shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group; its numbers are zero. Those of solved bands are in an image."""
    tree = new_group(NAME)
    tree[SHAPE] = repr(shape)
    graph = Graph(tree)
    output = tree.nodes.new("NodeGroupOutput")
    sources = [
        *(
            (name, "ShaderNodeValue", "NodeSocketFloat")
            for name in (*single_names(shape), *_zone_names(shape))
        ),
        *(
            (f"{name} {triple}", "ShaderNodeCombineXYZ", "NodeSocketVector")
            for name in (() if shape.solved else band_names(shape))
            for triple in range(shape.triples)
        ),
    ]
    for row, (name, kind, socket) in enumerate(sources):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type=socket)
        node = graph.node(kind, name=name, label=name)
        node.location = (0.0, -40.0 * row)
        tree.links.new(node.outputs[0], output.inputs[row])
    output.location = (300.0, 0.0)
    return tree


def write(tree: bpy.types.ShaderNodeTree, numbers: Numbers) -> None:
    """Put numbers into the group; only what differs is touched."""
    touched = None
    for name, values in numbers.bands.items():
        triples = _full_triples(name, values)
        for index, triple in enumerate(triples.reshape(-1, 3)):
            if f"{name} {index}" not in tree.nodes:
                break
            inputs = tree.nodes[f"{name} {index}"].inputs
            now = np.empty(3, np.float32)
            inputs.foreach_get("default_value", now)
            if not np.array_equal(now, triple):
                inputs.foreach_set("default_value", triple)
                touched = inputs[0]
    for name, value in numbers.single.items():
        outputs = tree.nodes[name].outputs
        if outputs[0].default_value != np.float32(value):
            outputs.foreach_set("default_value", [float(value)])
            touched = outputs[0]
    # Ordinary assignments update the tree, at a cost: one is enough for all.
    if touched is not None:
        touched.default_value = touched.default_value


def rows(numbers: Numbers, shape: Shape) -> list[NDArray[np.float32]]:
    """Return the numbers of solved bands, in full triples, as :class:`.Tables` finds them."""
    return [_full_triples(name, numbers.bands[name]) for name in band_names(shape)]


def _full_triples(name: str, values: NDArray[np.float64]) -> NDArray[np.float32]:
    triples = pad_triples(values).astype(np.float32)
    if name in (*SENSOR, *LAYERS_SENSOR):  # bands that only fill their triple are not seen
        triples[len(values) :] = 0.0
    return triples


def pad_triples(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Repeat the last band until the triples are full."""
    return np.pad(np.asarray(values, dtype=np.float64), (0, -len(values) % 3), mode="edge")
