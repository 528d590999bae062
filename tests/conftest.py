"""Load the repository root as the package that Blender sees; a clean Blender for each test."""

from __future__ import annotations

import os
import runpy
import sys
import warnings
from collections import Counter
from pathlib import Path

import pytest

# Two processes share two processors: threads of both would spend most of their time waiting
# for each other. It must be said before numpy is there.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# To compile tests and modules anew takes each process longer than all else that it does at first.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Seconds of processors of the fast suite: six minutes of two, less what they wait.
BUDGET = 680

_ROOT = Path(__file__).resolve().parent.parent
runpy.run_path(str(_ROOT / "tools" / "load_checkout.py"))["load"]()


def pytest_addoption(parser):
    """Let the files be listed by what they cost."""
    parser.addoption("--costs", action="store_true", help="list processor seconds of each file")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark cases as slow but for the first; one that is asked for by name is the first."""
    begun = set()
    for item in items:
        if item.get_closest_marker("slow_but_first") and not item.get_closest_marker("slow"):
            if (test := item.nodeid.partition("[")[0]) in begun:
                item.add_marker("slow")
            begun.add(test)


def _processor_seconds() -> float:
    """Seconds of processors that this process and those that it waited for have used."""
    return sum(os.times()[:4])


class _Costs:
    """Notes on each report what was used since the last one; what others do at the time is apart.

    Parameters
    ----------
    start : float
        Used before the first test, to import and to collect.
    """

    def __init__(self, start: float) -> None:
        self._until, self._start = start, start

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self):
        """Put the seconds where the process that sums up finds them."""
        report = yield
        now = _processor_seconds()
        report.processor_seconds, report.start_seconds = now - self._until, self._start
        self._until, self._start = now, 0.0
        return report


def pytest_collection_finish(session):
    """Begin to count what tests cost."""
    session.config.pluginmanager.register(_Costs(_processor_seconds()))


def pytest_terminal_summary(terminalreporter, config):
    """Print seconds of processors by file, set-up included, dearest first, and their sum."""
    seconds = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            seconds["(start)"] += getattr(report, "start_seconds", 0.0)
            name = getattr(report, "nodeid", "").partition("::")[0]
            seconds[name] += getattr(report, "processor_seconds", 0.0)
    total = seconds.total()
    if config.getoption("--costs"):
        terminalreporter.section("seconds of processors by file")
        for name, spent in seconds.most_common():
            if spent >= 0.5:
                terminalreporter.write_line(f"{spent:7.1f} {name}")
        terminalreporter.write_line(f"{total:7.1f} together; the fast suite may take {BUDGET}")
    if total > BUDGET and config.option.markexpr == "not slow":
        terminalreporter.write_line(
            f"WARNING: these tests used {total:.0f} s of processors, more than the {BUDGET} s of "
            "the fast suite. Make some cheaper, or slow.",
            yellow=True,
        )


@pytest.fixture(autouse=True)
def coarse_occlusion(monkeypatch):
    """Few probes and voxels: what occlusion is worth has tests of its own."""
    from underwater_spectral.scene.readers import surroundings

    monkeypatch.setattr(surroundings, "PROBES", 300)
    monkeypatch.setattr(surroundings, "_COARSE", 5_000)


@pytest.fixture
def empty_blender():
    """Read an empty home file; bpy's own deprecation warnings are not ours.

    Preferences and add-ons stay: to read those anew takes five times as long.
    """
    import bpy

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    # Most of the time of a small picture is else spent on clearing half a gigabyte for shadows.
    bpy.context.scene.eevee.shadow_pool_size = "128"
    return bpy.context.scene


@pytest.fixture
def registered(empty_blender):
    """Register the whole extension; after it only the properties, which a batch expects."""
    import bpy
    from underwater_spectral import registration
    from underwater_spectral.scene import stored_settings

    # A batch of an earlier test may have registered the properties alone in this process.
    if hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.unregister()
    registration.register()
    yield bpy.context.scene
    registration.unregister()
    stored_settings.register()
