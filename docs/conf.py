"""Sphinx builds the site from docs and docstrings: python3 dev.py site."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

# tools/build_site.py copies the pages; the code stays where it is.
ROOT = Path((Path(__file__).resolve().parent / "checkout.txt").read_text(encoding="utf-8"))
sys.path.insert(0, str(ROOT))

project = "Underwater Spectral"
author = "Underwater Spectral developers"
copyright = author  # noqa: A001 - as Sphinx wants it
_manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
release = _manifest["version"]
html_baseurl = _manifest.get("website", "")
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]
root_doc = "docs/index"
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # numpydoc says them
# A package lists what its modules hold; each thing has one place, that of its module.
autodoc_default_options = {"members": True, "show-inheritance": False, "ignore-module-all": True}
autodoc_mock_imports = ["bpy", "numba"]
default_role = "literal"
html_theme = "furo"
html_static_path = ["site"]
html_css_files = ["site.css"]
html_title = f"Underwater Spectral {release}"
html_theme_options = {"navigation_with_keys": True}
html_copy_source = False
html_show_sourcelink = False
