"""Metadata of Croissant: a set described so that loaders of machine learning read it."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from typing import Any

from .files import make_folder, relative, write_json, write_text
from .set_files import SetFiles

TABLE, NAME = "views.csv", "croissant.json"
_COLUMNS = {
    "name": ("Text", "name of the view"),
    "split": ("Text", "train, val or test"),
    "image": ("Text", "path of the picture"),
    "depth": ("Text", "path of planar depth, 16-bit PNG, mm, 0 where nothing is seen"),
    "instances": ("Text", "path of the numbers of the instances, 16-bit PNG"),
    "camera": ("Text", "name of the camera"),
    "water": ("Text", "the water, as --water takes it"),
    "lowered_m": ("Float", "metres that the scene is lowered by"),
    "width": ("Integer", "of the picture, pixels"),
    "height": ("Integer", "of the picture, pixels"),
    "fx": ("Float", "focal length, pixels"),
    "fy": ("Float", "focal length, pixels"),
    "cx": ("Float", "principal point from the upper left corner, pixels"),
    "cy": ("Float", "principal point from the upper left corner, pixels"),
    "camera_to_world": ("Text", "16 numbers, row by row: Blender's axes, m, as JSON"),
}
_OWN = (
    "citeAs", "column", "extract", "field", "fileObject", "fileProperty", "fileSet", "format",
    "includes", "isLiveDataset", "jsonPath", "key", "md5", "parentField", "path", "recordSet",
    "references", "regex", "repeated", "replace", "separator", "source", "subField", "transform",
)  # fmt: skip
"""Words of Croissant's own."""
_CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
    **{word: f"cr:{word}" for word in _OWN},
}


def write_croissant(files: SetFiles) -> None:
    """Write ``views.csv``, a row a view, and ``croissant.json``, which describes it.

    Source: MLCommons, *Croissant format specification* 1.0.
    """
    table = _table(files)
    write_text(make_folder(files.folder) / TABLE, table)
    card = files.card
    fields = [
        {
            "@type": "cr:Field",
            "@id": f"views/{name}",
            "name": name,
            "description": text,
            "dataType": f"sc:{kind}",
            "source": {"fileObject": {"@id": TABLE}, "extract": {"column": name}},
        }
        for name, (kind, text) in _COLUMNS.items()
    ]
    content = {
        "@context": dict(sorted(_CONTEXT.items())),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": card.title,
        "description": card.description or card.title,
        "license": card.licence_url or card.licence,
        "version": card.version,
        "distribution": [
            {
                "@type": "cr:FileObject",
                "@id": TABLE,
                "name": TABLE,
                "contentUrl": TABLE,
                "encodingFormat": "text/csv",
                "sha256": hashlib.sha256(table.encode()).hexdigest(),
            }
        ],
        "recordSet": [
            {
                "@type": "cr:RecordSet",
                "@id": "views",
                "name": "views",
                "description": "A row a view; paths are from the folder of this file.",
                "key": {"@id": "views/name"},
                "field": fields,
            }
        ],
    }
    write_json(files.folder / NAME, content)


def _table(files: SetFiles) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(_COLUMNS)
    for view in files.views:
        paths = [
            relative(path, files.folder) if path else ""
            for path in (view.image, view.depth, view.instance_map)
        ]
        known = [view.metadata.get(key, "") for key in ("camera", "water", "lowered_m")]
        camera = view.camera
        numbers = [camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy]
        pose = json.dumps(view.camera_to_world.ravel().tolist())
        rows.writerow([view.name, view.split, *paths, *known, *numbers, pose])
    return text.getvalue()
