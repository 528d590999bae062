"""What the wheel takes from the extension's manifest besides the version: its website."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface


class ManifestHook(MetadataHookInterface):
    """Gives the wheel the website of blender_manifest.toml, if there is one."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the website to what the wheel says of itself."""
        text = Path(self.root, "blender_manifest.toml").read_text(encoding="utf-8")
        website = tomllib.loads(text).get("website")
        metadata["urls"] = {"Homepage": website} if website else {}
