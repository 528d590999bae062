"""From a description to optics: every text read, every quantity on the bands."""

from __future__ import annotations

import functools

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.barrier_filter import parse_filter
from ..spectra.illuminant import parse_illuminant
from ..spectra.reflectance import parse_reflectance
from ..spectra.sensor import parse_sensor, standard_observer
from ..transfer.sky_picture import SkyPicture
from .band_selection import optimised_bands
from .described_water import column_of
from .description import REFERENCE_BANDS, BandsDescription, Description
from .excitation import excitation_of
from .mixed_water import mixtures_of
from .resolved_optics import ResolvedOptics
from .viewpoint import Viewpoint

_optimised_bands = functools.lru_cache(maxsize=32)(optimised_bands)


def resolve(description: Description) -> ResolvedOptics:
    """Read every text and file of a description and compute the optics.

    Raises
    ------
    InputError
        If a name is unknown, a file cannot be used, or a table does not
        reach the bands.

    Examples
    --------
    A camera in coastal water, over sand at 9 m, and what a diver sees there:

    >>> import dataclasses
    >>> from .description import Description, FloorDescription, WaterDescription
    >>> from .summary import readouts
    >>> from .visibility import horizontal_visibility
    >>> reef = Description(WaterDescription("jerlov:3C"), floor=FloorDescription(9.0, "0.4"))
    >>> camera = resolve(reef).viewpoint(depth=5.0)
    >>> round(horizontal_visibility(camera), 1)
    3.3
    >>> many = dataclasses.replace(reef, bands=BandsDescription(REFERENCE_BANDS))
    >>> seen = readouts(camera, resolve(many).viewpoint(depth=5.0))
    >>> seen.colour.name
    'green'
    """
    mixtures = mixtures_of(description.water)
    light = description.light
    illuminant = light.illuminant
    if isinstance(illuminant, str):
        illuminant = parse_illuminant(illuminant, light.zenith)
    picture = light.sky_picture or None
    if isinstance(picture, str):
        picture = SkyPicture.read(picture.removeprefix("file:"))
    floor = description.floor.reflectance
    if isinstance(floor, str):
        floor = parse_reflectance(floor)

    column_and_phase = functools.partial(
        column_of, description, mixtures, illuminant, picture=picture
    )
    bands, reference = description.bands, None
    if isinstance(bands, BandsDescription):
        chosen, bands = bands, _listed_or_equal(bands)
        if chosen.optimised and len(bands) < REFERENCE_BANDS:
            if light.strength == 0:
                raise InputError(
                    "optimised bands are fitted to daylight, and the sunlight is 0: take equal "
                    "bands, or a sunlight of 0.0001, which is night to the eye"
                )
            fine = Bands.uniform(REFERENCE_BANDS, chosen.start, chosen.end)
            reference = column_and_phase(fine, floor.at(fine.centres))
            reference[0].require_one_layer("optimised bands know")
            if not chosen.wavelengths:
                eye = Viewpoint(*reference, illuminant, standard_observer(), depth=0.0)
                bands = _optimised_bands(chosen.count, eye).bands
    column, phase = column_and_phase(bands, floor.at(bands.centres))
    excitation = excitation_of(
        description.water, mixtures.layers[0], column, floor, column_and_phase
    )
    sensor = description.camera.sensor
    if isinstance(sensor, str):
        sensor = parse_sensor(sensor)
    parse_filter(description.camera.filter)
    return ResolvedOptics(
        description,
        mixtures.map(lambda mixture: mixture.water),
        illuminant, sensor, floor, bands, phase, column, excitation, reference,
    )  # fmt: skip


def _listed_or_equal(described: BandsDescription) -> Bands:
    if described.wavelengths:
        return Bands.at_wavelengths(described.wavelengths)
    return Bands.uniform(described.count, described.start, described.end)
