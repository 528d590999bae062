"""What a command line asks for of a data set, with the options that its specification gives."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

from ..datasets.specification import read_spec
from ..settings.scene_settings import flag
from ..uw_spectral.errors import InputError
from . import command_line

_DECIDED = ("quality", "target_delta_e", "time_budget")
_SET = {"sensor", "white_balance", "exposure"}  # by each [[camera]]


@dataclass(frozen=True)
class DataSetRequest:
    """What is asked for: a specification to plan and render, or a set to export."""

    spec: Path | None
    export: Path | None
    only_plan: bool


def request_of(options: argparse.Namespace) -> DataSetRequest | None:
    """Return what the options ask for of a data set; None if nothing."""
    spec, export = options.dataset, options.dataset_export
    if spec is None and export is None:
        if options.dataset_plan:
            raise InputError("--dataset-plan needs --dataset and a specification")
        return None
    if spec is not None and export is not None:
        raise InputError("--dataset exports in the end; leave out --dataset-export")
    given = vars(options)
    wrong = [flag(name) for name in _DECIDED if name in given]
    for name, there in (
        ("--plan", options.plan), ("--bundle", options.bundle), ("--from", options.manifest),
        ("--status", options.status), ("--frames", options.frames), ("--camera", options.camera),
        ("--cameras", options.cameras), ("--resolution", options.resolution),
        ("--seed", options.seed), ("--parts", options.parts != 1),
    ):  # fmt: skip
        wrong += [name] if there else []
    if wrong:
        raise InputError(
            f"{', '.join(wrong)}: not with a data set, whose specification names cameras, poses "
            "and seed; --dataset-plan plans, and --from OUT/dataset.json renders a fraction"
        )
    return DataSetRequest(spec, export, options.dataset_plan)


def with_render_options(options: argparse.Namespace, arguments: list[str]) -> argparse.Namespace:
    """Return the options with those of a specification, which the command line overrides."""
    if options.dataset is None:
        return options
    spec = read_spec(options.dataset)
    try:
        found = command_line.parse([*spec.render, *arguments])
    except InputError as error:
        raise InputError(f"{options.dataset}: [render], or the command line: {error}") from error
    both = [name for name in {*spec.settings, *_SET} if name in vars(found)]
    if both:
        named = ", ".join(flag(name) for name in sorted(both))
        raise InputError(f"{named}: {options.dataset} decides; change it there")
    return found
