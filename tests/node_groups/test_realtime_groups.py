"""The real-time groups, rendered, against the same formulas in numpy, per pixel."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from underwater_spectral.node_groups.node_mathematics import NODES, Graph, new_group
from underwater_spectral.scene.water import frame_water
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import in_water_cosine, sun_travel_direction
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

# EEVEE writes half floats and the software rasteriser cuts the digits beyond.
HALF_STEP = 2.0**-10
TOLERANCE = 1e-3


def _column(n: int, a, b, **changes) -> WaterColumn:
    zenith = changes.pop("zenith", 40.0)
    values = {
        "sun_irradiance": np.linspace(0.8, 1.2, n),
        "sun_cosine": float(in_water_cosine(zenith)),
        "sun_direction": sun_travel_direction(zenith, 70.0),
        "sky_radiance": np.full(n, 0.05),
        "floor_depth": 9.0,
        "floor_reflectance": np.full(n, 0.3),
        "surface": "none",
        "refractive_index": 1.34,
    }
    return WaterColumn(Bands.uniform(n), a, b, **(values | changes))


def _errors(water, view, path, parts=(0, 1), *, edge=0.0):
    """Relative errors of nodes against numpy in parts of the picture."""
    seen = probe.render(water, view, path)
    wanted, where = probe.expected_of_projected(water, view)
    far = np.ones(where.shape, bool)
    if edge:
        # The edge of Snell's window is steeper than single precision.
        zenith = np.degrees(np.arccos(view.rays()[..., 2]))
        far = np.abs(zenith - np.degrees(np.arcsin(1 / 1.34))) > edge
    for part in parts:
        inside = (where == part) & far
        assert inside.sum() > 50
        yield (seen / wanted - 1)[inside]


@pytest.mark.parametrize(
    ("n", "phase", "surface"),
    [(3, "mixture", "flat"), pytest.param(80, "petzold", "none", marks=pytest.mark.slow)],
)
def test_groups_equal_numpy(tmp_path, n, phase, surface):
    wavelengths = Bands.uniform(n).centres
    a, b = 0.03 + 0.3 * ((wavelengths - 400) / 300) ** 2, 0.1 * 550 / wavelengths
    lobes = parse_phase(phase).for_bands(b, 0.003 * (550 / wavelengths) ** 4)
    column, view = _column(n, a, b, surface=surface), probe.View(5.0)
    weights = np.random.default_rng(n).uniform(0.5, 1.5, size=(3, n)) * 9 / n
    water = frame_water.realtime_water(column, lobes, view.depth, weights)
    for relative in _errors(water, view, tmp_path / "a.exr"):
        # Cut digits lie in [-HALF_STEP, 0]; what is left is the error of the nodes.
        assert np.abs(relative + HALF_STEP / 2).max() <= HALF_STEP / 2 + TOLERANCE
        assert np.abs(np.median(relative, axis=0)).max() <= TOLERANCE


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("sky", "surface"),
    [
        pytest.param("uniform", "flat", marks=pytest.mark.slow),
        pytest.param("overcast", "flat", marks=pytest.mark.slow),
        ("clear", "flat"),
        ("clear", "none"),
    ],
)
def test_sky_by_direction(tmp_path, empty_blender, sky, surface):
    """Seen directly, and scattered forward in front of an object."""
    a, b = np.array([0.05, 0.02, 0.1]), np.full(3, 0.1)
    lobes = parse_phase("hg:0.9").for_bands(b)
    column = _column(3, a, b, surface=surface, sky=sky, floor_depth=np.inf, zenith=55.0,
                     sky_radiance=np.array([0.2, 0.3, 0.5]))  # fmt: skip
    square = ((-3.0, 0.1, -3.0), (6.0, 0.0, 0.0), (0.0, 2.0, -1.0))
    # Away from the sun and towards it; a sunlit object would be rounded twice.
    for turn, parts in ((150.0, (0,)), (210.0, (0, 1))):
        view = probe.View(8.0, turn, 100.0, square=square)
        water = frame_water.realtime_water(column, lobes, view.depth, np.eye(3))
        for relative in _errors(water, view, tmp_path / "a.exr", parts, edge=1.0):
            assert np.abs(relative + HALF_STEP / 2).max() <= HALF_STEP / 2 + 2 * TOLERANCE


def test_numbers_are_computed_at_once():
    assert NODES.maximum(1.0, 2.0) == 2.0
    assert NODES.clamp(5.0, 0.0, 1.0) == 1.0


def test_equal_expressions_become_one_node():
    tree = new_group("test")
    tree.interface.new_socket("x", in_out="INPUT", socket_type="NodeSocketVector")
    graph = Graph(tree)
    x = graph.term(graph.node("NodeGroupInput").outputs[0])
    before = len(tree.nodes)
    total = NODES.exp(x * 2.0) + NODES.exp(x * 2.0)
    # Of each band an exponential.
    assert len(tree.nodes) - before == 1 + 5 + 1
    assert total.size == 3
    assert (x * 1.0) is x
    assert x * 0.0 == 0.0
    # numpy leaves the product to the term, which has it already.
    before = len(tree.nodes)
    assert np.float64(2.0) * x is x * 2.0
    assert len(tree.nodes) == before
    assert (x * 2.0).socket.node.operation == "MULTIPLY"


@pytest.mark.parametrize("slim", [False, True])
@pytest.mark.parametrize("kind", ["NodeSocketFloat", "NodeSocketVector"])
def test_products_become_one_node_with_a_sum(kind, slim):
    tree = new_group("test")
    tree.interface.new_socket("x", in_out="INPUT", socket_type=kind)
    tree.interface.new_socket("y", in_out="INPUT", socket_type=kind)
    graph = Graph(tree, 64 if slim else None, slim=slim, slim_numbers=slim)
    x, y = (graph.term(socket) for socket in graph.node("NodeGroupInput").outputs[:2])
    made = {
        "x y + x": x * y + x,
        "x + 2 y": x + y * 2.0,
        "2 x - 3": x * 2.0 - 3.0,
        "x - 2 y": x - y * 2.0,
        "3 - x y": 3.0 - x * y,
        "x y - y": x * y - y,
    }
    assert [term.socket.node.operation for term in made.values()][:4] == ["MULTIPLY_ADD"] * 4
    last = [term.socket.node.operation for term in made.values()][4:]
    assert last == ["MULTIPLY_ADD" if slim else "SUBTRACT"] * 2
    if not slim:
        _, _, addend = (s for s in made["2 x - 3"].socket.node.inputs if s.name != "Scale")
        assert np.ravel(addend.default_value)[0] == -3.0
        subtracted = made["x - 2 y"].socket.node.inputs[1]
        assert np.ravel(subtracted.default_value)[0] == -2.0


def test_interpolation_is_exact_at_and_between_the_points():
    xs, ys = [-3.0, -1.0, 0.5, 2.0], [1.0, 4.0, 2.0, 2.5]
    at = np.linspace(-4.0, 3.0, 29)
    # The ramps of the node version, with numbers in the place of terms.
    for x in at:
        assert NODES.interpolate(float(x), xs, ys) == pytest.approx(np.interp(x, xs, ys))


WATERS = {
    "clear": (0.005, 0.002),
    "turbid": (1.5, 8.0),
    "absorbing": (0.3, 0.0),
    "white": (0.0, 0.2),
    "empty": (0.0, 0.0),
    "coast": (0.2, 0.9),
}
TURNS = {"down": 0.0, "level": 90.0, "up": 180.0}
CASES = list(itertools.product(WATERS, TURNS, (1e-4, 200.0), (1e-3, 1.0, 1e3), (0.0, 89.9)))
# Steps that share no factor with the numbers of choices meet every pair of choices.
SOME, FEW = CASES[::7], CASES[3::41]


@pytest.mark.slow
@pytest.mark.parametrize("cases", [FEW, pytest.param(SOME, marks=pytest.mark.slow)])
def test_extremes_are_as_numpy_has_them(tmp_path, cases, empty_blender):
    weights = np.random.default_rng(3).uniform(0.5, 1.5, size=(3, 3))
    failures = []
    for water, turn, depth, distance, zenith in cases:
        a, b = (np.full(3, x) * (0.8, 1.0, 1.25) for x in WATERS[water])
        lobes = parse_phase("hg:0.924").for_bands(b, b)
        column = _column(3, a, b, zenith=zenith, floor_depth=np.inf)
        # Tilted: on a plane along the sunlight the engine's sun disc is what is seen.
        square = ((-1.5, -0.8, -1.0), (3.0, 0.0, 0.0), (0.0, 0.8, -0.6))
        square = tuple(tuple(distance * x for x in v) for v in square)
        clip = (min(0.01, 0.1 * distance), max(100.0, 10.0 * distance))
        view = probe.View(depth, TURNS[turn], 80.0, clip, square)
        # Exposed as a picture would be, or deep and turbid water leaves the range of half floats.
        white = float(column.Ed(min(depth, 50.0), lobes).max()) / np.pi
        exposed = weights / max(white, 1e-30)
        values = frame_water.realtime_water(column, lobes, depth, exposed)
        seen = probe.render(values, view, tmp_path / "a.exr")
        wanted, where = probe.expected_of_projected(values, view)
        inside = (where < 2) & ~((where == 1) & (probe.hit_depth(view) <= 0))
        assert np.isfinite(wanted[inside]).all()
        error, allowed = np.abs(seen - wanted)[inside], (2e-3 * np.abs(wanted) + 1e-6)[inside]
        if not np.isfinite(seen).all() or (error > allowed).any():
            worst = np.argmax(np.nan_to_num(error, nan=np.inf) / allowed)
            failures.append(
                f"{water} {turn} depth {depth} P {distance} zenith {zenith}: "
                f"{seen[inside].flat[worst]:.4g} for {wanted[inside].flat[worst]:.4g}"
            )
    assert not failures, "\n".join(failures)
