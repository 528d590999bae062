"""The batch render: command line in, pictures, spectra and records out."""

from __future__ import annotations

import argparse
import contextlib
import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import TextIO

import bpy

from ..datasets.index import is_index
from ..scene import stored_settings
from ..uw_spectral.errors import DataWarning, InputError
from ..uw_spectral.spectra.sensor import list_sensors
from ..uw_spectral.water.named import list_waters
from . import command_line, data_set_batch, scene_batch, split_batch
from .opening import SceneOpener
from .progress import Progress

_GO_ON = "The same command goes on; without a data set or --from, it takes --resume"


def main(
    arguments: Sequence[str], *, inside_blender: bool, program: str = "render_bands.py"
) -> int:
    """Run a batch and report errors in one line each.

    Returns 0 if everything was written, 2 if the input cannot be used, 130 if it was stopped.
    """
    try:
        with _notes_to_stderr():
            options = command_line.parse(arguments, program)
            options = data_set_batch.with_render_options(options, list(arguments))
            run(options, inside_blender=inside_blender)
    except InputError as error:
        print(f"{program}: {error}", file=sys.stderr)
        _print_failure(arguments, str(error))
        return 2
    except KeyboardInterrupt:
        print(f"\n{program}: stopped; finished passes stay. {_GO_ON}", file=sys.stderr)
        _print_failure(arguments, "stopped")
        return 130
    except SystemExit as stop:  # argparse, after --help
        return int(stop.code or 0)
    except BaseException as error:
        _print_failure(arguments, repr(error))
        raise
    return 0


def run(options: argparse.Namespace, *, inside_blender: bool) -> None:
    """Do what the options ask for; raise InputError if that cannot be done."""
    if options.list_sensors:
        print("\n".join(list_sensors()))
        return
    if options.list_waters:
        for source, names in list_waters().items():
            print(f"{source}: {', '.join(names)}")
        return
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    progress = Progress(options.progress, options.quiet)
    opener = SceneOpener(progress.note, options.scene, options.trust_scripts, inside_blender)
    if data_set_batch.is_wanted(options):
        data_set_batch.run(options, progress, opener)
        return
    split = command_line.split(options)
    if split.source is None:
        scene_batch.run(options, split, progress, opener)
        return
    way = data_set_batch.work_on if is_index(split.source) else split_batch.run
    way(split, split.source, options.blend, progress, opener)


@contextlib.contextmanager
def _notes_to_stderr() -> Iterator[None]:
    """Print caveats of the data as notes, other warnings as usual."""
    plain = warnings.showwarning

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if issubclass(category, DataWarning):
            print(f"note: {message}", file=sys.stderr)
        else:
            plain(message, category, filename, lineno, file, line)

    with warnings.catch_warnings():
        warnings.simplefilter("always", DataWarning)
        warnings.showwarning = show
        yield


def _print_failure(arguments: Sequence[str], text: str) -> None:
    if "openjd" in arguments or "--progress=openjd" in arguments:
        Progress("openjd").fail(text)
