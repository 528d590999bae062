"""Resolves settings into everything a render of bands needs."""

from __future__ import annotations

