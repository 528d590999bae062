"""The settings of a manifest's frames, resolved when they are needed."""

from __future__ import annotations

from ..settings.render_plan import RenderPlan, make_plan, quiet
from ..settings.scene_settings import SceneSettings
from .manifest import Manifest


class FramePlans:
    """Resolved settings by frame.

    Those that come first, such as the first frame's, are kept, and the latest
    other ones. Caveats of the data were told when the job was planned.
    """

    def __init__(self, manifest: Manifest) -> None:
        self._manifest = manifest
        self._first: tuple[SceneSettings, RenderPlan] | None = None
        self._latest: tuple[SceneSettings, RenderPlan] | None = None

    def of(self, frame: int) -> RenderPlan:
        """Return the plan of a frame; raise InputError if a file of its settings cannot be used."""
        chosen = self._manifest.settings_of(frame)
        for known in (self._first, self._latest):
            if known is not None and known[0] == chosen:
                return known[1]
        with quiet():
            self._latest = chosen, make_plan(chosen)
        self._first = self._first or self._latest
        return self._latest[1]
