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

In the panel (*Advanced*), on the command line, and as properties of
`bpy.context.scene.underwater`: `--sun-zenith` is `sun_zenith`. Switches have an opposite:
`--shafts`, `--no-shafts`. `render_bands.py --help` says the same.

◆ can be keyframed; R for researchers; E in EEVEE only; C in Cycles only. In brackets: what it needs
to have an effect. Defaults are bold.

Azimuths and directions are where light, wind or water goes to, in degrees from +x towards +y.
*Sun From* in the panel is the compass bearing of the sun, from north (+y) over east (+x): 270° less
the azimuth. *Sun Elevation* is 90° less the zenith angle.
"""
_ENGINES = {"": "", "eevee": "E", "cycles": "C"}


def page() -> str:
    """Return the page."""
    return "\n".join([_HEAD, *_sections()])


def _sections() -> Iterator[str]:
    for name, section in SECTIONS.items():
        yield f"## {section.title}"
        yield from (_row(setting) for setting in SETTINGS.values() if setting.section == name)
        yield ""


def _row(setting: Setting) -> str:
    marks = "◆" * setting.animatable + "R" * (setting.who == "researcher")
    marks += _ENGINES[setting.engine]
    first = " ".join(filter(None, (f"*{setting.label}*", marks, f"`{flag(setting.name)}`")))
    needs = f" ({_needs(setting)})" if setting.needs else ""
    return f"- {first}: {setting.text}{needs}. {_values(setting)}"


def _values(setting: Setting) -> str:
    words = {word: text for word, (_, text) in setting.choices.items()}
    if setting.known in {"illuminants", "phases", "filters"}:
        words = dict.fromkeys((word for word, _ in known_words(setting.known)), "")
    parts = [_word(word, text, word == setting.default) for word, text in words.items()]
    if setting.default in words:
        return (". " if any(words.values()) else ", ").join(parts)
    default, (low, high) = setting.default, setting.limits
    shown = ("off", "on")[default] if isinstance(default, bool) else f"`{default}`"
    span = "" if low == float("-inf") else f"{low:g}…{high:g}"
    named = "none" if default == "" else shown
    return ", ".join(filter(None, (*parts, setting.unit, span, f"**{named}**")))


def _word(word: str, text: str, is_default: bool) -> str:
    shown = f"**`{word}`**" if is_default else f"`{word}`"
    return f"{shown}: {text}" if text else shown


def _needs(setting: Setting) -> str:
    return ", ".join(_need(flag(name), values) for name, values in setting.needs.items())


def _need(option: str, values: tuple[object, ...]) -> str:
    if values == ("",):
        return f"without `{option}`"
    return f"`{' '.join(filter(None, (option, '/'.join(map(str, values)))))}`"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
