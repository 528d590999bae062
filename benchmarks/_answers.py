"""Pictures, and questions with their answers, for docs/measured/outside.md."""

from __future__ import annotations

import re

from ._outside import MET, MISSED, OPEN, PARTLY, Row, Section, grid
from ._sunlight import entering
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
Renderers of other makers, and each of ours against the next, with the default phase function
under a clear sky; HG 0.8 is one row of each page. [Mitsuba](mitsuba.md): another path tracer
against Cycles, and [materials](mitsuba_materials.md) by it under water.
[Grey scene](grey_scene.md), [Snell's window](snell_window.md),
[solved light field](solved_accuracy.md), [shade](shade.md): EEVEE and formulas
against Cycles and the solution. [Real time](realtime_accuracy.md) has the paper's forms
beside them, and tails. [Look presets](preset_pictures.md): with two phase functions.

The first comparison of this kind with particles and a sky found an error: without a surface, Cycles
sampled the sky, and with two lobes in the water it then is 1 to 2 % too bright
(`test_two_lobes_without_a_surface`). It now finds the sky by its rays, as under a surface.
"""
    return rows, text


def answers() -> str:
    """The table of questions."""
    beyond = ", ".join(f"× {1 / entering(z):.2f} at {z:g}°" for z in (60.0, 75.0))
    variance = _found("forward_peak.md", r"bounded (median [\d.]+, worst [\d.]+)")[1]
    lines = [
        f"| {asked} | {answer} | {verdict} |"
        for asked, answer, verdict in (
            ("Phase function where molecules dominate",
             "presets with two phase functions: [looks](preset_pictures.md); three bands in a pass "
             "move the mean radiance by 0.5 %, Eu by 1 % at most: "
             "[reference_cost.md](reference_cost.md)", MET),
            ("Absorption between the rows of a table",
             "a - a_w is interpolated, Pope & Fry added; a below that of water (7 %, I, 650 to 700 "
             "nm) is kept and said: [physics.md](../physics.md#where-the-waters-come-from)", MET),
            ("Which source a Jerlov type has",
             "both visibilities in the panel and in [physics.md]"
             "(../physics.md#where-the-waters-come-from), the default argued; b is an inversion's",
             "said; b " + MISSED),
            ("Case 1 waters of one set",
             "[case 1](bio_optics.md#case-1-waters-against-measured-kd490-and-b): b is that "
             "of Loisel & Morel; Kd(490) solved -8 % at 1 mg/m³, -26 % at 10; the laws differ "
             "among themselves", PARTLY),
            ("Inversion of Kd with bb/b and sun",
             "[round trip](bio_optics.md#kd-inverted-round-trip): a within 2.8 % (median), 16 % "
             "(worst)", MET),
            ("Irradiance above or below the surface",
             f"each table by what it is; taken as if below, a sun would be {beyond} too bright "
             "(direct light; `test_light_is_taken_where_its_table_has_it`)", MET),
            ("Depolarisation, 730 nm, petzold, films, refractive index, SeaBASS",
             "[physics.md](../physics.md#what-is-approximated), "
             "[refractive_index.md](refractive_index.md); "
             "`tests/uw_spectral/water/test_seabass.py`", MET),
            ("A reference that converges: variance within 2 × of HG 0.9",
             f"20 cases: {variance}: [forward_peak.md](forward_peak.md)", MET),
            ("its bias: 1 % in means, 3 % beyond 3° from the sun",
             "by the solver means within 0.1 %, 95 % of directions within 3 %, not all; pictures "
             "of ten waters within 1.4 %, of which 0.9 % are noise: [reference_cost.md]"
             "(reference_cost.md#bias); 2 to 4 % too dark beside Snell's window in IB: "
             "[snell_window.md](snell_window.md)", PARTLY),
            ("CPU time at 2 % noise over ten waters, by settings",
             "[reference_cost.md](reference_cost.md)", MET),
            ("Tyler 1958", "[above](#tylers-radiance-distributions)", "median " + MET),
            ("Mobley 1993", "[all seven](#canonical-problems); 4 by ratios, its atmospheres differ",
             MET),
            ("Kd and b against measurement",
             "[above](#kd-and-b-against-measurement): measured, Petzold, Boss, Jerlov's profiles",
             PARTLY),
            ("Caustics within 20 % down to 10 m",
             "[above](#caustics-what-makes-them-too-strong): causes in numbers; 15 to 33 % too "
             "weak above 2 m", PARTLY),
            ("Raman light", "[above](#raman-light); inelastic target of 10 %: "
             "[inelastic.md](inelastic.md)", PARTLY),
            ("The papers' figures", "[paper_figures.md](paper_figures.md), "
             "[above](#the-papers-own-numbers), [constituents](bio_optics.md); the values of "
             "Gutierrez's Figure 5 are not in the text that we have", PARTLY),
            ("Pictures with the default phase function",
             "[above](#pictures), [realtime_accuracy.md](realtime_accuracy.md), "
             "[tradeoff.md](tradeoff.md)", MET),
            ("Errors of 10 % that fail a test",
             "[above](#planted-errors), [planted_errors.csv](planted_errors.csv)", MET),
            ("Lu of problems 1 and 2 on converged solutions",
             "1.706e-3, 1.296e-5, 7.87e-7, 3.115e-3 (`CONVERGED_LU`), to 2 %", MET),
            ("A real SeaBASS file to the end", "`test_a_real_cast_to_the_end`", MET),
            ("Bounds from outside instead of just above our numbers",
             "`tests/validation/test_outside.py`. Bounds of our own remain beside outside ones: "
             "round trips of Kd (`test_bio_optics.py`; outside `test_Kd_of_Lee_2005` and "
             "`test_Kd_of_types_whose_sun_is_known`), Ed in two streams "
             "(`test_path_radiance_disort.py`; outside `test_canonical_problems_in_closed_form`), "
             "plain caustics at 7 and 10 m, which miss (`test_caustics_sea.py`; outside, with the "
             "c-meter, `test_with_what_the_c_meter_does_not_see`)", MET + " but for caustics"),
            ("A photograph with measured water", "none was found", OPEN),
        )
    ]  # fmt: skip
    return f"""## Questions, and where they are answered

{grid("| question | answer | verdict |", lines)}

## What three bounds of tests rest on

- Six optimised bands, ΔE2000 against 150: 0.8, what half of all observers see
  (ISO/TR 28642:2016); found are 0.07 to 0.64 (`test_six_beat_eight_equal_bands`).
- One particle function for all bands, bb/b beyond 50 nm from 550 nm: 18 %; found are 16 %. Measured
  particles change more with wavelength than that one function leaves out: bb goes as
  λ^-0.94 (Snyder et al., Appl. Opt. 47, 666 (2008), 6000 spectra), b as λ^-0.1 to λ^-1.2 (Doxaran
  et al., Opt. Express 15 (2007)), so that bb/b turns by up to 18 % from 550 to 700 nm.
- a from an inverted Kd against the a of another inversion, median over ten types: 12 %; found are
  11 %. a measured in a type differs by 13 to 26 % between campaigns (Williamson & Hollins
  2022, in the table of Kd above). Against light of known waters it is 3 %.
"""
