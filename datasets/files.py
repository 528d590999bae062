"""Files of a data set: written whole, and named from where they are read."""

from __future__ import annotations

import json
import os
import re
import shutil
import unicodedata
from collections.abc import Callable, Iterable
from pathlib import Path, PureWindowsPath
from typing import Any

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import replacing

_DEVICE = re.compile(r"^(con|prn|aux|nul|com\d|lpt\d)(?=\.|$)", re.IGNORECASE)
"""Names that Windows keeps for itself, with any suffix."""
_PLAIN_LIST = re.compile(r"\[\n\s*([^\[\]{}\"]*?)\n\s*\]")
"""A list of numbers over several lines; in text of JSON a new line is written as backslash n."""


def write_text(path: Path, text: str) -> None:
    """Write a text file; whole under its name, or not at all. Raises InputError if it cannot."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:  # noqa: ANN401 - what JSON holds
    """Write a JSON file, lists of numbers on a line; refuse what JSON does not hold: NaN."""
    try:
        text = json.dumps(content, indent=1, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"cannot write {path}: {error}; JSON holds text and finite numbers") from (
            error
        )
    write_text(path, _PLAIN_LIST.sub(lambda found: f"[{' '.join(found[1].split())}]", text) + "\n")


def relative(path: Path | str, folder: Path) -> str:
    r"""Return a path as seen from a folder, with forward slashes.

    What lies on another drive, or on another kind of machine, keeps its whole path.

    Examples
    --------
    >>> relative(Path("/set/images/a.png"), Path("/set/colmap"))
    '../images/a.png'
    """
    if _is_elsewhere(path):
        return str(path)
    try:
        return Path(os.path.relpath(Path(path).absolute(), folder.absolute())).as_posix()
    except ValueError:  # another drive
        return str(path)


def joined(path: str, folder: Path) -> str:
    r"""Return the path of a file that :func:`relative` told as seen from a folder.

    Examples
    --------
    >>> joined(r"D:\tables\w.csv", Path("/jobs"))
    'D:\\tables\\w.csv'
    """
    return path if _is_elsewhere(path) else os.path.normpath(folder / path)


def _is_elsewhere(path: Path | str) -> bool:
    """Whether a path is a whole one of another kind of machine; a rule of the farm moves it."""
    whole = str(path).startswith("/") or bool(PureWindowsPath(path).drive)
    return whole and not Path(path).is_absolute()


def make_folder(path: Path) -> Path:
    """Make a folder and those above it, and return it; raise InputError where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write to {path}: {error.strerror}; choose another --out"
        ) from error
    return path


def place_file(source: Path, target: Path) -> None:
    """Put a file under a second name; a copy where the disk knows no links."""
    if not source.is_file():
        raise InputError(f"cannot read {source}: there is no such file; render it first")
    with replacing(target) as temporary:
        try:
            os.link(source, temporary)
        except OSError:
            shutil.copyfile(source, temporary)


def plain_name(*words: str) -> str:
    """Return a name of a file or folder that every disk takes.

    Names that differ may become alike: :func:`plain_names` tells them apart.

    Examples
    --------
    >>> plain_name("orbit of poses[0]", "jerlov:IB")
    'orbit_of_poses_0_-jerlov_IB'
    >>> plain_name("左"), plain_name("con.old")
    ('unnamed', 'con_.old')
    """
    found = re.sub(r"[^A-Za-z0-9.-]+", "_", "-".join(words)).strip("_.") or "unnamed"
    return no_device(found)


def no_device(name: str) -> str:
    """Return a name that is none of those that Windows keeps for itself."""
    return _DEVICE.sub(r"\1_", name)


def plain_names(
    names: Iterable[str], plain: Callable[[str], str] = plain_name, taken: Iterable[str] = ()
) -> dict[str, str]:
    """Return a name of a file for each of several, no two alike, in large letters or small.

    Earlier ones keep theirs, so that more can be added at the end. ``plain`` makes such a name of
    one; ``taken`` are there already.

    Examples
    --------
    >>> plain_names(["左", "右", "Left", "left"])
    {'左': 'unnamed', '右': 'unnamed_2', 'Left': 'Left', 'left': 'left_2'}
    """
    found, used = {}, {_projected(name) for name in taken}
    for name in dict.fromkeys(names):
        base = candidate = plain(name)
        count = 1
        while _projected(candidate) in used:
            count += 1
            candidate = f"{base}_{count}"
        used.add(_projected(candidate))
        found[name] = candidate
    return found


def _projected(name: str) -> str:
    """Return what is equal for names that some disk does not tell apart."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFKC", name).casefold())
