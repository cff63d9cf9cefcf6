"""Ticks are counted: none is lost, none comes twice, whatever the importer's times look like."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from host import ERROR, OK, Instance, Library, Replay
from numpy.typing import NDArray

ReplayOf = Callable[[Instance], Replay]
LEVEL = [0.0, 0.0, -9.8]
# Without accelerometer and magnetometer every tick turns the attitude by the same angle.
TURNING = np.array([[0.3, 0.1, -0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
MILLION = 1_000_000


def ticks_of(instance: Instance) -> int:
    """Ends the run and reads from the log how many ticks it had."""
    assert instance.call("Terminate") == OK
    match = re.search(r"after (\d+) ticks", instance.log[-1].message)
    assert match is not None
    return int(match[1])


def run(library: Library, start: float, sample_time: float = 0.01) -> Instance:
    return library.instance(logging=True).run(start, sample_time=sample_time, accel=LEVEL)


def added_up(start: float, step: float, count: int) -> NDArray[np.float64]:
    """Communication points of an importer that adds the step again and again."""
    return np.cumsum(np.concatenate([[start], np.full(count - 1, step)]))


@pytest.mark.parametrize(("start", "sample_time"), [(0.0, 0.01), (1e5, 0.001)])
@pytest.mark.parametrize("adds_up", [True, False])
def test_a_million_steps_of_one_tick_are_a_million_ticks_one_each(
    start: float, sample_time: float, adds_up: bool, load: Callable[..., Library], replay_of: ReplayOf
) -> None:
    instance = run(load("3"), start, sample_time)
    k = np.arange(MILLION)
    points = added_up(start, sample_time, MILLION) if adds_up else start + k * sample_time
    q = replay_of(instance)(points, sample_time, np.where(k == 0, 0, -1), TURNING)
    assert not np.any(np.all(q[1:] == q[:-1], axis=1))
    assert ticks_of(instance) == MILLION


@pytest.mark.parametrize("start", [0.0, 1e5])
@pytest.mark.parametrize("step", [Fraction(4, 1000), Fraction(1, 60), Fraction(1, 7), Fraction(333, 100_000)])
@pytest.mark.parametrize("times", ["adds up", "multiplies", "differences"])
def test_steps_that_are_no_ticks_reach_each_tick_in_its_step(
    start: float, step: Fraction, times: str, load: Callable[..., Library], replay_of: ReplayOf
) -> None:
    count = 20_000
    instance = run(load("2"), start)
    points = added_up(start, float(step), count + 1)
    if times != "adds up":
        points = start + np.array([float(k * step) for k in range(count + 1)])
    length = np.diff(points) if times == "differences" else float(step)
    q = replay_of(instance)(points[:-1], length, np.where(np.arange(count) == 0, 0, -1), TURNING)
    ticks = (np.arange(count + 1) * step.numerator * 100) // step.denominator
    changed = np.any(np.diff(q, axis=0) != 0, axis=1)
    np.testing.assert_array_equal(changed, np.diff(ticks[1:]) > 0)
    assert ticks_of(instance) == ticks[-1]


def test_an_importer_whose_times_and_steps_disagree_a_little_is_followed_by_its_times(
    load: Callable[..., Library], replay_of: ReplayOf
) -> None:
    count = 60_000
    instance = run(load("3"), 0.0)
    points = np.arange(count) / 60
    replay_of(instance)(points, 0.016667, np.where(np.arange(count) == 0, 0, -1), TURNING)
    assert ticks_of(instance) == 100_000


def test_time_is_the_communication_point(library: Library) -> None:
    instance = library.instance().run(3.0)
    assert instance.get("time") == 3.0
    assert instance.step(3.0, 0.025) == OK
    assert instance.get("time") == 3.025


def test_outputs_hold_between_ticks(library: Library) -> None:
    instance = library.instance().run(accel=[0.5, 0.0, -9.8], mag=[2e-5, 0, 4e-5], gyro=[0.2, 0, 0])
    first = instance.get("q")
    assert instance.step(0.0, 0.009) == OK
    assert instance.set("gyro", [3.0, 1.0, 0.0]) == OK
    np.testing.assert_array_equal(instance.get("q"), first)
    assert instance.step(0.009, 0.001) == OK
    assert np.any(instance.get("q") != first)


def test_the_first_output_is_the_attitude_of_the_first_inputs(library: Library) -> None:
    instance = library.instance()
    roll = np.radians(25.0)
    instance.set("accel", [0.0, -9.81 * np.sin(roll), -9.81 * np.cos(roll)])
    assert instance.start() == OK
    np.testing.assert_allclose(instance.get("roll"), roll, atol=1e-12)
    instance.set("accel", [0.0, 9.81 * np.sin(roll), -9.81 * np.cos(roll)])
    np.testing.assert_allclose(instance.get("roll"), -roll, atol=1e-12)
    assert instance.call("ExitInitializationMode") == OK
    np.testing.assert_allclose(instance.get("roll"), -roll, atol=1e-12)


def test_without_usable_inputs_the_first_output_is_identity_and_says_so(library: Library) -> None:
    instance = library.instance().run()
    np.testing.assert_array_equal(instance.get("q"), [1, 0, 0, 0])
    assert instance.get("status") == 9


def test_a_million_ticks_in_one_step_are_run_and_one_more_is_refused(load: Callable[..., Library]) -> None:
    instance = run(load("2"), 0.0, 0.001)
    before = instance.serialise()
    assert instance.step(0.0, 1000.0011) == ERROR
    assert "1000000 ticks" in instance.log[-1].message
    assert instance.serialise() == before
    assert instance.step(0.0, 1000.0) == OK
    assert ticks_of(instance) == MILLION


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("point", "step"),
    [
        *((point, 0.01) for point in (NAN, INF, -INF, -0.01, 0.5, 0.0005, 1e300)),
        *((0.0, step) for step in (NAN, INF, -INF, -0.01, 1e5, 1e18, 1e300)),
        (1e300, 1e300),
    ],
)
def test_a_step_from_nowhere_or_without_end_is_refused_at_once_and_changes_nothing(
    point: float, step: float, library: Library
) -> None:
    instance = library.instance().run(accel=[0.1, 0, -9.8])
    before = instance.serialise()
    started = time.monotonic()
    assert instance.step(point, step) == ERROR
    assert time.monotonic() - started < 1.0
    line = instance.log[-1]
    assert line.category == "logStatusError"
    assert line.message.startswith(f"fmi{library.version}DoStep: ")
    assert instance.serialise() == before
    assert instance.step(0.0, 0.01) == OK
    instance.free()


@pytest.mark.parametrize("start", [NAN, INF, -INF, -1.0, 1e300])
def test_a_start_that_is_no_time_is_refused(start: float, library: Library) -> None:
    instance = library.instance()
    assert instance.start(start) == ERROR
    assert "start time" in instance.log[-1].message
    assert instance.start(0.0) == OK
    instance.free()


def test_steps_of_no_length_do_nothing(library: Library) -> None:
    instance = library.instance().run(accel=[0.1, 0, -9.8])
    before = instance.serialise()
    assert instance.step(0.0, 0.0) == OK
    assert instance.serialise() == before
