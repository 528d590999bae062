"""Damaged files of every kind end in one clear error that names the file, or in sound numbers."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from underwater_spectral.datasets.files import make_folder
from underwater_spectral.jobs import band_passes, batch, render_job
from underwater_spectral.tests.scene import manifests, scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import reduction
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.reflectance import parse_reflectance
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.spectra.spectral_image import (
    read_exr,
    read_spectral_exr,
    write_exr,
    write_spectral_exr,
)
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.water.named import parse_water

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


def _water(path):
    water = parse_water(f"file:{path}")
    return [water.absorption, water.scattering]


def _sensor(path):
    sensor = parse_sensor(f"file:{path}")
    try:
        weights = reduction(sensor, Bands.uniform(8), parse_illuminant("d65")).weights
    except InputError:  # nothing is seen in these bands
        return [sensor.sensitivity]
    return [sensor.sensitivity, Spectrum(np.arange(3.0), weights, "weights")]


def _light(path):
    light = parse_illuminant(f"file:{path}")
    return [light.direct, light.diffuse]


def _seabass(fields: str) -> str:
    return (
        "/begin_header\n/investigators=A_Diver\n/missing=-999\n/delimiter=comma\n"
        f"/fields={fields}\n/end_header\n"
    )


def _csv(rows) -> str:
    return "".join(",".join(map(str, row)) + "\n" for row in rows)


BY_BAND = [[400, 0.1, 0.2], [490, 0.05, 0.2], [600, 0.3, 0.2], [700, 0.7, 0.2]]
PARTICLES = [[400, 0.05, 0.5], [490, 0.03, 0.45], [600, 0.02, 0.4], [700, 0.01, 0.35]]
KD = [[row[0], row[1]] for row in BY_BAND]
CAST = [[y, 0.9**y, 0.95**y, 0.5**y] for y in (1, 2, 3, 4)]
RGB = [[400, 0, 0, 1], [500, 0, 1, 0], [600, 1, 0, 0], [700, 1, 0, 0]]
TABLES = {
    "water.csv": ("wavelength_nm,a,b\n", BY_BAND, _water),
    "kd.csv": ("wavelength_nm,Kd\n", KD, _water),
    "station.sb": (_seabass("wavelength,a,b"), BY_BAND, _water),
    "kd.sb": (_seabass("wavelength,kd"), KD, _water),
    "particles.sb": (_seabass("wavelength,agp,cgp"), PARTICLES, _water),
    "cast.sb": (_seabass("depth,ed443,ed490,ed670"), CAST, _water),
    "sensor.csv": ("wavelength_nm,R,G,B\n", RGB, _sensor),
    "light.csv": ("wavelength_nm,irradiance,diffuse\n", BY_BAND, _light),
    "paint.csv": ("wavelength_nm,reflectance\n", KD, lambda path: [parse_reflectance(str(path))]),
}
NO_TEXT = {
    "garbage": np.random.default_rng(0).bytes(500),
    "image": b"\x89PNG\r\n\x1a\n\x00\x00",
    "lost in a crash": bytes(400),
}
# What no reader may take; the rest may be read if every number in it is sound.
REFUSED = {
    "empty", "blank", "mark only", "UTF-16", "Latin-1", "no rows", "other columns",
    "ragged", "long cell", "long quote", "huge numbers", "nothing but text", *NO_TEXT,
}  # fmt: skip


def _damages(head: str, rows: list[list[float]]) -> dict[str, bytes]:
    good = head + _csv(rows)
    texts = {
        "blank": "\n\n \n",
        "no rows": head,
        "semicolons": good.replace(",", ";"),
        "tabs": good.replace(",", "\t"),
        "old Mac": good.replace("\n", "\r"),
        "other columns": head.replace("wavelength", "colour").replace("ed4", "xx4"),
        "twice the same": head + _csv(rows[:2] + rows[1:]),
        "downwards": head + _csv(rows[::-1]),
        "one row": head + _csv(rows[:1]),
        "ragged": good + "1\n",
        "open quote": good.replace("\n", '\n"', 1),
        "long cell": good + "9" * 200_000 + "\n",
        "long quote": head + '"' + "9" * 200_000,
        "all zero": head + _csv([row[0], *[0] * (len(row) - 1)] for row in rows),
        "huge numbers": head + _csv([row[0], *[1e308] * (len(row) - 1)] for row in rows),
        "tiny numbers": head + _csv([row[0], *[1e-320] * (len(row) - 1)] for row in rows),
        "negative wavelengths": head + _csv([-row[0], *row[1:]] for row in rows[::-1]),
        "micrometres": head + _csv([row[0] / 1000, *row[1:]] for row in rows),
        "beyond the tables": head + _csv([[row[0] - 200, *row[1:]] for row in rows]),
        "nothing but text": "There was a diver\nwho dived\n",
    }
    damages = {name: text.encode() for name, text in texts.items()} | NO_TEXT
    damages |= {"empty": b"", "mark only": b"\xef\xbb\xbf", "UTF-16": good.encode("utf-16")}
    damages["Latin-1"] = ("é" + good).encode("latin-1")
    for size in range(1, len(good), 7):
        damages[f"cut after {size}"] = good.encode()[:size]
    for cell in ("nan", "inf", "1e999", "-1", "1e300", "1e-320", "", "x", "0x10", "−1"):
        for column in range(len(rows[0])):
            changed = [list(row) for row in rows]
            changed[1][column] = cell
            damages[f"{cell} in column {column}"] = (head + _csv(changed)).encode()
    return damages


def _check(read, path: Path, damage: str) -> bool:
    """Read a file; return whether it was refused, with a message about that file."""
    try:
        spectra = read(path)
    except InputError as error:
        text = str(error)
        assert path.stem in text, (damage, text)
        assert len(text.replace(str(path), "")) < 400, (damage, text)
        assert text.isprintable(), (damage, text)
        assert any(mark in text for mark in (";", ". ", "?")), (damage, text)
        return True
    for spectrum in spectra:
        assert np.isfinite(spectrum.values).all(), damage
        assert (spectrum.values >= 0).all() or spectrum.name == "weights", damage
    return False


@pytest.mark.parametrize("name", TABLES)
def test_damaged_tables(name, tmp_path, record_property):
    head, rows, read = TABLES[name]
    path = tmp_path / name
    path.write_text(head + _csv(rows))
    assert not _check(read, path, "none")
    damages = _damages(head, rows)
    for damage, content in damages.items():
        path.write_bytes(content)
        refused = _check(read, path, damage)
        assert refused or damage not in REFUSED, damage
    record_property("cases", len(damages))


@pytest.mark.parametrize("name", [*TABLES, "sensor.json", "sensor.txt"])
def test_what_is_no_file(name, tmp_path, record_property):
    read = TABLES[name][2] if name in TABLES else _sensor
    stem, suffix = name.split(".")
    folder, loop = tmp_path / name, tmp_path / f"{stem}_loop.{suffix}"
    folder.mkdir()
    loop.symlink_to(loop)
    inside = tmp_path / "file"
    inside.write_text("")
    closed = tmp_path / f"{stem}_closed.{suffix}"
    closed.write_text("x")
    closed.chmod(0)
    paths = [
        folder, loop, closed, inside / name, tmp_path / f"{stem}_none.{suffix}",
        Path(f"{tmp_path}/{stem}{'x' * 300}.{suffix}"), Path(f"{tmp_path}/{stem}\udcff.{suffix}"),
        f"{tmp_path}/{stem}\0.{suffix}",
    ]  # fmt: skip
    for path in paths:
        with pytest.raises(InputError) as error:
            read(path)
        assert stem in str(error.value)
    record_property("cases", len(paths))


SPECTRAL = {"spectral_data": {"data": {"main": {str(r[0]): r[1:] for r in RGB}}}}


def _json(change) -> str:
    document = json.loads(json.dumps(SPECTRAL))
    change(document["spectral_data"]["data"]["main"])
    return json.dumps(document)


def test_damaged_sensor_files_of_other_kinds(tmp_path, record_property):
    path = tmp_path / "sensor.json"
    good = json.dumps(SPECTRAL)
    path.write_text(good)
    assert not _check(_sensor, path, "none")
    documents = {
        "nothing": "", "list": "[]", "number": "3", "null": "null", "deep": "[" * 100_000,
        "no data": '{"spectral_data": {}}', "text": '{"spectral_data": "x"}',
        "header": good[:-1] + ', "header": "x"}',
        "index": good.replace('"data"', '"index": {"main": ["X"]}, "data"', 1),
        "cell": _json(lambda main: main.update({"500": ["x", 1, 0]})),
        "short": _json(lambda main: main.update({"500": [1]})),
        "nan": _json(lambda main: main.update({"500": [float("nan"), 1, 0]})),
        "huge": _json(lambda main: main.update({"500": [1e300, 1, 0]})),
        "negative": _json(lambda main: main.update({"500": [-1, 1, 0]})),
        "wavelength": _json(lambda main: main.update({"blue": [1, 1, 0]})),
        "none": _json(dict.clear),
        **{f"cut after {n}": good[:n] for n in range(1, len(good), 11)},
    }  # fmt: skip
    for damage, text in documents.items():
        path.write_text(text)
        assert _check(_sensor, path, damage), damage
    path = tmp_path / "sensor.txt"
    row = " ".join(["0.5"] * 33)
    texts = {
        "good": f"A camera\n{row}\n{row}\n{row}\n",
        "short": f"A camera\n{row}\n{row}\n0.5\n",
        "words": f"A camera\n{row}\n{row}\n{row.replace('0.5', 'x', 1)}\n",
        "huge": f"A camera\n{row}\n{row}\n{row.replace('0.5', '1e300', 1)}\n",
        "nan": f"A camera\n{row}\n{row}\n{row.replace('0.5', 'nan', 1)}\n",
        "lines": f"A camera\n{row}\n",
        "empty": "",
    }
    for damage, text in texts.items():
        path.write_text(text)
        if damage in ("huge", "nan"):  # the message names the camera
            with pytest.raises(InputError, match="A camera"):
                _sensor(path)
        else:
            assert _check(_sensor, path, damage) == (damage != "good"), damage
    record_property("cases", len(documents) + len(texts))


def test_damaged_images(tmp_path, record_property):
    path = tmp_path / "image.exr"
    pixels = np.random.default_rng(1).random((9, 16, 3))
    write_spectral_exr(path, pixels, Bands.uniform(3))
    whole = path.read_bytes()
    assert band_passes.is_whole(path, (16, 9))
    cuts = range(0, len(whole) - 1, max(len(whole) // 60, 1))
    damaged = [whole[:cut] for cut in cuts]
    damaged += [b"", b"not an image", bytes(1000), np.random.default_rng(2).bytes(1000)]
    for content in damaged:
        path.write_bytes(content)
        for read in (read_exr, read_spectral_exr):
            with pytest.raises(InputError, match="image.exr"):
                read(path)
        assert not band_passes.is_whole(path, (16, 9))
    write_exr(path, pixels, ("R", "G", "B"))
    with pytest.raises(InputError, match="no spectral channels"):
        read_spectral_exr(path)
    assert not band_passes.is_whole(path, (9, 16))
    for widths in ("[1, 2]", "x", "[0, 1, 1]", '{"a": 1}', '["x", 1, 2]'):
        spec = oiio.ImageSpec(16, 9, 3, "float")
        spec.channelnames = ("S0.450,0nm", "S0.550,0nm", "S0.650,0nm")
        spec.attribute("bandWidths_nm", widths)
        output = oiio.ImageOutput.create(str(path))
        output.open(str(path), spec)
        output.write_image(pixels.astype(np.float32))
        output.close()
        with pytest.raises(InputError, match="width"):
            read_spectral_exr(path)
    for path in (tmp_path, tmp_path / "none.exr", tmp_path / ("x" * 300 + ".exr"), "a\0b"):
        with pytest.raises(InputError, match="check the path"):
            read_exr(path)
    record_property("cases", len(damaged) + 11)


def test_damaged_output_folders(tmp_path):
    """What an earlier run left, or somebody else put there."""
    planned = manifests.small_manifest(tmp_path / "out")
    record = planned.out / "job.json"
    planned.out.mkdir()
    for content in ("", "[]", "[1]", "3", "null", '"x"', "{", "\0", "\udcff"):
        record.write_bytes(content.encode(errors="surrogateescape"))
        with pytest.raises(InputError, match="Move it out of the folder"):
            render_job.begin(planned, resume=True)
    record.unlink()
    record.mkdir()
    with pytest.raises(InputError, match="job.json cannot be used: it is damaged"):
        render_job.begin(planned, resume=True)
    blocked = planned.out / "passes"
    blocked.write_text("")
    with pytest.raises(InputError, match="choose another --out"):
        make_folder(blocked / "0001")


def test_damaged_scenes(empty_blender, tmp_path, capfd, record_property):
    scenes.add_camera()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    whole = path.read_bytes()
    contents = [b"", b"BLENDER", b"BLENDER-v502", bytes(1000), np.random.default_rng(3).bytes(5000)]
    contents += [whole[: int(len(whole) * fraction)] for fraction in (0.001, 0.01)]
    paths = []
    for number, content in enumerate(contents):
        paths.append(tmp_path / f"damaged_{number}.blend")
        paths[-1].write_bytes(content)
    paths += [tmp_path, tmp_path / "none.blend", tmp_path / ("x" * 300 + ".blend")]
    for path in paths:
        arguments = [str(path), "--out", str(tmp_path / "out")]
        assert batch.main(arguments, inside_blender=False) == 2, path
        last = capfd.readouterr().err.strip().splitlines()[-1]
        assert last.startswith(f"render_bands.py: cannot open {path}"), last
    record_property("cases", len(paths))
