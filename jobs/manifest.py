"""The manifest of a job: everything that its pictures depend on, decided once, in one JSON file.

Any machine that reads it renders the same picture, whatever part of the job it is given. Paths in
the file are relative to its folder, so that a project can be moved or mounted elsewhere.
"""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.files import no_device, plain_names
from ..quality.methods import Device, Engine, Method, Mode, method_of
from ..scene.readers.picture_size import rendered_size
from ..settings.scene_settings import SETTINGS, SceneSettings
from ..settings.setting import in_present_names
from ..uw_spectral.imaging.layer_sums import drawn_for
from ..uw_spectral.imaging.layers import NONE, parse_layers
from ..uw_spectral.spectra.spectrum import split_location
from .render_region import Region
from .stage import Stage

FORMAT = 1
"""Of the file; a newer one is refused."""
_PASSES = "passes"
# Settings that only the development reads: a pass does not depend on them, unless it is
# developed as it is rendered.
DEVELOPMENT = frozenset({"sensor", "filter", "white_balance", "exposure", "exposure_compensation"})
# How a picture is shown, and when it is good enough: no pass depends on it.
SHOWN = frozenset(
    {
        *("tone", "contrast", "noise", "raw", "iso", "full_well", "read_noise"),
        *("receptors", "false_colour"),
    }
)
CHANGEABLE = (DEVELOPMENT | SHOWN) - {"noise"}
"""Settings by which finished passes can be developed again."""


@dataclass(frozen=True)
class ExternalFile:
    """A file that the scene or a setting names; ``what`` says which, in words.

    ``setting`` is empty for files of the scene, whose ``path`` is as the .blend has it.
    ``sha256`` is empty for a file that is missing.
    """

    what: str
    path: str
    sha256: str
    setting: str = ""


@dataclass(frozen=True)
class CameraOutput:
    """A camera of the job, and the folder of its files below the output folder."""

    name: str
    folder: str


@dataclass(frozen=True)
class Pass:
    """One render of a frame: its bands, and how its noise is drawn.

    ``part`` counts the renders of the same bands with other seeds, whose mean is the pass.
    """

    bands: tuple[int, ...]
    part: int
    seed: int
    samples: int


@dataclass(frozen=True)
class Development:
    """How bands become scene-linear Rec.709: weights of shape (3, n), and what they are."""

    description: str
    weights: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class View:
    """A frame as a camera sees it; ``development`` is a place in the manifest's list.

    ``eye`` is the place of the camera, m, and the unit vector to where it looks.
    """

    frame: int
    camera: str
    depth: float
    development: int
    eye: tuple[float, ...] = ()


@dataclass(frozen=True)
class Exposed:
    """What a frame is exposed by besides the water.

    ``stops`` are those that the picture of the first camera asked for, if it was asked;
    ``lamplight`` the irradiance of lamps before each camera by band, empty without lamps.
    """

    stops: float | None = None
    lamplight: tuple[tuple[float, ...] | None, ...] = ()


@dataclass(frozen=True)
class Output:
    """What is rendered besides the settings of the water, and by what.

    ``resolution`` is width, height and percentage; ``denoise`` whether developed pictures are
    denoised; ``extent`` half the width of the water and the depth of its bottom, in m; ``scripts``
    whether the scene has Python of its own that runs; ``scene_name`` is that of the .blend;
    ``region`` is rendered, or all; ``crop`` leaves out what lies beyond it; ``transparent`` is
    whether pictures have alpha instead of open water; ``hidden`` names objects that are left out.
    """

    engine: Engine
    mode: Mode
    device: Device
    resolution: tuple[int, int, int]
    seed: int
    denoise: bool
    froxels: int | None
    extent: tuple[float, float]
    decisions: tuple[str, ...]
    scripts: bool = False
    scene_name: str = ""
    region: Region | None = None
    crop: bool = False
    transparent: bool = False
    hidden: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a picture in pixels."""
        return rendered_size(*self.resolution)

    def cut(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return what is rendered of an image as large as a picture."""
        return image if self.region is None else self.region.cut(image)

    def framed(self, part: NDArray[Any]) -> NDArray[Any]:
        """Return what files hold of a region: it alone, or a picture that is 0 elsewhere."""
        if self.region is None or self.crop:
            return part
        return self.region.placed(part, self.size)


@dataclass(frozen=True)
class Manifest:
    """A job, planned.

    ``scene`` is the .blend, None if it was never saved; ``scene_sha256`` its content, ``"unsaved"``
    without one. ``versions`` are those of Blender, of the extension and of its source. ``settings``
    are those of the first frame; ``changes`` what differs in other frames. ``passes`` are of every
    frame and camera, ``bands_nm`` and ``widths_nm`` centres and widths of the bands; ``views`` are
    cameras in turn, the frames of each in order. ``lamps``, ``clouds`` and ``exposed`` hold, by
    frame, what is not as at the frame before. ``stage`` is added to the scene. ``rendered_in`` is
    the folder of the passes, if they are another job's; nothing is rendered then.
    """

    scene: Path | None
    out: Path
    scene_sha256: str
    versions: Mapping[str, str]
    output: Output
    settings: Mapping[str, Any]
    changes: Mapping[int, Mapping[str, Any]]
    frames: tuple[int, ...]
    cameras: tuple[CameraOutput, ...]
    passes: tuple[Pass, ...]
    bands_nm: tuple[float, ...]
    widths_nm: tuple[float, ...]
    developments: tuple[Development, ...]
    views: tuple[View, ...]
    files: tuple[ExternalFile, ...]
    lamps: Mapping[int, tuple[Mapping[str, Any], ...]] = field(default_factory=dict)
    clouds: Mapping[int, tuple[Mapping[str, Any], ...]] = field(default_factory=dict)
    stage: Stage | None = None
    exposed: Mapping[int, Exposed] = field(default_factory=dict)
    rendered_in: Path | None = None

    def lamps_of(self, frame: int) -> tuple[Mapping[str, Any], ...]:
        """Return the lamps at a frame, as records have them."""
        return self._latest(self.lamps, frame, ())

    def clouds_of(self, frame: int) -> tuple[Mapping[str, Any], ...]:
        """Return the clouds at a frame, as records have them."""
        return self._latest(self.clouds, frame, ())

    def exposed_of(self, frame: int) -> Exposed:
        """Return what a frame is exposed by besides the water."""
        return self._latest(self.exposed, frame, Exposed())

    def lamplight_of(self, view: View) -> NDArray[np.float64] | None:
        """Return the irradiance of lamps that a view is exposed by, None without lamps."""
        lit = self.exposed_of(view.frame).lamplight
        found = lit[[camera.name for camera in self.cameras].index(view.camera)] if lit else None
        return None if found is None else np.array(found)

    def _latest[Value](self, known: Mapping[int, Value], frame: int, without: Value) -> Value:
        until = self.frames[: self.frames.index(frame) + 1]
        return next((known[n] for n in reversed(until) if n in known), without)

    def settings_of(self, frame: int) -> SceneSettings:
        """Return the settings of a frame."""
        # The names that it was written with stay in it: keys of passes depend on them.
        values = {**self.settings, **self.changes.get(frame, {})}
        return SceneSettings(**in_present_names(values))

    def has_layers(self, number: int) -> bool:
        """Whether a pass has layers: what is asked for, and alpha with the first."""
        wanted = parse_layers(self.settings.get("layers", NONE))
        return bool(wanted) or (self.output.transparent and number == 0)

    @property
    def method(self) -> Method:
        """How it is rendered."""
        return method_of(self.output.engine, self.output.mode)

    def weights(self, view: View) -> NDArray[np.float64]:
        """Return the weights that bands of a view are developed with, shape (3, n)."""
        return np.array(self.developments[view.development].weights)

    @property
    def noise(self) -> float:
        """ΔE2000 of the noise of a picture, until which parts are rendered; 0 for all of them."""
        return float(self.settings.get("noise", 0.0)) if self.method.traced else 0.0

    def camera(self, name: str) -> CameraOutput:
        """Return the camera of a name."""
        return next(camera for camera in self.cameras if camera.name == name)

    @functools.cached_property
    def parts(self) -> int:
        """Renders that make up a pass."""
        return 1 + max(item.part for item in self.passes)

    def folder(self, view: View) -> Path:
        """Return where the files of a view lie."""
        return self.out / self.camera(view.camera).folder

    def pass_path(self, view: View, number: int) -> Path:
        """Return the file of a pass."""
        part = f"_part_{self.passes[number].part:02d}" if self.parts > 1 else ""
        folder = (self.rendered_in or self.out) / self.camera(view.camera).folder
        return folder / _PASSES / f"{view.frame:04d}" / f"pass_{number // self.parts:02d}{part}.exr"

    def mean_path(self, view: View, number: int) -> Path:
        """Return the file of the mean of the parts of a pass, such as its first one."""
        name = f"pass_{number // self.parts:02d}.exr"
        return self.folder(view) / _PASSES / f"{view.frame:04d}" / name

    def tasks(self) -> Iterator[tuple[View, int]]:
        """Yield every pass of the job: its view and number."""
        for view in self.views:
            for number in range(len(self.passes)):
                yield view, number

    @functools.cached_property
    def drawing(self) -> dict[str, Any]:
        """What the passes of every frame depend on, besides settings and files."""
        values = asdict(self.output)
        for name in ("extent", "decisions", "denoise", "crop"):
            del values[name]
        if self.stage is not None:
            values["stage"] = self.stage.drawn
        return {"scene_sha256": self.scene_sha256, **values, "parts": self.parts}

    @functools.cached_property
    def contents(self) -> dict[str, ExternalFile]:
        """The files that the passes depend on, by what names them."""
        return {f.setting or f.path: f for f in self.files if self._counts(f.setting)}

    def rendered_settings(self, frame: int) -> dict[str, Any]:
        """Return the settings of a frame that its passes depend on; files count by content."""
        values = {**self.settings, **self.changes.get(frame, {})}
        found = {name: value for name, value in values.items() if self._counts(name)}
        # Passes do not depend on what is made of them.
        found["layers"] = sorted(drawn_for(parse_layers(values.get("layers", NONE))))
        for name, location in tables(found).items():
            found[name] = self._stand_in(name, location)
        if self.stage is not None:
            found["pose"] = astuple(self.stage.places[frame])
        return found

    def key(self, view: View, number: int) -> str:
        """Return what tells a pass from every other: a digest of all that it depends on."""
        item = self.passes[number]
        weights = self.developments[view.development].weights if self.method.draws_colours else ()
        path = self._paths.get(view.camera, ())
        return _digest([self._frame_key(view.frame), view.camera, astuple(item), weights, path])

    def view_key(self, view: View) -> str:
        """Return a digest of all that the pictures and the record of a view depend on."""
        values = {**self.settings, **self.changes.get(view.frame, {})}
        named = {name: self._stand_in(name, at) for name, at in tables(values).items()}
        return _digest(
            [
                [self.key(view, number) for number in range(len(self.passes))],
                {**values, **named},
                {file.setting: file.sha256 for file in self.files if file.setting},
                [self.output.denoise, self.output.crop],
                self.developments[view.development].weights,
            ]
        )

    @functools.cached_property
    def _paths(self) -> dict[str, list[tuple[float, ...]]]:
        """Where each camera is in all frames, which EEVEE's occlusion is computed for."""
        if self.method.traced:
            return {}
        found: dict[str, set[tuple[float, ...]]] = {}
        for view in self.views:
            found.setdefault(view.camera, set()).add(view.eye)
        return {camera: sorted(eyes) for camera, eyes in found.items()}

    def _stand_in(self, name: str, location: str) -> str:
        """Return what stands for a file, whose content counts.

        That differs by frame only of skies, whose names tell it.
        """
        path, part = split_location(location)
        by_frame = any(name in values for values in self.changes.values())
        return f"file{path.name if by_frame else ''}#{part}"

    def _counts(self, setting: str) -> bool:
        return setting not in SHOWN and (self.method.draws_colours or setting not in DEVELOPMENT)

    @functools.cached_property
    def _job_key(self) -> str:
        return _digest([self.drawing, {name: f.sha256 for name, f in self.contents.items()}])

    @functools.cached_property
    def _frame_keys(self) -> dict[int, str]:
        return {}

    def _frame_key(self, frame: int) -> str:
        known = self._frame_keys
        if frame not in known:
            known[frame] = _digest([self._job_key, frame, self.rendered_settings(frame)])
        return known[frame]


def _digest(value: object) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def changed[Value](values: Iterable[tuple[int, Value]], without: Value) -> dict[int, Value]:
    """Return what frames have, where it is not as at the frame before; undone by lookups."""
    found, before = {}, without
    for frame, now in values:
        if now != before:
            found[frame] = before = now
    return found


def settings_by_frame(
    settings: Iterable[tuple[int, SceneSettings]],
) -> tuple[dict[str, Any], dict[int, dict[str, Any]]]:
    """Return the settings of the first frame, and those of others that differ from these."""
    rows = [(frame, vars(each)) for frame, each in settings]
    base = dict(rows[0][1])
    others = {
        frame: {name: value for name, value in values.items() if value != base[name]}
        for frame, values in rows
    }
    return base, {frame: other for frame, other in others.items() if other}


def differences(earlier: Manifest, now: Manifest) -> list[str]:
    """Return the names of what the passes of two jobs depend on and do not share.

    Settings count by frame where both jobs have the frame; if none is in both, by what no
    keyframe can change.
    """
    before, after = earlier.drawing, now.drawing
    changed = [name for name in {**before, **after} if before.get(name) != after.get(name)]
    # Another version may draw the same job otherwise, or know better how far its water reaches.
    one, other = earlier.versions, now.versions
    changed += [name for name in {**one, **other} if one.get(name) != other.get(name)]
    old, new = earlier.contents, now.contents
    changed += [
        (new.get(name) or old[name]).what
        for name in {**old, **new}
        if name not in old or name not in new or old[name].sha256 != new[name].sha256
    ]
    shared = set(earlier.frames) & set(now.frames)
    pairs = [(earlier.rendered_settings(n), now.rendered_settings(n)) for n in sorted(shared)]
    if not pairs:
        still = {name for name, setting in SETTINGS.items() if not setting.animatable}
        firsts = (
            earlier.rendered_settings(earlier.frames[0]),
            now.rendered_settings(now.frames[0]),
        )
        pairs = [tuple({k: v for k, v in item.items() if k in still} for item in firsts)]
    for one, other in pairs:
        changed += [name for name in {**one, **other} if one.get(name) != other.get(name)]
    return list(dict.fromkeys(changed))


def tables(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return the location of each file that a setting names."""
    return {
        name: value.removeprefix("file:")
        for name, value in settings.items()
        if isinstance(value, str) and value.startswith("file:")
    }


def table_paths(settings: Mapping[str, Any]) -> dict[str, Path]:
    """Return each file that a setting names."""
    return {name: split_location(location)[0] for name, location in tables(settings).items()}


def folders(cameras: Sequence[str]) -> tuple[CameraOutput, ...]:
    """Return where the files of cameras go: those of a single one into the output folder itself."""
    if len(cameras) == 1:
        return (CameraOutput(cameras[0], ""),)

    def plain(name: str) -> str:
        return no_device("".join(c if c.isalnum() or c in "-_" else "_" for c in name) or "camera")

    found = plain_names(cameras, plain, taken=[_PASSES])
    return tuple(CameraOutput(name, folder) for name, folder in found.items())
