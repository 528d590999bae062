"""Load the repository root as the package that Blender sees; a clean Blender for each test."""

from __future__ import annotations

import os
import runpy
import warnings
from collections import Counter
from pathlib import Path

import pytest

# Two processes share two processors: threads of both would spend most of their time waiting
# for each other. It must be said before numpy is there.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_ROOT = Path(__file__).resolve().parent.parent
runpy.run_path(str(_ROOT / "tools" / "load_checkout.py"))["load"]()


def pytest_addoption(parser):
    """Let the files be listed by what they cost."""
    parser.addoption("--costs", action="store_true", help="list seconds of each file")


def pytest_terminal_summary(terminalreporter, config):
    """Print seconds by file, set-up included, dearest first."""
    if not config.getoption("--costs"):
        return
    seconds = Counter()
    for kind in ("passed", "failed", "error", ""):
        for report in terminalreporter.getreports(kind):
            seconds[report.nodeid.partition("::")[0]] += getattr(report, "duration", 0.0)
    terminalreporter.section("seconds by file")
    for name, spent in seconds.most_common():
        terminalreporter.write_line(f"{spent:7.1f} {name}")


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
