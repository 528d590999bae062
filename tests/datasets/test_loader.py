"""Samples of the small set that is part of the project."""

import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
from underwater_spectral.datasets.loader import LoadedSet
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

SMALL = Path(__file__).parents[2] / "examples" / "datasets" / "reef_small"
FIELDS = ("image", "air", "depth", "instances", "K", "world_to_camera")


def test_samples_are_arrays_of_equal_shapes_that_stack():
    """As a batch of PyTorch's default takes them."""
    samples = LoadedSet(SMALL, FIELDS)
    assert len(samples) == 24
    batch = samples[:3]
    shapes = {"image": (3, 120, 160), "air": (3, 120, 160), "depth": (120, 160),
              "instances": (120, 160), "K": (3, 3), "world_to_camera": (4, 4)}  # fmt: skip
    for field, shape in shapes.items():
        assert np.stack([sample[field] for sample in batch]).shape == (3, *shape)
    assert {sample["water"] for sample in samples} == {"jerlov:IB", "jerlov:II", "jerlov:1C"}
    assert len(pickle.loads(pickle.dumps(samples))) == 24  # workers of a loader get it so


def test_they_are_the_files_of_their_view():
    sample = LoadedSet(SMALL, FIELDS, "test", ("jerlov:II",))[1]
    name = sample["name"]
    stored = np.moveaxis(read_exr(SMALL / "images" / f"{name}.jpg")[0], -1, 0)
    np.testing.assert_allclose(sample["image"], stored, atol=1e-6)
    assert 0.0 < sample["depth"].min() < 10.0
    assert len(np.unique(sample["instances"])) > 3
    assert (
        np.abs(sample["K"] - np.array([[110.1, 0, 79.5], [0, 110.1, 59.5], [0, 0, 1]])).max() < 0.1
    )


def test_what_is_in_air_is_of_the_same_pose_and_redder():
    """Its outlines are those of the picture in water: edges are where depth has them."""
    for sample in LoadedSet(SMALL, ("image", "air"), "train"):
        red, blue = sample["air"][0].mean(), sample["air"][2].mean()
        assert red / blue > 1.5 * sample["image"][0].mean() / sample["image"][2].mean()
    dry = LoadedSet(SMALL, ("image",), waters=("air",))
    pairs = {x["name"]: x["image"] for x in dry}
    sample = LoadedSet(SMALL, ("air", "world_to_camera"))[0]
    of = next(x for x in LoadedSet(SMALL, ("image", "world_to_camera"), waters=("air",))
              if np.array_equal(x["world_to_camera"], sample["world_to_camera"]))  # fmt: skip
    np.testing.assert_array_equal(pairs[of["name"]], sample["air"])


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (((), "training"), "no split 'training'"),
        ((("picture",),), "no field 'picture'"),
        ((("image",), "train", ("jerlov:9C",)), "jerlov:9C.*its waters are air, jerlov:1C"),
    ],
)
def test_what_is_not_there_is_told(arguments, told):
    with pytest.raises(InputError, match=told):
        LoadedSet(SMALL, *arguments)


def test_files_that_are_missing_are_told(tmp_path):
    with pytest.raises(InputError, match="let \\[output\\] of the set have it"):
        LoadedSet(SMALL, ("layer:J",))[0]
    with pytest.raises(InputError, match="dataset.json"):
        LoadedSet(tmp_path)
    shutil.copy(SMALL / "dataset.json", tmp_path)
    with pytest.raises(InputError, match="images"):
        LoadedSet(tmp_path, ("image",))[0]
