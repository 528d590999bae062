"""Keep names to words that readers know; exit 1 with each that is not.

    python3 dev.py run tools/words.py

Public names of production (modules, classes, functions, parameters) are made of words of
``tools/vocabulary.txt`` or of the glossary. A new word goes there if it is the field's, Blender's
or plain English; a word of our own does not. Words that were given up do not come back.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

_ROOT = Path(__file__).resolve().parent.parent
_PRODUCTION = (
    "uw_spectral", "quality", "settings", "datasets", "node_groups", "scene", "jobs", "ui",
)  # fmt: skip
_GIVEN_UP = {
    "shade": "occlusion", "shades": "occlusion", "shaded": "occluded", "unshaded": "unoccluded",
    "disturbed": "probe_irradiance", "undisturbed": "unoccluded", "carried_light": "adjacency",
    "view_cover": "visibility_buffer", "forward_share": "point_spread",
    "thrown": "virtual_point_lights", "fold": "project", "usual": "typical, default, soft_limits",
    "unheeded": "unsupported", "said_of": "diagnostics",
    "apparent_places": "refraction_displacement", "mirrored_things": "planar_reflections",
    "window_view": "planar refraction", "three_bands": "representative_bands",
    "wide_phase": "delta_scaled_phase", "puff": "blob", "puffs": "blobs",
    "thing": "surface, object", "things": "surfaces, objects", "share": "fraction",
    "shares": "fractions", "light_left": "transmitted_light", "scattered_once": "single_scattering",
}  # fmt: skip
"""Words that were given up, and those in their place."""
_OTHERS = re.compile(r"share_passes|share[xy]|shade_(smooth|flat)")
"""Names in which they mean something else, and those of Blender and libraries."""


def words_of(name: str) -> list[str]:
    """Return the words of a name, in small letters.

    Examples
    --------
    >>> words_of("_SkyRadiance_ofHG2")
    ['sky', 'radiance', 'of', 'hg']
    """
    return [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]


def _paths() -> list[Path]:
    return sorted(path for top in _PRODUCTION for path in (_ROOT / top).rglob("*.py"))


def _public(path: Path) -> Iterator[tuple[str, int]]:
    """Yield public names of a file, and their lines."""
    yield path.stem, 1
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            if node.name.startswith("_"):
                continue
            yield node.name, node.lineno
            if isinstance(node, ast.FunctionDef):
                arguments = node.args
                for one in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
                    yield one.arg, one.lineno


def _names(path: Path) -> Iterator[tuple[str, int]]:
    """Yield all names of a file, and their lines."""
    yield path.stem, 1
    source = io.StringIO(path.read_text(encoding="utf-8"))
    for token in tokenize.generate_tokens(source.readline):
        if token.type == tokenize.NAME:
            yield token.string, token.start[0]


def _known() -> set[str]:
    text = (_ROOT / "tools" / "vocabulary.txt").read_text(encoding="utf-8")
    glossary = (_ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    terms = re.findall(r"^([^\n:#].*)\n: ", glossary, re.M)
    listed = " ".join(line for line in text.splitlines() if not line.startswith("#"))
    return {word.lower() for word in re.findall(r"[^\W\d_]+", " ".join([listed, *terms]))}


def main() -> int:
    """Print what is wrong, a line each."""
    known, found = _known(), set[str]()
    for path in _paths():
        where = path.relative_to(_ROOT)
        for name, line in _public(path):
            for word in words_of(name):
                if len(word) > 2 and not {word, word.removesuffix("s")} & known:
                    found.add(f"{where}:{line}: {name}: no word of the vocabulary: {word!r}")
        for name, line in _names(path):
            if _OTHERS.search(name):
                continue
            parts = f"_{'_'.join(words_of(name))}_"
            for word, better in _GIVEN_UP.items():
                if f"_{word}_" in parts:
                    found.add(f"{where}:{line}: {name}: {word!r} was given up for {better}")
    sys.stdout.write("".join(f"{line}\n" for line in sorted(found)))
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
