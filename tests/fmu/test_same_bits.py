"""The FMUs compute what the C core computes, to the bit, however the importer steps."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from host import OK, Instance, Library, Replay
from numpy.typing import NDArray

from ahrs_fmu import descriptors, records
from ahrs_fmu.native import NativeModel

Rows = NDArray[np.float64]
ReplayOf = Callable[[Instance], Replay]
TICK = Fraction(1, 100)


def core(rows: Rows, sample_time: float = 0.01, precision: str = "double", **parameters: object) -> Rows:
    """Attitude of the C core after each row; the first one initialises."""
    descriptor = descriptors.load("gcf")
    model = NativeModel(descriptor, precision)
    for name, value in (parameters | {"sample_time": sample_time}).items():
        model.set(name, descriptor.numbers(descriptor.parameter(name), value))
    dt = np.full(len(rows), sample_time)
    dt[0] = 0.0
    columns = {"gyro": rows[:, :3], "accel": rows[:, 3:6], "mag": rows[:, 6:]}
    return np.asarray(model.run(dt, columns, ["q"])["q"])


def begin(library: Library, rows: Rows, time: float = 0.0, **parameters: float) -> Instance:
    """An instance initialised from the first row."""
    sensors = {"gyro": rows[0, :3], "accel": rows[0, 3:6], "mag": rows[0, 6:]}
    return library.instance().run(time, **sensors, **parameters)


def held(rows: Rows, times: list[Fraction], tick: Fraction = TICK) -> tuple[Rows, NDArray[np.int64]]:
    """Rows in the order in which ticks take them when row j is set before the step to times[j].

    Returns them, the first row for the initialisation in front, and how many ticks each step has ended.
    """
    ticks = [int(time / tick) for time in times]
    order = [0]
    for j in range(1, len(times)):
        order += [j] * (ticks[j] - ticks[j - 1])
    return rows[order], np.array(ticks[1:])


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("fmi", ["2", "3", "3-scalar"])
def test_whole_recording_gives_the_bits_of_the_core(
    fmi: str, precision: str, load: Callable[..., Library], replay_of: ReplayOf, broad_dir: Path
) -> None:
    record = records.read(broad_dir / "01_undisturbed_slow_rotation_A.mat").in_frame("ned")
    rows = np.hstack([record.gyro, record.accel, record.mag])
    assert len(rows) > 40_000
    sample_time = record.sample_time
    instance = begin(load(fmi, precision), rows, sample_time=sample_time)
    k = np.arange(len(rows) - 1)
    q = replay_of(instance)(k * sample_time, sample_time, k + 1, rows)
    np.testing.assert_array_equal(q, core(rows, sample_time, precision)[1:])
    instance.free()


def test_whole_recording_in_steps_of_0_4_tick_gives_the_bits_of_the_core(
    library: Library, replay_of: ReplayOf, broad_dir: Path
) -> None:
    record = records.read(broad_dir / "05_undisturbed_slow_rotation_with_breaks_B.mat").in_frame("ned")
    rows = np.hstack([record.gyro, record.accel, record.mag])
    sample_time = record.sample_time
    instance = begin(library, rows, sample_time=sample_time)
    steps = 5 * (len(rows) // 2) - 5
    end = np.arange(1, steps + 1) * 2  # in fifths of a tick
    row = (end - 2) // 5 + 1  # the row of the next tick
    q = replay_of(instance)((end - 2) * sample_time / 5, sample_time * 0.4, row, rows)
    reference = core(rows, sample_time)
    np.testing.assert_array_equal(q, reference[end // 5])
    instance.free()


def irregular(rng: np.random.Generator, count: int) -> list[Fraction]:
    microseconds = np.cumsum(rng.integers(1, 45_000, count))
    return [Fraction(0), *(Fraction(int(m), 1_000_000) for m in microseconds)]


@pytest.mark.parametrize("steps", ["1/60 s", "irregular", "3 ticks", "finer than a tick"])
@pytest.mark.parametrize("start", [0.0, 1e5])
def test_any_steps_run_the_core_with_held_inputs_at_its_ticks(
    steps: str, start: float, library: Library, replay_of: ReplayOf, rows: Rows
) -> None:
    count = 1500
    times = {
        "1/60 s": [Fraction(k, 60) for k in range(count)],
        "irregular": irregular(np.random.default_rng(5), count),
        "3 ticks": [3 * k * TICK for k in range(count)],
        "finer than a tick": [Fraction(k, 1700) for k in range(count)],
    }[steps]
    order, ticks = held(rows, times)
    instance = begin(library, rows, start)
    points = np.array([start + float(t) for t in times])
    q = replay_of(instance)(points[:-1], np.diff(points), np.arange(1, len(points)), rows)
    np.testing.assert_array_equal(q, core(order)[ticks])
    instance.free()


@pytest.mark.parametrize("through_bytes", [False, True])
def test_a_state_restored_in_the_middle_of_a_tick_goes_on_with_the_same_bits(
    through_bytes: bool, library: Library, replay_of: ReplayOf, rows: Rows
) -> None:
    end = np.arange(1, 1001) * 2
    row = (end - 2) // 5 + 1
    start = (end - 2) * 0.002
    reference = core(rows)[end // 5]
    instance = begin(library, rows)
    replay = replay_of(instance)
    first = replay(start[:501], 0.004, row[:501], rows)
    data = instance.serialise()
    state = instance.save()
    replay(start[501:], 0.004, row[501:][::-1].copy(), rows)
    if through_bytes:
        other = library.instance("another")
        status, state = other.deserialise(data)
        assert status == OK
        instance.free()
        instance, replay = other, replay_of(other)
    assert instance.restore(state) == OK
    np.testing.assert_array_equal(instance.get("q"), first[-1])
    second = replay(start[501:], 0.004, row[501:], rows)
    np.testing.assert_array_equal(np.vstack([first, second]), reference)
    assert instance.free_state(state) == OK
    instance.free()


def test_a_reset_instance_is_a_fresh_one(library: Library, replay_of: ReplayOf, rows: Rows) -> None:
    k = np.arange(500)
    fresh = begin(library, rows)
    expected = replay_of(fresh)(k * 0.01, 0.01, k + 1, rows)
    used = begin(library, rows[::-1], kp=2.0, ki=0.5, declination=0.1)
    replay_of(used)(k * 0.01, 0.01, k + 7, rows)
    assert used.call("Reset") == OK
    assert used.serialise() == library.instance().serialise()
    used.run(gyro=rows[0, :3], accel=rows[0, 3:6], mag=rows[0, 6:])
    np.testing.assert_array_equal(replay_of(used)(k * 0.01, 0.01, k + 1, rows), expected)


def test_tunable_gains_take_effect_at_the_next_tick(
    library: Library, replay_of: ReplayOf, rows: Rows
) -> None:
    instance = begin(library, rows)
    replay = replay_of(instance)
    k = np.arange(200)
    first = replay(k * 0.01, 0.01, k + 1, rows)
    assert instance.set("kp", 2.0) == OK
    second = replay(k * 0.01 + 2.0, 0.01, k + 201, rows)
    descriptor = descriptors.load("gcf")
    model = NativeModel(descriptor)
    columns = {"gyro": rows[:, :3], "accel": rows[:, 3:6], "mag": rows[:, 6:]}
    dt = np.full(201, 0.01)
    dt[0] = 0.0
    a = model.run(dt, {n: c[:201] for n, c in columns.items()}, ["q"])["q"]
    model.set("kp", [2.0])
    b = model.run(np.full(200, 0.01), {n: c[201:401] for n, c in columns.items()}, ["q"])["q"]
    np.testing.assert_array_equal(np.vstack([first, second]), np.vstack([a[1:], b]))


def test_other_outputs_are_those_of_the_core(library: Library, replay_of: ReplayOf, rows: Rows) -> None:
    instance = begin(library, rows)
    k = np.arange(300)
    replay_of(instance)(k * 0.01, 0.01, k + 1, rows)
    descriptor = descriptors.load("gcf")
    model = NativeModel(descriptor)
    columns = {"gyro": rows[:301, :3], "accel": rows[:301, 3:6], "mag": rows[:301, 6:]}
    dt = np.full(301, 0.01)
    dt[0] = 0.0
    names = [output.name for output in descriptor.outputs]
    expected = model.run(dt, columns, names)
    for name in names:
        np.testing.assert_array_equal(instance.get(name), np.atleast_1d(expected[name][-1]), err_msg=name)
