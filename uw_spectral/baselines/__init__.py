"""Published forms, errors included, to compare with."""

from .monzon import path_radiance_Monzon2024, path_radiance_Monzon2024_corrected

__all__ = ["path_radiance_Monzon2024", "path_radiance_Monzon2024_corrected"]
