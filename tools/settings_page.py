"""Write docs/settings.md, the reference of all settings, from their table.

python3 dev.py run tools/settings_page.py
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    import load_checkout

    load_checkout.load()

from underwater_spectral.settings.known_words import known_words
from underwater_spectral.settings.scene_settings import SETTINGS, flag
from underwater_spectral.settings.setting import SECTIONS, Setting

PAGE = Path(__file__).resolve().parent.parent / "docs" / "settings.md"
_HEAD = """# Settings

Every setting of the water, as the panel (*Advanced*), the command line and Python know it. In
Python they are properties of `bpy.context.scene.underwater`, by the names of the options with
underscores: `--sun-zenith` is `sun_zenith`. Those marked ◆ can be keyframed.
`render_bands.py --help` says the same, and what a job takes besides.

Azimuths and directions are where light, wind or water goes to, in degrees from +x towards +y.
*Sun From* in the panel is the compass bearing of the sun, from north (+y) over east (+x): 270° less
the azimuth. *Sun Elevation* is 90° less the zenith angle.
"""


def page() -> str:
    """Return the page."""
    return "\n".join([_HEAD, *_sections()])


def _sections() -> Iterator[str]:
    for name, section in SECTIONS.items():
        yield f"## {section.title}\n\n{section.text}.\n"
        yield "| in the panel | option | what it does | values | default |\n|---|---|---|---|---|"
        for setting in SETTINGS.values():
            if setting.section == name:
                yield _row(setting)
        yield ""


def _row(setting: Setting) -> str:
    label = f"{setting.label} ◆" if setting.animatable else setting.label
    option, default = flag(setting.name), setting.default
    if isinstance(default, bool):
        option, default = f"{option}, --no-{option.removeprefix('--')}", "on" if default else "off"
    text = setting.text
    if setting.engine:
        text += f"; for {'EEVEE' if setting.engine == 'eevee' else 'Cycles'} only"
    if setting.needs:
        text += f"; {_needs(setting)}"
    if setting.who == "researcher":
        text += " *(researchers)*"
    shown = f"`{default}`" if default != "" else "none"
    return f"| {label} | `{option}` | {text} | {_values(setting)} | {shown} |"


def _values(setting: Setting) -> str:
    if setting.choices:
        return "<br>".join(
            f"`{word}`: {text[:1].lower()}{text[1:]}" if text else f"`{word}`"
            for word, (_, text) in setting.choices.items()
        )
    if setting.known in {"illuminants", "phases", "filters"}:
        return "<br>".join(f"`{word}`" for word, _ in known_words(setting.known))
    return setting.facts


def _needs(setting: Setting) -> str:
    parts = []
    for name, values in setting.needs.items():
        words = " or ".join(f"`{value}`" for value in values)
        parts.append(f"`{flag(name)}` {words}" if values else f"a `{flag(name)}`")
    return f"needs {', '.join(parts)}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
