"""Pictures, for docs/measured/outside.md."""

from __future__ import annotations

import re

from ._outside import MET, MISSED, OPEN, PARTLY, Row, Section
from .path_radiance_table import ROOT


def _found(page: str, pattern: str) -> re.Match[str]:
    """Find what another page says; its generator may have changed."""
    text = (ROOT / "docs" / "measured" / page).read_text(encoding="utf-8")
    match = re.search(pattern, text, re.MULTILINE)
    if match is None:
        raise ValueError(f"docs/measured/{page}: no line like {pattern!r}")
    return match


_MATERIALS = (("diffuse ball", 3.0), ("rough metal ball", 3.0), ("plastic ball", None),
              ("glass pane", None))  # fmt: skip
"""Things under water, and the target in per cent where there is one."""


def _material(thing: str, target: float | None) -> Row:
    """Row of a thing under water; open if beyond the target by less than two errors."""
    page, words, missed, unsure = "mitsuba_materials.md", [], [], []
    for name in ("Cycles", "EEVEE"):
        line = _found(page, rf"^\| {thing} \| {name} / Mitsuba \|(.*)\| \*\*")[1]
        bands = [[float(x) for x in cell.split("±")] for cell in line.split("|")]
        words.append(f"{name} {' / '.join(f'{off:+.1f}' for off, _ in bands)} %")
        if target is None:
            continue
        if any(abs(off) > target + 2.0 * error for off, error in bands):
            missed.append(name)
        elif any(abs(off) > target for off, _ in bands):
            unsure.append(name)
    verdict = "–" if target is None else f"{OPEN} in {unsure[0]}" if unsure else MET
    return Row(
        f"{thing} under water, 450 / 550 / 650 nm",
        f"Mitsuba 3, [{page}](measured/{page})", ", ".join(words),
        "0" if target is None else f"0 ± {target:g} %",
        f"{MISSED} in {' and '.join(missed)}" if missed else verdict,
    )  # fmt: skip


def pictures() -> Section:
    """Pictures by renderers that share no code."""
    mean = _found("grey_scene.md", r"^\| \*\*mean, clear sky\*\* \| \| EEVEE \|(.*)$")[1]
    rmse, delta_e = re.findall(r"[\d.]+", mean)
    ratio = _found("mitsuba.md", r"^\| \*\*all with a clear sky\*\* .*\*\*(.*?)\*\* \|$")[1]
    found, error = (float(x) for x in ratio.split(" ± "))
    judged, middle, worst = _found(
        "realtime_accuracy.md",
        r"^Verdict, (\S+):[\s\S]*?ΔE2000\s([\d.]+)[\s\S]*?([\d.]+)\sat\sworst",
    ).groups()
    agree = MET if abs(found - 1.0) < 2.0 * error else MISSED
    rows = [
        Row("pictures, default phase function, clear sky: mean radiance over that of Cycles",
            "Mitsuba 3, [mitsuba.md](measured/mitsuba.md)", "1", ratio, agree),
        Row("the same: EEVEE as it ships, six waters and depths",
            "Cycles, [grey_scene.md](measured/grey_scene.md)",
            f"sRGB RMSE {rmse}, ΔE2000 {delta_e}", "0 (the eye sees ΔE2000 0.8)",
            PARTLY + ": shade is too bright in the red"),
        Row("the same in one pass, without the noise of the reference",
            "Cycles, [realtime_accuracy.md](measured/realtime_accuracy.md)",
            f"ΔE2000 {middle} in the median of six pictures, {worst} at worst",
            "0 (the eye sees ΔE2000 0.8)", judged),
        *(_material(*row) for row in _MATERIALS),
    ]  # fmt: skip
    text = """## Pictures
Renderers against each other, with the default phase function: [Mitsuba](mitsuba.md),
[materials](mitsuba_materials.md), [grey scene](grey_scene.md), [Snell's window](snell_window.md),
[solved light field](solved_accuracy.md), [shade](shade.md), [real time](realtime_accuracy.md),
[look presets](preset_pictures.md).
"""
    return rows, text
