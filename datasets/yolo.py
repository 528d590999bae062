"""Labels of YOLO as Ultralytics reads them: boxes, or outlines, as fractions of the picture."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .files import make_folder, place_file, write_text
from .instance_maps import box, visible_masks
from .set_files import SetFiles
from .view import SPLITS, category_numbers

Points = NDArray[np.int64]
Label = Callable[[NDArray[np.bool_]], NDArray[np.float64]]


def write_yolo_boxes(files: SetFiles) -> None:
    """Write ``class x y width height`` for every instance that is seen, below ``yolo``.

    Source: Ultralytics documentation, *Object detection datasets*.
    """
    _write(files, files.folder / "yolo", box_label)


def write_yolo_segments(files: SetFiles) -> None:
    """Write ``class x1 y1 x2 y2 ...`` for every instance that is seen, below ``yolo_segments``.

    Source: Ultralytics documentation, *Instance segmentation datasets*.
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


def outline(mask: NDArray[np.bool_]) -> Points:
    """Return one closed polygon that encloses a mask, shape (n, 2), x and y of pixels' corners.

    Parts and holes are joined by lines that are gone along twice, so that what lies inside by the
    even-odd rule is the mask exactly.
    """
    loops = _loops(mask)
    if not loops:
        return np.zeros((0, 2), np.int64)
    whole, *others = sorted(loops, key=len, reverse=True)
    for loop in others:
        apart = ((whole[:, None] - loop[None]) ** 2).sum(axis=-1)
        here, there = np.unravel_index(int(apart.argmin()), apart.shape)
        inner = np.roll(loop, -int(there), axis=0)
        whole = np.concatenate([whole[: here + 1], inner, inner[:1], whole[here:]])
    return whole


def _loops(mask: NDArray[np.bool_]) -> list[Points]:
    """Polygons with the mask to the right of the way, corners only."""
    inside = np.pad(np.asarray(mask, dtype=bool), 1)
    steps: defaultdict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    # Beside which the mask ends; where the edge starts, and where it leads, from the pixel.
    for (dy, dx), start, end in (
        ((-1, 0), (0, 0), (1, 0)),
        ((0, 1), (1, 0), (1, 1)),
        ((1, 0), (1, 1), (0, 1)),
        ((0, -1), (0, 1), (0, 0)),
    ):
        edge = inside & ~np.roll(inside, (-dy, -dx), axis=(0, 1))
        for y, x in np.argwhere(edge).tolist():
            steps[x - 1 + start[0], y - 1 + start[1]].append((x - 1 + end[0], y - 1 + end[1]))
    loops = []
    while steps:
        at = start = next(iter(steps))
        way, heading = [], (0, 0)
        while True:
            ahead = steps[at].pop()
            if not steps[at]:
                del steps[at]
            turned = (ahead[0] - at[0], ahead[1] - at[1])
            if turned != heading:
                way.append(at)
            at, heading = ahead, turned
            if at == start:
                break
        loops.append(np.array(way, dtype=np.int64))
    return loops
