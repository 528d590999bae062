"""The simulated farm does all the work, wastes no time that it need not, and saturates."""

from __future__ import annotations

from dataclasses import replace

import pytest
from underwater_spectral.benchmarks.farm_simulation import Costs, Order, Shot, simulate

FREE = Costs(start=0, render=10, spread=0, develop=2, latency=0, assign=0, boot=0)
COSTS = replace(FREE, start=3, spread=0.3, latency=1, assign=0.01, boot=20)
SHOT = Shot(frames=40, passes=5)


@pytest.mark.parametrize("order", Order)
def test_one_worker_without_overheads_takes_the_sum(order):
    found = simulate(SHOT, FREE, 1, order)
    assert found.seconds == pytest.approx(40 * (5 * 10 + 2))
    assert found.work == pytest.approx(found.seconds)
    assert found.efficiency == pytest.approx(1)
    assert (found.overhead, found.waiting) == (0, pytest.approx(0))


@pytest.mark.parametrize("order", Order)
def test_many_workers_take_the_longest_chain(order):
    found = simulate(SHOT, FREE, 1000, order)
    chain = {Order.BY_STEP: 10 + 10 * 2, Order.BY_FRAME: 10 + 2, Order.WHOLE_FRAMES: 5 * 10 + 2}
    assert found.seconds == pytest.approx(chain[order])


@pytest.mark.parametrize("order", Order)
@pytest.mark.parametrize("workers", [1, 7, 40, 300])
def test_time_is_work_overhead_or_waiting(order, workers):
    found = simulate(SHOT, COSTS, workers, order)
    assert found == simulate(SHOT, COSTS, workers, order)
    assert found.waiting >= -1e-6
    assert 0 < found.first_picture <= found.seconds
    assert found.overhead >= 3 * found.tasks
    # The work is the same, whoever does it.
    alone = simulate(SHOT, COSTS, 1, order)
    assert found.work == pytest.approx(alone.work)
    assert found.seconds <= alone.seconds
    assert found.tasks == {Order.BY_STEP: 204, Order.BY_FRAME: 240, Order.WHOLE_FRAMES: 40}[order]


def test_frames_that_are_developed_in_turn_are_there_earlier():
    by_step, by_frame = (simulate(SHOT, COSTS, 10, o) for o in (Order.BY_STEP, Order.BY_FRAME))
    assert by_frame.first_picture < by_step.first_picture / 5


def test_a_slow_scheduler_is_the_limit():
    found = simulate(SHOT, replace(FREE, assign=1), 1000, Order.BY_FRAME)
    assert found.seconds >= 240 - 1


def test_several_passes_a_task_save_starts():
    one, all_of_them = (
        simulate(replace(SHOT, passes_per_task=n), COSTS, 10, Order.BY_FRAME) for n in (1, 5)
    )
    assert all_of_them.overhead < 0.45 * one.overhead
    assert all_of_them.work == pytest.approx(one.work)
