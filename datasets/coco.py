"""Instance annotations of COCO, masks as compressed run lengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .card import DataCard
from .files import relative, write_json
from .instance_maps import box, visible_masks
from .set_files import SetFiles
from .view import SPLITS, DataSetView, category_numbers, check_views

_OFFSET = 48  # of the first printable code
_BITS = 5  # of a value that a character carries


def category_ids(views: Sequence[DataSetView]) -> dict[str, int]:
    """Number categories as the scene does; those that it does not number come after."""
    given = {
        item.category: item.category_id
        for view in views
        for item in view.instances
        if item.category_id is not None
    }
    others = category_numbers(views, first=1).keys() - given.keys()
    first = 1 + max(given.values(), default=0)
    found = given | {name: number for number, name in enumerate(sorted(others), first)}
    return dict(sorted(found.items(), key=lambda item: item[1]))


def write_coco(
    path: Path,
    views: Sequence[DataSetView],
    card: DataCard,
    categories: Mapping[str, int] | None = None,
) -> None:
    """Write instances as COCO does; those that are not seen are left out.

    Names of pictures are relative to the file's folder. ``categories`` are their numbers, such as
    :func:`category_ids` of a whole set of which the views are a split; by default those of the
    views. Raises InputError if there are no views, two share a name, or a file cannot be read or
    written.

    Source: T.-Y. Lin et al., ECCV 2014; cocodataset.org, *Data format*.
    """
    check_views(views)
    categories = category_ids(views) if categories is None else categories
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for image, view in enumerate(views, 1):
        images.append(
            {
                "id": image,
                "file_name": relative(view.image, path.parent),
                "width": view.camera.width,
                "height": view.camera.height,
                "license": 1,
            }
        )
        masks = visible_masks(view)
        for item in view.instances:
            mask = masks[item.number]
            if not mask.any():
                continue
            size = [view.camera.height, view.camera.width]
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": image,
                    "category_id": categories[item.category],
                    "segmentation": {"size": size, "counts": compressed(run_lengths(mask))},
                    "area": int(np.count_nonzero(mask)),
                    "bbox": box(mask),
                    "iscrowd": 0,
                }
            )
    write_json(
        path,
        {
            "info": {"description": card.title, "version": card.version},
            "licenses": [{"id": 1, "name": card.licence, "url": card.licence_url}],
            "categories": [{"id": n, "name": name} for name, n in categories.items()],
            "images": images,
            "annotations": annotations,
        },
    )


def write_coco_splits(files: SetFiles) -> None:
    """Write a file for each split."""
    categories = category_ids(files.views)
    for split in SPLITS:
        views = files.of_split(split)
        if views:
            write_coco(files.folder / f"coco_{split}.json", views, files.card, categories)


def run_lengths(mask: ArrayLike) -> list[int]:
    """Return the lengths of the runs of 0 and 1 in turn, down the columns, 0 first.

    Examples
    --------
    >>> run_lengths([[0, 1], [1, 1]])
    [1, 3]
    >>> run_lengths([[1, 0], [1, 0]])
    [0, 2, 2]
    """
    flat = np.asarray(mask, dtype=bool).ravel(order="F")
    changes = np.flatnonzero(np.diff(flat)) + 1
    lengths = np.diff([0, *changes.tolist(), flat.size]).tolist()
    return [0, *lengths] if flat.size and flat[0] else lengths


def compressed(lengths: list[int]) -> str:
    """Return run lengths as COCO's text.

    From the third on, a length is counted from that two before it. A number is written in
    parts of five bits, the lowest first, a sixth bit saying that more follow, and sign
    extension from the last.

    Examples
    --------
    >>> compressed([1, 3])
    '13'
    """
    text = []
    for place, length in enumerate(lengths):
        value = length - lengths[place - 2] if place > 2 else length
        while True:
            part = value & 0x1F
            value >>= _BITS
            done = value == (-1 if part & 0x10 else 0)
            text.append(chr(_OFFSET + (part if done else part | 0x20)))
            if done:
                break
    return "".join(text)
