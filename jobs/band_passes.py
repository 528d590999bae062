"""The passes of a job on disk: each is whole, and says what it is, or is not there.

A pass is a float EXR whose header tells which pass of which job it is, so that a worker knows
what is done by looking at the files alone.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import write_layers
from ..scene.engines.band_engine import RenderPass
from ..scene.interruption import interrupted_afterwards
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.exr_header import read_header
from ..uw_spectral.spectra.spectral_image import read_exr, temporary_name, write_rgb_exr

_ATTRIBUTE = "underwaterPass"


class State(Enum):
    """What is known of a pass."""

    DONE = "done"
    BROKEN = "broken"
    MISSING = "missing"
    OTHER = "of another job"


@dataclass(frozen=True)
class Stamp:
    """What the header of a pass says: which it is, how long it took, what could not be treated."""

    key: str
    seconds: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class RenderedPass:
    """A pass on disk; ``seconds`` is None where it was there before."""

    path: Path
    bands: tuple[int, ...]
    seconds: float | None


def render_pass(
    render: RenderPass, bands: tuple[int, ...], path: Path, key: str = "", notes: Sequence[str] = ()
) -> float:
    """Render a pass under another name, put it in place with its stamp, and return its seconds.

    The folder of ``path`` is there; ``key`` tells the pass from every other; ``notes`` say what
    could not be treated. Raises KeyboardInterrupt once the pass is written, if it was asked for
    meanwhile.
    """
    raw = temporary_name(path, "raw")
    with interrupted_afterwards():
        start = time.perf_counter()
        try:
            layers = render(bands, raw)
            pixels, _ = read_exr(raw)
        except InputError as error:
            raise InputError(
                f"{path} was not rendered: {error}. If the disk is full, make room, or choose "
                "another --out"
            ) from error
        finally:
            raw.unlink(missing_ok=True)
        seconds = time.perf_counter() - start
        stamp = {_ATTRIBUTE: json.dumps({"key": key, "seconds": seconds, "notes": list(notes)})}
        if layers is not None:
            # First, so that a pass that is there has its layers.
            known = {**layers.attributes, **stamp}
            write_layers(layers_path(path), replace(layers, attributes=known))
        write_rgb_exr(path, pixels, stamp)
    return seconds


def layers_path(path: Path) -> Path:
    """Return the file of the layers of a pass."""
    return path.with_name(f"{path.stem}_layers.exr")


def look_at(
    path: Path, key: str, size: tuple[int, int], *, layers: bool = False
) -> tuple[State, Stamp | None]:
    """Return the state of a pass by its header, and its stamp.

    ``key`` is what it should have, ``size`` width and height in pixels; with ``layers``, these have
    to be there too.
    """
    if layers:
        found, _ = look_at(layers_path(path), key, size)
        if found is not State.DONE:
            return found, None
    header = read_header(path)
    if header is None:
        return (State.BROKEN if path.exists() else State.MISSING), None
    stamp = _stamp(header.text.get(_ATTRIBUTE, ""))
    if not header.whole or header.size != size:
        return State.BROKEN, stamp
    return (State.OTHER if stamp is None or stamp.key != key else State.DONE), stamp


def is_whole(path: Path, size: tuple[int, int], *, layers: bool = False) -> bool:
    """Whether a pass, and its layers, can be read to the end and have the size of the render."""
    files = [path, layers_path(path)] if layers else [path]
    try:
        return all(read_exr(file)[0].shape[1::-1] == size for file in files)
    except InputError:
        return False


def gather(rendered: Sequence[RenderedPass]) -> NDArray[np.float32]:
    """Read passes of up to three bands and stack them into bands, shape (h, w, n)."""
    images = [read_exr(item.path)[0][..., : len(item.bands)] for item in rendered]
    return np.concatenate(images, axis=-1)


def _stamp(text: str) -> Stamp | None:
    try:
        found = json.loads(text)
        return Stamp(str(found["key"]), float(found["seconds"]), tuple(map(str, found["notes"])))
    except (ValueError, KeyError, TypeError):
        return None
