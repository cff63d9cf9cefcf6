"""The C core as a stepper."""

from __future__ import annotations

import numpy as np
import pytest

from ahrs_fmu import GCF, Record, descriptors
from ahrs_fmu.cosim.core import CoreStepper
from ahrs_fmu.cosim.stepper import Stepper, replay
from ahrs_fmu.errors import ParameterError

T = 0.01


def flight(rows: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    return {
        "gyro": 0.1 * rng.standard_normal((rows, 3)),
        "accel": [0.0, 0.0, -9.8] + 0.1 * rng.standard_normal((rows, 3)),
        "mag": [4e-5, 0.0, 3e-5] + 1e-6 * rng.standard_normal((rows, 3)),
    }


def gcf() -> CoreStepper:
    return CoreStepper(descriptors.load("gcf"), {"kp": 1.0})


class OneByOne:
    """A stepper that hides the fast path of another."""

    def __init__(self, inner: Stepper) -> None:
        self.inputs, self.outputs = inner.inputs, inner.outputs
        self.set, self.get, self.step = inner.set, inner.get, inner.step


def test_a_whole_record_gives_the_same_bits_as_single_steps() -> None:
    inputs = flight(50)
    whole = replay(gcf(), inputs, ["q", "gyro_bias", "status"], T)
    single = replay(OneByOne(gcf()), inputs, ["q", "gyro_bias", "status"], T)
    for name, values in whole.items():
        np.testing.assert_array_equal(values, single[name])


def test_the_stepper_initialises_from_its_first_inputs_as_an_fmu_does() -> None:
    inputs = flight(20)
    first = np.concatenate(([0], np.arange(20)))
    record = Record(time=T * np.arange(21), **{name: values[first] for name, values in inputs.items()})
    # The record's time differences are rounded, hence not the same bits.
    expected = GCF(kp=1.0).run(record).q[1:]
    np.testing.assert_allclose(replay(gcf(), inputs, ["q"], T)["q"], expected, rtol=0, atol=1e-14)


def test_a_restored_state_continues_with_the_same_bits() -> None:
    inputs = flight(40)
    stepper = gcf()
    replay(stepper, {n: v[:15] for n, v in inputs.items()}, [], T)
    saved = stepper.save()
    rest = {n: v[15:] for n, v in inputs.items()}
    expected = replay(stepper, rest, ["q"], T)["q"]
    other = gcf()
    other.restore(saved)
    np.testing.assert_array_equal(replay(other, rest, ["q"], T)["q"], expected)


def test_the_numpy_back_end_steps_like_the_c_code() -> None:
    inputs, wanted = flight(40), ["q", "gyro_bias"]
    stepper = CoreStepper(descriptors.load("gcf"), {"kp": 1.0}, back_end="numpy")
    expected, found = replay(gcf(), inputs, wanted, T), replay(stepper, inputs, wanted, T)
    for name in wanted:
        np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=1e-9)
    saved = stepper.save()
    first = replay(stepper, inputs, ["q"], T)["q"]
    stepper.restore(saved)
    np.testing.assert_array_equal(replay(stepper, inputs, ["q"], T)["q"], first)


def test_reset_is_a_fresh_instance() -> None:
    inputs, stepper = flight(30), gcf()
    expected = replay(stepper, inputs, ["q"], T)["q"]
    stepper.reset()
    np.testing.assert_array_equal(replay(stepper, inputs, ["q"], T)["q"], expected)


def test_a_long_step_is_several_samples_with_the_same_inputs() -> None:
    inputs = flight(10)
    long = replay(gcf(), inputs, ["q"], 3 * T)["q"]
    short = replay(gcf(), {n: np.repeat(v, 3, axis=0) for n, v in inputs.items()}, ["q"], T)["q"]
    np.testing.assert_array_equal(long, short[2::3])


@pytest.mark.parametrize("dt", [0.4 * T, 1.0 / 60.0, 0.0101, 0.37 * T])
def test_steps_off_the_grid_take_the_samples_they_contain_and_hold_between(dt: float) -> None:
    inputs, wanted = flight(60), ["q", "gyro_bias", "status"]
    whole = replay(gcf(), inputs, wanted, dt)
    single = replay(OneByOne(gcf()), inputs, wanted, dt)
    for name in wanted:
        np.testing.assert_array_equal(whole[name], single[name])
    # A sample is taken in the step in which its time lies, with the inputs of that step.
    ends = np.rint((np.arange(60) + 1) * dt / T * 1e9) / 1e9
    samples = np.floor(ends).astype(int)
    rows = np.searchsorted(samples, np.arange(1, samples[-1] + 1))
    fresh = {name: np.concatenate((values[:1], values[rows])) for name, values in inputs.items()}
    record = Record(time=T * np.arange(rows.size + 1), **fresh)
    # Row k of the run is the attitude after sample k, and row 0 the initial one.
    expected = GCF(kp=1.0).run(record).q[samples]
    np.testing.assert_allclose(whole["q"], expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.set("gyros", [0.0, 0.0, 0.0]), "no input 'gyros'"),
        (lambda s: s.set("gyro", [0.0]), "expected \\(3,\\)"),
        (lambda s: s.get("quaternion"), "no variable 'quaternion'"),
        (lambda s: s.step(-0.01), "step of -0.01 s: it must be positive"),
        (lambda s: s.replay({"gyro": np.zeros((2, 3))}, ["attitude"], T), "no variable 'attitude'"),
        (lambda _: CoreStepper(descriptors.load("gcf"), {"kP": 1.0}), "no parameter 'kP'"),
        (lambda _: CoreStepper(descriptors.load("gcf"), {"kp": -1.0}), "kp = -1"),
    ],
)
def test_wrong_names_shapes_and_steps_are_refused(call, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        call(gcf())
