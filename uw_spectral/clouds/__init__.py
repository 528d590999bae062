"""Matter that floats in a part of the water: clouds of silt, plumes, blooms."""

from .matter import SuspendedMatter, suspended_matter
from .puff import Puff
from .solved_cloud import Cloud

__all__ = ["Cloud", "Puff", "SuspendedMatter", "suspended_matter"]
