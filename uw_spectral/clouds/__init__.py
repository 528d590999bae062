"""Matter that floats in a part of the water: clouds of silt, plumes, blooms."""

from .gaussian_blob import GaussianBlob
from .matter import SuspendedMatter, suspended_matter
from .solved_cloud import Cloud

__all__ = ["Cloud", "GaussianBlob", "SuspendedMatter", "suspended_matter"]
