"""Take the water out of a picture, with its truth or from the picture alone.

python3 dev.py run examples/restore.py picture.exr depth.exr truth.json restored.png
python3 dev.py run examples/restore.py picture.exr depth.exr truth.json restored.png --blind

The picture is scene-linear Rec.709, as renders write it; ``depth.exr`` holds the channel
``range`` in m, infinite where open water is seen. Backscatter is removed and attenuation
inverted in the channels of the sensor, both by range (after Akkaynak & Treibitz, CVPR 2019).
With the truth, coefficients are those of the renderer; blind, they are fitted to the picture: the
darkest pixels of every range are taken for black, and their means for the same grey. From the
truth file comes then only what the camera is.
"""

from __future__ import annotations

import argparse
import importlib
import json
import runpy
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    """Restore one picture."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("picture", "depth", "truth", "restored"):
        options.add_argument(name, type=Path)
    options.add_argument("--blind", action="store_true", help="fit the water to the picture alone")
    given = options.parse_args()
    package = runpy.run_path(str(ROOT / "tools" / "load_checkout.py"))["load"]().__name__
    imaging = importlib.import_module(f"{package}.uw_spectral.imaging")
    images = importlib.import_module(f"{package}.uw_spectral.spectra.spectral_image")
    truth = importlib.import_module(f"{package}.datasets.truth")
    depth_maps = importlib.import_module(f"{package}.datasets.depth_maps")

    rgb, names = images.read_exr(given.picture)
    rgb = rgb[..., [names.index(name) for name in "RGB"]].astype(np.float64)
    z, _ = depth_maps.read_depth_exr(given.depth)
    to_rec709 = np.array(json.loads(given.truth.read_text())["sensor"]["to_linear_rec709"])
    seen = rgb @ np.linalg.inv(to_rec709).T
    if given.blind:
        formation = imaging.fit_formation(seen.reshape(-1, 3), z.ravel())
    else:
        formation = truth.read_formation(given.truth)
    restored = imaging.remove_water(seen, z, formation) @ to_rec709.T
    images.write_rgb_exr(given.restored.with_suffix(".exr"), restored)
    images.write_png(given.restored.with_suffix(".png"), restored)
    print(f"restored: {given.restored.with_suffix('.png')}")


if __name__ == "__main__":
    main()
