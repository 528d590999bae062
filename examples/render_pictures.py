"""Render the pictures of the gallery: three waters through two cameras.

python3 dev.py run examples/render_pictures.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WATERS = ("I", "IB", "II")
# File name → camera and the light it is balanced for.
CAMERAS = {"arri": ("ARRI D21", "depth"), "nikon": ("Nikon D7000", "daylight")}
OPTIONS = [
    *("--bands", "9", "--illuminant", "clear-sky"),
    *("--sun-zenith", "30", "--sun-azimuth", "60", "--irradiance", "above"),
    *("--floor-depth", "7", "--floor-reflectance", "0.3", "--surface", "flat"),
    *("--resolution", "384", "216", "--samples", "48", "--resume"),
]


def main() -> None:
    """Render each water once and develop it through each camera."""
    import OpenImageIO as oiio  # noqa: N813

    scene = ROOT / "out" / "reef.blend"
    pictures = ROOT / "docs" / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    if not scene.exists():
        build = [sys.executable, ROOT / "examples" / "build_scene.py", "reef", scene]
        subprocess.run(build, check=True)
    for water in WATERS:
        out = ROOT / "out" / "pictures" / water
        for short, (camera, balance) in CAMERAS.items():
            command = [sys.executable, ROOT / "render_bands.py", scene, *OPTIONS]
            command += ["--water", f"jerlov:{water}", "--sensor", camera, "--white-balance"]
            command += [balance, "--out", out]
            subprocess.run(command, check=True)
            picture = oiio.ImageBuf(str(out / "0001.png"))
            picture.specmod().attribute("Compression", "jpeg:90")
            picture.write(str(pictures / f"{water}_{short}.jpg"))


if __name__ == "__main__":
    main()
