"""Which fast test catches an error of 10 % that is planted in the optics.

``python3 dev.py run -m benchmarks planted_errors [--outside] [NAME…]`` copies the checkout, plants
one error at a time, tests, and writes docs/measured/planted_errors.csv. Rows of others stay.
"""

from __future__ import annotations

import argparse
import csv
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .runner import ROOT

TABLE = ROOT / "docs" / "measured" / "planted_errors.csv"
OUTSIDE = "tests/validation/test_outside.py"
TESTS = ("tests/uw_spectral", OUTSIDE)
LONGEST = ("tests/uw_spectral/transfer/test_radiance_table_extremes.py",)
"""Left out: whether tables stay finite, which 10 % do not change."""
COLUMNS = ("error", "outside", "others")
"""Name; tests that failed, by semicolons: of :data:`OUTSIDE`, and of the optics."""


@dataclass(frozen=True)
class Error:
    """A change of one place of a file, from ``uw_spectral``.

    ``right`` is text that is there once, ``wrong`` what takes its place.
    """

    name: str
    file: str
    right: str
    wrong: str

    def planted(self, package: Path) -> str:
        """Text of the file in a package with the error in it; ValueError if it does not fit."""
        text = (package / self.file).read_text(encoding="utf-8")
        if text.count(self.right) != 1:
            raise ValueError(f"planted errors: {self.right!r} is not once in {self.file}")
        return text.replace(self.right, self.wrong)


ERRORS = (
    Error("b of a Jerlov type × 1.1", "water/optical_properties.py",
          "return self.scattering.at(wavelengths)", "return 1.1 * self.scattering.at(wavelengths)"),
    Error("Kd of a Jerlov type × 1.1", "water/optical_properties.py",
          "return self.diffuse_attenuation.at(wavelengths)",
          "return 1.1 * self.diffuse_attenuation.at(wavelengths)"),
    Error("Kd of Lee et al. (2005) × 1.1", "../validation/kd.py",
          "return (1 + 0.005 * sun_zenith) * a + 4.18",
          "return (1.1 + 0.0055 * sun_zenith) * a + 4.6"),
    Error("bb/b of the default particles × 1.1", "water/phase_functions.py",
          "backscatter: float = 0.0183", "backscatter: float = 0.0201"),
    Error("1 - χ of the phase moments × 1.1", "water/phase.py",
          "moments[order - 1] = 1 - np.sum(", "moments[order - 1] = 1 - 1.1 * np.sum("),
    Error("molecular scattering × 1.1", "water/pure_water.py",
          '"molecular scattering", name).at(wavelengths)',
          '"molecular scattering", name).at(wavelengths) * 1.1'),
    Error("absorption of pure water × 1.1", "water/pure_water.py",
          '"absorption of pure water", name).at(wavelengths)',
          '"absorption of pure water", name).at(wavelengths) * 1.1'),
    Error("Raman coefficient × 1.1", "water/inelastic_processes.py",
          "_RAMAN_488, _RAMAN_EXPONENT = 2.6e-4, 5.5",
          "_RAMAN_488, _RAMAN_EXPONENT = 2.86e-4, 5.5"),
    Error("Fresnel reflectance × 1.1", "surface/refraction.py",
          "return 0.5 * (perpendicular * perpendicular + parallel * parallel)",
          "return m.minimum(0.55 * (perpendicular * perpendicular + parallel * parallel), 1.0)"),
    Error("refractive index × 1.1", "surface/refraction.py",
          "np.sqrt(cosine**2 + (refractive_index**2 - 1)) / refractive_index",
          "np.sqrt(cosine**2 + (1.21 * refractive_index**2 - 1)) / (1.1 * refractive_index)"),
    Error("n² of the sky's radiance × 1.1", "transfer/sky.py",
          "(1.0 - reflected) * refractive_index**2, 0.0)",
          "(1.0 - reflected) * 1.1 * refractive_index**2, 0.0)"),
    Error("single scattering × 1.1", "transfer/solved_field.py",
          "source = layer.b * phase(layer, rays) * light.E / light.mu_s",
          "source = 1.1 * layer.b * phase(layer, rays) * light.E / light.mu_s"),
    Error("forward peak of delta-M × 0.9", "transfer/discrete_ordinates.py",
          "f = chi[count]\n", "f = 0.9 * chi[count]\n"),
)  # fmt: skip


def failures(error: Error | None, tests: Sequence[str] = TESTS) -> list[str]:
    """Plant an error in a copy of the checkout and return the names of the tests that fail."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "checkout"
        listed = subprocess.run(
            ["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True
        ).stdout
        for name in listed.splitlines():
            target = copy / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, target)
        if error is not None:
            package = copy / "uw_spectral"
            (package / error.file).write_text(error.planted(package), encoding="utf-8")
        options = ["-q", "--tb=no", "-rfE", "-p", "no:cacheprovider", "-p", "no:xdist"]
        options += [f"--ignore={name}" for name in LONGEST]
        run = subprocess.run(
            [sys.executable, "-m", "pytest", *tests, *options],
            cwd=copy, check=False, capture_output=True, text=True,
        )  # fmt: skip
    return re.findall(r"^(?:FAILED|ERROR) (\S+)", run.stdout, re.MULTILINE)


def rows() -> list[dict[str, str]]:
    """Return what was found last."""
    if not TABLE.exists():
        return []
    with TABLE.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _functions(tests: list[str]) -> str:
    """Names of the test functions, once each, without file and parameters."""
    return "; ".join(dict.fromkeys(test.split("::")[-1].partition("[")[0] for test in tests))


def main(arguments: list[str]) -> None:
    """Plant the errors that are named, or all, and write the table."""
    parser = argparse.ArgumentParser(prog="planted_errors")
    parser.add_argument("--outside", action="store_true", help="only tests with outside bounds")
    parser.add_argument("names", nargs="*", metavar="NAME", help="parts of names of errors")
    options = parser.parse_args(arguments)
    tests = (OUTSIDE,) if options.outside else TESTS
    found = {row["error"]: row for row in rows()}
    before = set(failures(None, tests))
    for error in ERRORS:
        if options.names and not any(name in error.name for name in options.names):
            continue
        failed = [test for test in failures(error, tests) if test not in before]
        outside = [test for test in failed if test.startswith(OUTSIDE)]
        others = _functions([test for test in failed if test not in outside])
        if options.outside:
            others = found.get(error.name, {}).get("others", "")
        found[error.name] = {
            "error": error.name, "outside": _functions(outside), "others": others
        }  # fmt: skip
        print(found[error.name], flush=True)
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(found[error.name] for error in ERRORS if error.name in found)
