"""Labels of YOLO as Ultralytics reads them: boxes, or outlines, as fractions of the picture."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .files import make_folder, place_file, write_text
from .instance_maps import box, visible_masks
from .outlines import outline
from .set_files import SetFiles
from .view import SPLITS, category_numbers

Label = Callable[[NDArray[np.bool_]], NDArray[np.float64]]


def write_yolo_boxes(files: SetFiles) -> None:
    """Write ``class x y width height`` for every instance that is seen, below ``yolo``.

    References
    ----------
    Ultralytics documentation, *Object detection datasets*.
    """
    _write(files, files.folder / "yolo", box_label)


def write_yolo_segments(files: SetFiles) -> None:
    """Write ``class x1 y1 x2 y2 ...`` for every instance that is seen, below ``yolo_segments``.

    References
    ----------
    Ultralytics documentation, *Instance segmentation datasets*.
    """
    _write(files, files.folder / "yolo_segments", segment_label)


def box_label(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return centre and size of the box around a mask, as fractions of width and height."""
    left, top, wide, high = box(mask)
    size = np.array(mask.shape[::-1], dtype=np.float64)
    return np.concatenate([(left + wide / 2, top + high / 2) / size, (wide, high) / size])


def segment_label(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the corners of the outline of a mask, as fractions of width and height."""
    return (outline(mask) / np.array(mask.shape[::-1], dtype=np.float64)).ravel()


def _write(files: SetFiles, root: Path, label: Label) -> None:
    numbers = category_numbers(files.views, first=0)
    splits = [split for split in SPLITS if files.of_split(split)]
    for split in splits:
        images, labels = (make_folder(root / kind / split) for kind in ("images", "labels"))
        for view in files.of_split(split):
            place_file(view.image, images / f"{view.name}{view.image.suffix}")
            masks, rows = visible_masks(view), []
            for item in view.instances:
                if masks[item.number].any():
                    values = " ".join(f"{value:.9g}" for value in label(masks[item.number]))
                    rows.append(f"{numbers[item.category]} {values}\n")
            write_text(labels / f"{view.name}.txt", "".join(rows))
    # Ultralytics asks for a train and a val; a set without one has it stand for the other.
    found = {split: split if split in splits else splits[0] for split in SPLITS[:2]}
    found |= {split: split for split in splits}
    lines = [f"{split}: images/{folder}" for split, folder in found.items()]
    lines += ["names:", *(f"  {number}: {json.dumps(name)}" for name, number in numbers.items())]
    write_text(root / "data.yaml", "\n".join(lines) + "\n")
