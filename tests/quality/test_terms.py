"""The table of terms fits the settings, the water column and the cost table."""

from __future__ import annotations

import math

import pytest
from underwater_spectral.benchmarks.option_costs import configurations
from underwater_spectral.quality.costs import COLUMNS, COSTED, priced
from underwater_spectral.quality.methods import METHODS
from underwater_spectral.quality.terms import (
    FLOOR,
    LIGHTS,
    SURFACE,
    TERMS,
    WAVES,
    column_of,
    in_column,
    settings_of,
    subsets,
    switched_on,
    with_and_without,
)
from underwater_spectral.settings.scene_settings import SETTINGS, SceneSettings
from underwater_spectral.settings.water_settings import NO_FLOOR
from underwater_spectral.tests.scene.columns import grey_column
from underwater_spectral.uw_spectral.spectra.spectrum import DATA_DIRECTORY, read_table

ALL = frozenset(term.name for term in TERMS)


def test_terms_are_settings_of_the_scene():
    for term in TERMS:
        setting = SETTINGS[term.setting]
        assert type(setting.default) is type(term.off) is type(term.on)
        assert not setting.choices or {term.off, term.on} <= set(setting.choices)
    assert next(term.off for term in TERMS if term.name == FLOOR) == NO_FLOOR
    names = [term.name for term in TERMS]
    assert len(ALL) == len(names)
    for term in TERMS:
        assert not term.needs or names.index(term.needs) > names.index(term.name)
    assert {light.needs for light in LIGHTS} <= {"", *ALL}


@pytest.mark.parametrize("options", subsets(ALL), ids=lambda o: " ".join(sorted(o)))
def test_settings_and_columns_say_which_terms_there_are(options):
    settings = SceneSettings(**settings_of(options))
    assert switched_on(vars(settings)) == options
    everything = {"surface": "waves", "floor_depth": 9.0, "sun_direction": (0.0, 0.0, -1.0)}
    column = grey_column(0.05, 0.1, **everything | column_of(options))
    of_column = {WAVES, SURFACE, FLOOR}
    assert in_column(column) == options & of_column


def test_waves_need_a_surface():
    assert len(subsets(ALL)) == 2 ** (len(TERMS) - 2) * 3
    assert all(SURFACE in options for options in subsets(ALL) if WAVES in options)
    surface = next(term for term in TERMS if term.name == SURFACE)
    assert with_and_without(surface, ALL) == (ALL - {WAVES}, ALL - {WAVES, SURFACE})
    assert column_of(ALL - {WAVES, SURFACE, FLOOR}) == {
        "surface": "none",
        "floor_depth": math.inf,
    }


def test_every_term_that_costs_is_measured():
    columns = read_table(DATA_DIRECTORY / "costs.csv", COLUMNS).columns
    assert tuple(columns) == COLUMNS
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    measured = {
        (list(METHODS)[int(row["method"]) - 1], frozenset(t.name for t in COSTED if row[t.name]))
        for row in rows
        if row["method"]
    }
    wanted = {(method.name, priced(options)) for method, options in configurations()}
    assert measured == wanted | {("reference", frozenset())}
