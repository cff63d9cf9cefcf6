"""Clauses measured on signals whose numbers are known."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from ahrs_fmu.cosim.expectations import Expectation, Verdict, judge
from ahrs_fmu.cosim.recording import Recording
from ahrs_fmu.errors import ScenarioError

TIME = np.arange(1, 1001) * 0.01
DECAY = np.exp(-TIME)
RECORDING = Recording(
    TIME,
    {
        "a.angle": np.radians(10.0 * DECAY),
        "a.vector": np.stack((3.0 * DECAY, 4.0 * DECAY, 0.0 * TIME), axis=-1),
        "a.state": np.where(TIME < 2.0, 0.0, 1.0),
        "a.step": 1.0 - 1.5 * np.exp(-TIME) * np.cos(3.0 * TIME),
        "a.broken": np.where(TIME > 5.0, np.nan, 0.0),
    },
    {"a.angle": "rad", "a.vector": "m/s", "a.state": "", "a.step": "", "a.broken": ""},
    1.0,
)
ITEMS = {"a.state": {"starting": 0, "running": 1}}


def verdict(fault_end: float = -math.inf, **fields: object) -> Verdict:
    return judge(msgspec.convert(fields, Expectation), RECORDING, ITEMS, fault_end, {})


@pytest.mark.parametrize(
    ("measure", "signal", "expected"),
    [
        ("rms", "a.angle", math.radians(10.0) * math.sqrt(np.mean(DECAY**2))),
        ("max", "a.vector", 5.0 * DECAY[0]),
        ("max", "a.vector[2]", 4.0 * DECAY[0]),
        ("mean", "a.angle", math.radians(10.0) * DECAY.mean()),
        ("p95", "a.vector", 5.0 * np.percentile(DECAY, 95.0)),
        ("final", "a.vector", 5.0 * DECAY[900]),
    ],
)
def test_a_measure_is_that_of_the_signal_and_the_bound_decides(
    measure: str, signal: str, expected: float
) -> None:
    expected = float(expected)
    found = verdict(signal=signal, measure=measure, at_most=1.01 * expected)
    assert found.measured == pytest.approx(expected)
    assert found.passed
    assert not verdict(signal=signal, measure=measure, at_most=0.99 * expected).passed
    assert not verdict(signal=signal, measure=measure, at_least=1.01 * expected).passed


def test_a_bound_may_have_a_unit_of_its_own() -> None:
    assert verdict(signal="a.angle", measure="max", at_most="10 deg").passed
    assert not verdict(signal="a.angle", measure="max", at_most="9.8 deg").passed
    assert verdict(signal="a.angle", measure="max", at_most="10 deg").value == "9.9 deg"


def test_a_window_leaves_the_rest_out() -> None:
    late = {"from": 5.0, "until": 6.0}
    assert verdict(signal="a.vector", measure="max", at_most=1.0, **late).measured == pytest.approx(
        5.0 * math.exp(-5.0)
    )


def test_settling_and_recovery_count_from_the_window_and_from_the_end_of_the_fault() -> None:
    # 10 deg exp(-t) is below 1 deg from ln 10 = 2.303 s on.
    settled = verdict(signal="a.angle", measure="settling", band="1 deg", at_most="3 s")
    assert settled.measured == pytest.approx(2.31)
    recovered = verdict(2.0, signal="a.angle", measure="recovery", band="1 deg", at_most=1.0)
    assert recovered.measured == pytest.approx(0.31)
    never = verdict(signal="a.angle", measure="settling", band="0.0001 deg", at_most=100.0)
    assert (never.passed, never.value) == (False, "never")


def test_overshoot_is_relative_to_the_change() -> None:
    step = RECORDING["a.step"]
    final = step[-100:].mean()
    expected = (step.max() - final) / (final - step[0])
    assert verdict(signal="a.step", measure="overshoot", at_most=1.0).measured == pytest.approx(expected)


def test_conditions_tell_when_they_first_hold() -> None:
    reached = verdict(signal="a.state", measure="reached", equals="running", at_most="2.5 s")
    assert (reached.measured, reached.passed) == (pytest.approx(2.0), True)
    assert not verdict(signal="a.state", measure="reached", equals="running", at_most=1.0).passed
    broken = verdict(signal="a.angle", measure="never", above="5 deg")
    assert (broken.passed, broken.at) == (False, pytest.approx(0.01))
    assert verdict(signal="a.angle", measure="never", above="11 deg").value == "did not happen"


def test_a_signal_that_is_not_finite_holds_no_bound_and_the_moment_is_told() -> None:
    found = verdict(signal="a.broken", measure="max", at_most=1.0)
    assert (found.passed, found.value, found.at) == (False, "not finite", pytest.approx(5.01))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"signal": "a.angle", "measure": "rms"}, "needs at_most or at_least"),
        ({"signal": "a.angle", "measure": "settling", "at_most": 1}, "needs band"),
        ({"signal": "a.angle", "measure": "never"}, "needs one of above, below, equals"),
        ({"signal": "a.angle", "measure": "rms", "at_most": 1, "above": 1}, "takes no condition"),
        ({"signal": "a.b", "measure": "phase_margin", "at_least": 1}, "needs direction"),
        ({"signal": "a.b", "measure": "rmse", "at_most": 1}, "rmse"),
    ],
)
def test_a_clause_that_says_too_little_is_refused(fields: dict[str, object], words: str) -> None:
    with pytest.raises(msgspec.ValidationError, match=words):
        msgspec.convert(fields, Expectation)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (
            {"signal": "a.angle", "measure": "max", "at_most": "1 m"},
            "'m' does not measure what 'rad' measures",
        ),
        ({"signal": "a.state", "measure": "reached", "equals": "flying"}, "one of starting, running"),
        ({"signal": "a.angle", "measure": "recovery", "band": 1.0, "at_most": 1.0}, "no fault that ends"),
        ({"signal": "a.angle", "measure": "max", "at_most": 1.0, "from": 20.0}, "the window is empty"),
        ({"signal": "a.vector[4]", "measure": "max", "at_most": 1.0}, "no such element"),
        ({"signal": "a.speed", "measure": "max", "at_most": 1.0}, "'a.speed' was not recorded"),
    ],
)
def test_a_clause_that_does_not_fit_its_signal_is_refused(fields: dict[str, object], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        verdict(**fields)


@pytest.mark.parametrize(
    ("fields", "clause", "limit"),
    [
        ({"measure": "max", "at_most": "2 deg"}, "max of a.angle", "≤ 2 deg"),
        ({"measure": "max", "at_least": 0.5, "from": 3.0}, "max of a.angle from 3 s", "≥ 0.5"),
        ({"measure": "final", "at_least": "1.5 deg", "at_most": "2 deg", "until": 4.0},
         "final of a.angle until 4 s", "1.5 to 2 deg"),
        ({"measure": "max", "at_least": "1 rad", "at_most": "90 deg", "from": 1.0, "until": 4.0},
         "max of a.angle from 1 s until 4 s", "1 rad to 90 deg"),
        ({"measure": "recovery", "band": "1 deg", "at_least": 2.0, "at_most": 3.5},
         "recovery of a.angle (within 1 deg)", "2 to 3.5 s"),
        ({"measure": "reached", "above": 0.1, "at_most": "15 ms"}, "reached of a.angle above 0.1", "≤ 15 ms"),
        ({"measure": "reached", "above": 0.1}, "reached of a.angle above 0.1", "at some time"),
        ({"measure": "never", "below": 0.1}, "never of a.angle below 0.1", "at no time"),
    ],
)  # fmt: skip
def test_a_clause_reads_as_it_is_meant(fields: dict[str, object], clause: str, limit: str) -> None:
    expectation = msgspec.convert({"signal": "a.angle", **fields}, Expectation)
    assert (expectation.text, expectation.limit) == (clause, limit)


def test_the_moment_of_a_final_value_lies_in_the_last_tenth() -> None:
    found = verdict(signal="a.angle", measure="final", at_most=0.0)
    assert found.at is not None
    assert found.at > 9.0


@pytest.mark.parametrize(
    ("margin", "words"), [(math.inf, "unlimited"), (-math.inf, "unstable"), (0.5, "28.6 deg")]
)
def test_a_margin_in_words(margin: float, words: str) -> None:
    clause = msgspec.convert(
        {"signal": "a.angle", "measure": "phase_margin", "direction": [1.0], "at_most": "30 deg"}, Expectation
    )
    found = judge(clause, RECORDING, ITEMS, -math.inf, {"phase_margin": margin})
    assert found.value == words
    assert found.passed == (margin < 0.52)
