"""The files of a view: its picture, what lies beside it, and whether they are there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..datasets.outputs import RAW_FILES
from .manifest import Manifest, View

_HEAD = 200  # characters of a record, which hold its key


@dataclass(frozen=True)
class PictureFiles:
    """The scene-linear picture of a view, and the files beside it."""

    picture: Path

    @property
    def shown(self) -> Path:
        """The picture as it is shown."""
        return self.picture.with_suffix(".png")

    @property
    def record(self) -> Path:
        """Its record, which is written last."""
        return self.picture.with_suffix(".json")

    @property
    def spectra(self) -> Path:
        """Its bands."""
        return self._beside("spectral.exr")

    @property
    def layers(self) -> Path:
        """What it comes apart in."""
        return self._beside("layers.exr")

    @property
    def truth(self) -> Path:
        """What its colours are made of."""
        return self._beside("truth.json")

    @property
    def receptors(self) -> tuple[Path, ...]:
        """Responses of receptors as EXR and TIFF, and as PNG their false colours and the legend."""
        ends = ("receptors.exr", "receptors.tiff", "receptors.png", "receptors_legend.png")
        return tuple(map(self._beside, ends))

    def raw(self, kind: str) -> Path:
        """Return the raw file of a kind, of :data:`.outputs.RAW_FILES`."""
        return self.picture.with_suffix(f".{kind}")

    def all(self) -> list[Path]:
        """Return all that a view may have of some job, its record first."""
        others = (self.picture, self.shown, self.spectra, self.layers, self.truth)
        return [self.record, *others, *self.receptors, *map(self.raw, RAW_FILES)]

    def _beside(self, end: str) -> Path:
        return self.picture.with_name(f"{self.picture.stem}_{end}")


def files_of(manifest: Manifest, view: View) -> PictureFiles:
    """Return the files of a view of a job."""
    return PictureFiles(manifest.folder(view) / f"{view.frame:04d}.exr")


def is_developed(manifest: Manifest, view: View) -> bool:
    """Whether the pictures of a view are there, made of the passes that the manifest plans."""
    try:
        with files_of(manifest, view).record.open(encoding="utf-8") as file:
            head = file.read(_HEAD)
    except (OSError, UnicodeDecodeError):
        return False
    return f'"key": "{manifest.view_key(view)}"' in head
