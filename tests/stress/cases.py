"""How the stress tests try many cases: the same ones each time, few normally, many when slow."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st


def few_or_many(few: int, many: int) -> pytest.MarkDecorator:
    """Parametrize a test with ``cases_``: few of them, and many under the mark slow."""
    return pytest.mark.parametrize("cases_", [few, pytest.param(many, marks=pytest.mark.slow)])


def try_cases(
    check: Callable[..., None],
    cases: int,
    record_property: Callable[[str, object], None],
    **strategies: st.SearchStrategy,
) -> None:
    """Call a check with so many drawn arguments, and record how many there were."""
    tried = 0

    @settings(
        max_examples=cases,
        derandomize=True,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=(Phase.explicit, Phase.generate, Phase.shrink),
    )
    @given(**strategies)
    def every(**drawn: object) -> None:
        nonlocal tried
        tried += 1
        check(**drawn)

    every()
    record_property("cases", tried)
