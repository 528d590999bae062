"""The page of lamps in scenes, and its picture: some rows may be measured, the others kept."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from ..uw_spectral.errors import InputError
from ..uw_spectral.lamps.thrown_back import COUNT
from ..uw_spectral.spectra.spectral_image import replacing
from . import _lamp_scenes as scenes
from ._shade_scenes import BANDS, HEIGHT, WIDTH

BLOCK = 3
COARSER = (3, 4)  # blocks
CUT = math.radians(3.0)  # of the peak of the phase function
BLUR = (0.2, 0.05)
_HEAD = "| scene | mean | 95 % | noise | coarse | bright | backscatter |"
_COST_HEAD = "| lamps | CPU s | over none |"
# Of the picture, pixels; rows of whole blocks of 8, so that those that stay keep their values.
_LABEL, _GAP, _LARGER, _ROW, _TOP = 128, 4, 3, 88, 16


@dataclass(frozen=True)
class Page:
    """What was measured: cells of a table by name of place, and CPU seconds by number of lamps."""

    rows: Mapping[str, str]
    seconds: Mapping[int, float] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> Page:
        """Read a page that :meth:`text` wrote."""
        rows, seconds = {}, {}
        lines = path.read_text(encoding="utf-8").splitlines()
        for line in lines[lines.index(_HEAD) + 2 :]:
            if not line.startswith("|"):
                break
            name, cells = line.strip("| ").split(" | ", 1)
            rows[name] = cells
        for line in lines[lines.index(_COST_HEAD) + 2 :]:
            if not line.startswith("|"):
                break
            count, second, _ = line.strip("| ").split(" | ")
            seconds[int(count)] = float(second)
        return cls(rows, seconds)

    def of_places(self, names: Sequence[str]) -> Page:
        """Return the rows of places in their order.

        Raises
        ------
        InputError
            If one is missing.
        """
        missing = [name for name in names if name not in self.rows]
        if missing:
            raise InputError(
                f"lamps.md has no row of {', '.join(map(repr, missing))}; measure it too"
            )
        return Page({name: self.rows[name] for name in names}, self.seconds)

    def text(self) -> str:
        """Return the page."""
        rows = "\n".join(f"| {name} | {cells} |" for name, cells in self.rows.items())
        plain = self.seconds[0]
        costs = "\n".join(f"| {n} | {s:.2f} | {s / plain:.2f} |" for n, s in self.seconds.items())
        down, across = (BLOCK * n for n in COARSER)
        most = 10 * scenes.PHOTONS / 1e6
        fewer = scenes.TURBID * most
        return f"""# Lamps in EEVEE's water

Written by `python3 dev.py run -m benchmarks lamps_in_scenes`; `--only NAME` measures one scene.

How it is done is in [physics.md](../physics.md#lamps); the formulas alone are measured against
photons in [lamp_light.md](lamp_light.md).

## Against photons and Cycles
Default phase function, flat surface, {BANDS} bands, night (or sun and sky at a twentieth),
{scenes.DEPTH:g} m deep over sand, {WIDTH} × {HEIGHT} pixels. The reference are photons from the
lamps, {most:g} million for each band, {fewer:g} million in the noisiest
(`benchmarks/_lamp_room.py`; light scattered more than once blurred by {BLUR[0]:g} m and more), of
the last two scenes Cycles with two seeds of {scenes.SAMPLES} samples. ΔE2000 of blocks of {BLOCK}
× {BLOCK} pixels, and the reference's noise in it; *coarse*: blocks of {across} × {down};
*backscatter*: open water alone, median / 95 % / worst relative error by block and band. Wanted
were a mean of 2, with noise below 0.7, and backscatter within 5 % in the median and 15 % for 95
%.

{_HEAD}
|{"---|" * 7}
{rows}

The mean is **met** in clear water but for the torch across it, where sand in the ball's shadow is
up to 1.8 times too bright, and **missed** in most of II and in III and 3C, where much of it is
the reference's noise. Behind fish, net and diver the reference's own blur lets light round the
silhouettes: with a quarter of it water behind the fish is .98/1.07/.96 times the photons', behind
the diver .92/.77/1.04. Across III the torch is right within the noise, 3C **misses by more**.

## Seconds of a frame
CPU seconds on the software rasteriser, {WIDTH} × {HEIGHT}, the less of two, sun on; {COUNT} lamps
more stand for what objects reflect.

{_COST_HEAD}
|---|---|---|
{costs}

![Cycles, EEVEE](lamps.jpg)
"""


def picture_sheet(
    names: Sequence[str], drawn: Mapping[str, Sequence[NDArray[np.float64]]], path: Path
) -> None:
    """Draw a row per place: the reference and EEVEE in blocks, and EEVEE as it is.

    Parameters
    ----------
    names : sequence of str
        Of the places, from above.
    drawn : mapping of str to sequence of array
        sRGB of 0 to 1, of those that are new; the others stay as they are in the picture.
    path : Path
        Of the picture.
    """
    size = _LARGER * WIDTH, _LARGER * HEIGHT
    whole = _LABEL + 3 * (size[0] + _GAP)
    sheet = Image.new("RGB", (whole, _TOP + _ROW * len(names)), "white")
    draw = ImageDraw.Draw(sheet)
    for column, title in enumerate(("reference", "EEVEE in blocks", "EEVEE")):
        draw.text((_LABEL + column * (size[0] + _GAP), 2), title, "black", font_size=11)
    old = None if len(drawn) == len(names) else _Rows.read(path)
    for number, name in enumerate(names):
        top = _TOP + _ROW * number
        if name not in drawn:
            assert old is not None
            sheet.paste(old.row(name), (0, top))
            continue
        draw.multiline_text((2, top + 4), name.replace(", ", ",\n"), "black", font_size=10)
        for column, image in enumerate(drawn[name]):
            pixels = Image.fromarray((255.0 * np.clip(image, 0.0, 1.0) + 0.5).astype(np.uint8))
            at = _LABEL + column * (size[0] + _GAP), top
            sheet.paste(pixels.resize(size, Image.Resampling.NEAREST), at)
    comment = "\n".join(names).encode()
    with replacing(path) as temporary:
        sheet.save(temporary, "JPEG", quality=75, comment=comment)


@dataclass(frozen=True, eq=False)
class _Rows:
    """A picture of before; its comment names its rows."""

    sheet: Image.Image
    names: Sequence[str]

    @classmethod
    def read(cls, path: Path) -> _Rows:
        with Image.open(path) as sheet:
            names = sheet.info.get("comment", b"").decode().split("\n")
            return cls(sheet.convert("RGB"), names)

    def row(self, name: str) -> Image.Image:
        if name not in self.names:
            raise InputError(f"lamps.jpg has no row of {name!r}; measure it too")
        top = _TOP + _ROW * self.names.index(name)
        return self.sheet.crop((0, top, self.sheet.width, top + _ROW))
