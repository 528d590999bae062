"""Find production code that nothing but tests or benchmarks uses; exit 1 if there is any.

    python3 dev.py run tools/unused_code.py

What only proves belongs in validation/ or in the tests; what nobody needs goes. Attributes that
are set and never read are Blender's own and do not count.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import vulture

_ROOT = Path(__file__).resolve().parent.parent
_PRODUCTION = (
    "uw_spectral", "quality", "settings", "datasets", "node_groups", "scene", "jobs", "ui",
    "presets", "registration.py", "__init__.py", "render_bands.py",
)  # fmt: skip
_USERS = ("tools", "examples", "flamenco", "deadline", "dev.py")
# Names that Blender, numpy or a reader of files asks for.
_ASKED_FOR = re.compile(
    r"bl_\w+|poll|poll_drop|invoke|modal|draw_header_preset|filename_ext|filter_\w+"
    r"|preset_\w+|__\w+__"
)
# For users of the package: readers of what it writes, published forms beside their inverse, text
# of operators. And formulas that nodes are made of, as numpy evaluates them.
_FOR_USERS = {
    "read_depth_exr", "read_formation", "write_plan", "blender_from_opencv", "Kd490_Morel2007",
    "raman_emission", "chlorophyll_emission", "a_range", "b_range", "TONES", "job_options",
    "pass_count", "bearing", "snow", "plankton", "path_light",
}  # fmt: skip


def main() -> int:
    """Print what is unused, a line each."""
    search = vulture.Vulture()
    search.scavenge([str(_ROOT / name) for name in (*_PRODUCTION, *_USERS)])
    found = [
        item
        for item in search.get_unused_code(min_confidence=60)
        if item.typ != "attribute"
        and item.filename.relative_to(_ROOT).parts[0] in _PRODUCTION
        and not _ASKED_FOR.fullmatch(item.name)
        and item.name not in _FOR_USERS
    ]
    for item in found:
        where = f"{item.filename.relative_to(_ROOT)}:{item.first_lineno}"
        sys.stdout.write(f"{where}: {item.typ} {item.name!r} is used by no production code\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
