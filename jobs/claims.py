"""Claims: one worker at a time renders a pass, without a server, in a folder that many share.

A claim is a file that is made only if it is not there. One that a dead process has left is taken
over. Should two workers ever render the same pass nevertheless, they write the same picture.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import platform
import time
import uuid
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from ..uw_spectral.errors import InputError

TIMEOUT = 12 * 3600.0
"""Seconds after which a claim of another machine is nobody's any more."""
_UNREADABLE = 30.0  # a claim without content is being written, unless it is older than this


@dataclass(frozen=True)
class Claim:
    """Who renders a pass; ``started`` tells a process from a later one of the same number.

    ``machine`` tells machines, and containers, of one name apart.
    """

    host: str
    pid: int
    time: float
    started: str
    token: str
    machine: str = ""


def claim_path(path: Path) -> Path:
    """Return the file of the claim on a file."""
    return path.with_name(f".{path.stem}.claim")


@contextlib.contextmanager
def claimed(path: Path, *, force: bool = False) -> Iterator[bool]:
    """Claim a file while the block runs, and say whether it is ours; if not, another worker has it.

    With ``force``, the claim of a living worker is taken over too. Raises InputError if the folder
    cannot be written to.
    """
    place = claim_path(path)
    mine = Claim(
        platform.node(),
        os.getpid(),
        time.time(),
        _started(os.getpid()),
        uuid.uuid4().hex,
        _machine(),
    )
    held = _make(place, mine)
    if not held:
        now = None if force else _time_in(place.parent)
        if now is None or not is_living(place, now):
            dead = _take_away(place, now)
            held = _make(place, mine)
            if held and dead is not None and not force:
                _sweep(path, dead)
    try:
        yield held
    finally:
        if held and (now := _read(place)) is not None and now.token == mine.token:
            place.unlink(missing_ok=True)


def is_living(place: Path, now: float | None = None) -> bool:
    """Whether a claim is there and its worker may still be at work.

    ``now`` is the time by the clock that dates the claim; else that of this machine counts.
    """
    try:
        age = (time.time() if now is None else now) - place.stat().st_mtime
    except OSError:
        return False
    found = _read(place)
    if found is None:
        return age < _UNREADABLE
    if age > TIMEOUT:
        return False
    here = found.host == platform.node() and found.machine == _machine()
    return not here or _is_running(found)


def _make(place: Path, claim: Claim) -> bool:
    try:
        with place.open("x", encoding="utf-8") as file:
            json.dump(asdict(claim), file)
    except FileExistsError:
        return False
    except OSError as error:
        with contextlib.suppress(OSError):
            place.unlink()
        raise InputError(
            f"cannot write to {place.parent}: {error.strerror}; choose another --out, or make room"
        ) from error
    return True


def _take_away(place: Path, now: float | None) -> Claim | None:
    """Remove the claim of a dead worker, and nobody else's that came meanwhile; return it.

    Without a time, that of a living one too.
    """
    aside = place.with_name(f"{place.name}.{uuid.uuid4().hex}")
    try:
        place.rename(aside)
    except OSError:  # another was quicker
        return None
    if now is not None and is_living(aside, now):
        with contextlib.suppress(OSError):
            if not place.exists():
                aside.rename(place)
                return None
    dead = _read(aside)
    with contextlib.suppress(OSError):
        aside.unlink()
    return dead


def _sweep(path: Path, dead: Claim) -> None:
    """Remove the temporary files of a dead worker."""
    for left in path.parent.glob(f".*{path.stem}.{dead.pid}.*"):
        with contextlib.suppress(OSError):
            left.unlink()


def _read(place: Path) -> Claim | None:
    try:
        return Claim(**json.loads(place.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def _time_in(folder: Path) -> float:
    """Return the time by the clock that dates the files of a folder, maybe another machine's."""
    probe = folder / f".{uuid.uuid4().hex}.clock"
    try:
        probe.touch(exist_ok=False)
        return probe.stat().st_mtime
    except OSError:
        return time.time()
    finally:
        with contextlib.suppress(OSError):
            probe.unlink()


@functools.cache
def _machine() -> str:
    """Return what tells this machine, and its numbers of processes, from a namesake's on Linux."""
    try:
        name = Path("/etc/machine-id").read_text().strip()
    except OSError:
        name = ""
    try:
        return f"{name} {Path('/proc/self/ns/pid').stat().st_ino}"
    except OSError:
        return name


def _is_running(claim: Claim) -> bool:
    if os.name == "nt":  # there, signal 0 would end the process
        return True
    try:
        os.kill(claim.pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return _started(claim.pid) == claim.started


def _started(pid: int) -> str:
    """Return when a process began, as Linux counts; empty elsewhere."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return ""
    fields = stat.rpartition(")")[2].split()
    return "" if fields[0] == "Z" else fields[19]
