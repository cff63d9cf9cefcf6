"""Faults: what each does to a signal, that it ends, and what an estimator makes of it.

Numbers follow from the definitions in docs/faults.md. At the level of a system the estimator is a
complementary filter of the first order on perfect sensors, whose error obeys e' = -KP e once a fault is over.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from ahrs_fmu import quaternion
from ahrs_fmu.cosim import running, scenario
from ahrs_fmu.cosim.faults import KINDS, AnyFault, taps
from ahrs_fmu.cosim.instances import Instances
from ahrs_fmu.cosim.recording import Recording
from ahrs_fmu.cosim.stepper import Array, Port, Stepper
from ahrs_fmu.cosim.taps import Tap
from ahrs_fmu.errors import ScenarioError, SimulationError

STEP = 0.01
START, DURATION = 0.5, 1.0
FIRST, LAST = 49, 149
"""Rows of the samples at start and end: row k is that of the time (k + 1) STEP."""
ROWS = 400
TIME: Array = STEP * np.arange(1.0, ROWS + 1.0)
PORTS = {
    "imu.gyro": Port("rad/s", (3,)),
    "imu.mag": Port("T", (3,)),
    "imu.mag_valid": Port("", (), {}, True),
    "imu.temperature": Port("K"),
    "estimator.q": Port("1", (4,)),
    "estimator.status": Port("", (), {"nominal": 0, "initialising": 9}),
    "truth.q": Port("1", (4,)),
}
EXAMPLES: Mapping[str, Mapping[str, Any]] = {
    "stuck": {},
    "bias": {"amount": [0.1, -0.2, 0.3]},
    "drift": {"rate": "2 deg/s2"},
    "scale": {"error": 0.05},
    "noise": {"std": 0.02},
    "saturation": {"limit": 0.3},
    "dropout": {"probability": 0.5},
    "delay": {"time": 0.04},
    "jitter": {"time": 0.025},
    "outliers": {"amount": 5.0, "probability": 0.2},
    "vibration": {"amplitude": 0.4, "frequency": 33.0, "phase": 0.2},
    "field": {"amount": [0.1, 0.2, 0.3], "attitude": "truth.q"},
    "swap": {"order": [2, 3, 1]},
    "flip": {"elements": [1, 3]},
    "quaternion-order": {"signal": "estimator.q"},
}
"""Every kind, on the gyroscope where nothing else is said."""
RANDOM = ("noise", "dropout", "jitter", "outliers")
ALL_SHAPES = ("step", "ramp", "smooth", "pulses")

kinds = pytest.mark.parametrize("kind", KINDS)


def fault(kind: str, **fields: object) -> Any:
    common = {"kind": kind, "signal": "imu.gyro", "start": START, "duration": DURATION}
    return msgspec.convert({**common, **EXAMPLES[kind], **fields}, AnyFault)


def signal_of(what: Any) -> Array:
    """Four numbers of unit length, or three that move and hold what arithmetic could spoil."""
    wave: Array = np.stack((np.sin(TIME), np.cos(3.0 * TIME), 0.5 * TIME - 0.4), axis=-1)
    if what.signal.endswith(".q"):
        return quaternion.exp(wave)
    wave[::7, 0] = -0.0
    wave[::11, 1] = np.nan
    wave[::13, 2] = np.inf
    return wave


class Line:
    """The taps of one fault on its signals, as a system has them."""

    def __init__(self, what: Any, name: str = "it", seed: int = 1) -> None:
        self.signal = what.signal
        self.chains: Mapping[str, Any] = taps({name: what}, PORTS, STEP, seed)
        self.truth = quaternion.exp(np.outer(np.sin(TIME), [0.3, 0.2, 1.0]))

    def __call__(self, values: Array, rows: slice = slice(None)) -> Array:
        if "truth.q" in self.chains:
            self.through("truth.q", self.truth, rows)
        return self.through(self.signal, values, rows)

    def through(self, signal: str, values: Array, rows: slice = slice(None)) -> Array:
        seen = values[rows]
        for tap in self.chains[signal]:
            seen = tap(TIME[rows], seen)
        return seen

    @property
    def taps(self) -> list[Tap]:
        return [tap for chain in self.chains.values() for tap in chain]


def same_bits(first: Array, second: Array) -> bool:
    return first.tobytes() == second.tobytes()


def chunks(sizes: tuple[int, ...]) -> Iterator[slice]:
    at, turn = 0, 0
    while at < ROWS:
        yield slice(at, min(at + sizes[turn % len(sizes)], ROWS))
        at, turn = at + sizes[turn % len(sizes)], turn + 1


def test_every_kind_has_an_example() -> None:
    assert set(EXAMPLES) == set(KINDS)


@kinds
def test_a_fault_shows_from_its_start_to_its_end_and_nowhere_else(kind: str) -> None:
    what = fault(kind)
    values = signal_of(what)
    seen = Line(what)(values)
    assert same_bits(seen[:FIRST], values[:FIRST])
    assert same_bits(seen[LAST:], values[LAST:])
    changed = np.flatnonzero([not same_bits(a, b) for a, b in zip(seen, values, strict=True)])
    assert FIRST <= changed.min() <= FIRST + 20
    assert LAST - 20 <= changed.max() < LAST


@kinds
@pytest.mark.parametrize("shape", ALL_SHAPES)
def test_without_severity_every_bit_stays(kind: str, shape: str) -> None:
    what = fault(kind, severity=0.0, shape=shape)
    values = signal_of(what)
    assert same_bits(Line(what)(values), values)


@kinds
@pytest.mark.parametrize("shape", ALL_SHAPES)
def test_step_by_step_and_in_chunks_a_fault_gives_the_bits_of_the_whole(kind: str, shape: str) -> None:
    what = fault(kind, shape=shape, rise=0.3, severity=1.3)
    values = signal_of(what)
    whole = Line(what)(values)
    for sizes in ((1,), (7, 1, 64), (100,)):
        line = Line(what)
        assert same_bits(np.concatenate([line(values, rows) for rows in chunks(sizes)]), whole)


@kinds
def test_a_run_that_is_restored_within_a_fault_goes_on_with_the_same_bits(kind: str) -> None:
    what = fault(kind)
    values = signal_of(what)
    line = Line(what)
    whole = line(values)
    line = Line(what)
    middle, end = slice(0, 103), slice(103, ROWS)
    line(values, middle)
    saved = [tap.save() for tap in line.taps]
    first = line(values, end)
    for tap, state in zip(line.taps, saved, strict=True):
        tap.restore(state)
    assert same_bits(line(values, end), first)
    assert same_bits(first, whole[end])
    for tap in line.taps:
        tap.reset()
    assert same_bits(line(values), whole)


@pytest.mark.parametrize("kind", RANDOM)
def test_chance_is_decided_by_seed_and_name(kind: str) -> None:
    values = np.stack((np.sin(TIME), np.cos(TIME), TIME), axis=-1)
    what = fault(kind)
    assert same_bits(Line(what)(values), Line(what)(values))
    assert not same_bits(Line(what, seed=2)(values), Line(what)(values))
    assert not same_bits(Line(what, name="another")(values), Line(what)(values))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("stuck", "swap")])
def test_what_is_no_number_stays_none(kind: str) -> None:
    what = fault(kind)
    values = signal_of(what).copy()
    values[98:103] = np.nan
    later = {"delay": 4, "jitter": 2}.get(kind, 0)
    assert np.isnan(Line(what)(values)[100 + later]).all()


@pytest.mark.parametrize(
    ("shape", "at", "strength"),
    [
        ("step", [0.49, 0.50, 1.49, 1.50], [0.0, 1.0, 1.0, 0.0]),
        ("ramp", [0.50, 0.51, 0.70, 0.90, 1.10, 1.30, 1.49, 1.50], [0, 0.025, 0.5, 1, 1, 0.5, 0.025, 0]),
        ("smooth", [0.50, 0.60, 0.70, 0.80, 0.90, 1.10, 1.30], [0, 0.1464466, 0.5, 0.8535534, 1, 1, 0.5]),
        ("pulses", [0.49, 0.50, 0.89, 0.90, 1.29, 1.30, 1.49, 1.50], [0, 1, 1, 0, 0, 1, 1, 0]),
    ],
)
def test_the_envelope_at_its_borders(shape: str, at: list[float], strength: list[float]) -> None:
    what = fault("bias", shape=shape, rise=0.4, severity=2.0)
    # Ends of steps, with the rounding that they have.
    times = STEP * np.rint(np.array(at) / STEP)
    np.testing.assert_allclose(what.strength(times), 2.0 * np.array(strength), atol=1e-7)
    late = msgspec.structs.replace(what, start=START + 1e5)
    np.testing.assert_allclose(late.strength(times + 1e5), 2.0 * np.array(strength), atol=1e-7)


def test_a_fault_without_duration_lasts() -> None:
    what = msgspec.convert({"kind": "scale", "signal": "imu.gyro", "start": 0.5, "error": 1.0}, AnyFault)
    seen = Line(what)(np.ones((ROWS, 3)))
    assert (seen[FIRST:] == 2.0).all()
    assert (seen[:FIRST] == 1.0).all()


DURING = slice(FIRST, LAST)
LINE: Array = np.outer(TIME, [1.0, -2.0, 4.0])
"""A signal whose values tell the time at which they were taken."""


@pytest.mark.parametrize(
    ("kind", "fields", "expected"),
    [
        ("stuck", {}, np.broadcast_to(LINE[FIRST - 1], (100, 3))),
        ("bias", {"amount": "90 deg/s"}, LINE[DURING] + np.pi / 2.0),
        ("bias", {"amount": [1.0, 2.0, 3.0], "severity": 0.5}, LINE[DURING] + [0.5, 1.0, 1.5]),
        ("drift", {"rate": [1.0, 0.0, -1.0]}, LINE[DURING] + np.outer(TIME[DURING] - 0.5, [1.0, 0.0, -1.0])),
        ("drift", {"rate": 1.0, "severity": 3.0}, LINE[DURING] + 3.0 * (TIME[DURING, None] - 0.5)),
        ("scale", {"error": [0.1, 0.0, -1.0]}, LINE[DURING] * [1.1, 1.0, 0.0]),
        ("scale", {"error": 0.2, "severity": 0.5}, LINE[DURING] * 1.1),
        ("saturation", {"limit": 1.0}, np.clip(LINE[DURING], -1.0, 1.0)),
        ("saturation", {"limit": [1.0, 2.0, 0.0], "severity": 0.5},
         LINE[DURING].clip([-2, -4, 0], [2, 4, 0])),
        ("dropout", {"probability": 1.0}, np.full((100, 3), np.nan)),
        ("delay", {"time": 0.04}, LINE[FIRST - 4 : LAST - 4]),
        ("delay", {"time": 0.04, "severity": 0.5}, LINE[FIRST - 2 : LAST - 2]),
        ("vibration", {"amplitude": 0.5, "frequency": 110.0},
         LINE[DURING] + 0.5 * np.sin(2.0 * np.pi * 10.0 * TIME[DURING, None])),
        ("vibration", {"amplitude": 2.0, "frequency": 100.0, "phase": np.pi / 2, "severity": 0.5},
         LINE[DURING] + 1.0),
        ("swap", {"order": [3, 1, 2], "severity": 0.1}, LINE[DURING][:, [2, 0, 1]]),
        ("flip", {"elements": [2], "severity": 5.0}, LINE[DURING] * [1.0, -1.0, 1.0]),
    ],
)  # fmt: skip
def test_the_effect_of_a_fault_in_numbers(kind: str, fields: dict[str, Any], expected: Array) -> None:
    what = msgspec.convert(
        {"kind": kind, "signal": "imu.gyro", "start": START, "duration": DURATION, **fields}, AnyFault
    )
    np.testing.assert_allclose(Line(what)(LINE)[DURING], expected, atol=1e-10)


def test_a_quaternion_is_misread_in_the_way_that_is_named() -> None:
    q = np.broadcast_to([0.1, 0.2, 0.3, 0.4], (ROWS, 4))
    assert Line(fault("quaternion-order"))(q)[100].tolist() == [0.2, 0.3, 0.4, 0.1]
    assert Line(fault("quaternion-order", mistake="inverse"))(q)[100].tolist() == [0.1, -0.2, -0.3, -0.4]


def test_a_field_stays_in_the_room_while_the_vehicle_turns() -> None:
    line = Line(fault("field", signal="imu.mag", amount=["10 uT", 0.0, "-5 uT"]))
    added = line(np.zeros((ROWS, 3)))[DURING]
    np.testing.assert_allclose(
        quaternion.rotate(line.truth[DURING], added), np.broadcast_to([1e-5, 0.0, -5e-6], added.shape),
        atol=1e-19,
    )  # fmt: skip
    assert np.ptp(added, axis=0).max() > 1e-6


def test_chance_has_the_distribution_that_is_written() -> None:
    always = {"start": 0.0, "duration": 1e9}
    noise = Line(fault("noise", std=[0.1, 0.2, 0.0], severity=2.0, **always))(np.zeros((ROWS, 3)))
    # A standard deviation of 400 numbers is known to 3.5 %.
    np.testing.assert_allclose(noise.std(axis=0), [0.2, 0.4, 0.0], rtol=0.12)
    for severity, expected in ((0.5, 0.15), (1.0, 0.3), (10.0, 1.0)):
        lost = np.isnan(Line(fault("dropout", probability=0.3, severity=severity, **always))(LINE)[:, 0])
        assert lost.mean() == pytest.approx(expected, abs=0.08)
    off = Line(fault("outliers", amount=2.0, probability=0.3, severity=0.5, **always))(np.zeros((ROWS, 3)))
    assert set(np.unique(off)) == {-1.0, 0.0, 1.0}
    assert (off[:, 0] != 0.0).mean() == pytest.approx(0.3, abs=0.08)
    assert ((off == 0.0).all(axis=1) | (off != 0.0).all(axis=1)).all()
    early = TIME - Line(fault("jitter", time=0.02, severity=2.0, **always))(LINE)[:, 0]
    assert early[4:].min() >= 0.0
    assert early[4:].max() <= 0.04
    assert early[4:].mean() == pytest.approx(0.02, abs=0.002)


def test_a_dropout_lowers_the_flag_and_keeps_the_value_together() -> None:
    line = Line(fault("dropout", probability=0.4, flag="imu.mag_valid", signal="imu.mag"))
    values, valid = line(LINE), line.through("imu.mag_valid", np.ones(ROWS))
    lost = np.flatnonzero(valid == 0.0)
    assert 20 < len(lost) < 60
    assert lost.min() >= FIRST
    assert lost.max() < LAST
    assert same_bits(values[lost], values[lost - 1])
    assert same_bits(values[valid == 1.0], LINE[valid == 1.0])


@pytest.mark.parametrize(("kind", "expected"), [("dropout", 0.0), ("stuck", 1.0), ("delay", 1.0)])
def test_a_truth_value_can_drop_out_stick_and_come_late(kind: str, expected: float) -> None:
    what = msgspec.convert(
        {"kind": kind, "signal": "imu.mag_valid", "start": START, "duration": 0.04}
        | ({"time": 0.04} if kind == "delay" else {}),
        AnyFault,
    )
    given = np.where(np.arange(ROWS) == FIRST + 1, 0.0, 1.0)
    assert Line(what)(given)[FIRST + 1] == expected
    assert Line(what)(given)[FIRST + 4] == 1.0


def test_faults_of_one_signal_act_in_the_order_of_the_file() -> None:
    made = taps({"a": fault("bias", amount=1.0), "b": fault("scale", error=1.0)}, PORTS, STEP, 1)
    seen = np.zeros((ROWS, 3))
    for tap in made["imu.gyro"]:
        seen = tap(TIME, seen)
    assert (seen[DURING] == 2.0).all()


@pytest.mark.parametrize(
    ("kind", "fields", "says"),
    [
        ("bias", {"amount": [1.0, 2.0]}, "amount has 2 numbers, imu.gyro 3: give 3, or one for all elements"),
        ("bias", {"amount": "1 uT"}, "amount: '1 uT': 'uT' does not measure what 'rad/s' measures"),
        ("drift", {"rate": "1 deg/s"}, "rate: '1 deg/s': 'deg/s' does not measure what 'rad/s/s' measures"),
        ("noise", {"std": "much"}, "std: 'much' is not a number and a unit, such as '0.5 deg/s'"),
        ("stuck", {"signal": "imu.gyr"}, "signal = 'imu.gyr': imu has no such output; it has gyro, mag"),
        ("stuck", {"signal": "ium.gyro"}, "'ium.gyro' is no component.output; the components are imu"),
        ("dropout", {"flag": "imu.valid"}, "flag = 'imu.valid': imu has no such output"),
        ("dropout", {"flag": "imu.mag"}, "'imu.mag' is no truth value: name one such as imu.mag_valid"),
        ("dropout", {"signal": "estimator.status"}, "does not fit estimator.status, an enumeration"),
        ("bias", {"signal": "imu.mag_valid"}, "a truth value: use one of stuck, dropout, delay"),
        ("field", {"attitude": "imu.gyro"}, "attitude = 'imu.gyro' is no quaternion: name one such as"),
        ("field", {"signal": "imu.temperature", "amount": 1.0}, "signal = 'imu.temperature' has 1 elements"),
        ("quaternion-order", {"signal": "imu.gyro"}, "signal = 'imu.gyro' is no quaternion"),
        ("swap", {"order": [1, 2]}, r"order = [1, 2] must hold each of 1 to 3 once"),
        ("swap", {"order": [1, 2, 2]}, r"order = [1, 2, 2] must hold each of 1 to 3 once"),
        ("flip", {"elements": [4]}, r"elements = [4]: the elements of imu.gyro are 1 to 3"),
        ("flip", {"elements": []}, r"elements = []: the elements of imu.gyro are 1 to 3"),
        ("saturation", {"limit": -1.0}, "limit = -1.0 is negative: the range is ± limit"),
        ("delay", {"time": 0.004}, "time = 0.004 s is less than half a step of 0.01 s"),
    ],
)  # fmt: skip
def test_a_fault_that_does_not_fit_is_refused_in_one_line(
    kind: str, fields: dict[str, Any], says: str
) -> None:
    with pytest.raises(ScenarioError) as refused:
        Line(fault(kind, **fields), name="iron")
    words = str(refused.value)
    assert words.startswith("faults.iron: ")
    assert says in words
    assert "\n" not in words


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ('kind = "bais"', "iron.kind: Invalid value 'bais'; the kinds are stuck, bias, drift"),
        ('kind = "stuck"\nstart = -1', "iron.start: Expected `float` >= 0.0"),
        ('kind = "stuck"\nstart = nan', "iron.start: Expected `float` >= 0.0"),
        ('kind = "stuck"\nduration = 0', "iron.duration: Expected `float` > 0.0"),
        ('kind = "stuck"\nseverity = inf', "iron.severity: Expected `float` <= 1000.0"),
        ('kind = "stuck"\nsverity = 1', "iron: Object contains unknown field `sverity`"),
        ('kind = "bias"', "iron: Object missing required field `amount`"),
        ('kind = "delay"\ntime = "40 ms"', "iron.time: Expected `float`, got `str`"),
    ],
)
def test_a_file_with_a_bad_fault_is_refused_by_file_fault_and_key(lines: str, says: str) -> None:
    text = f'template = "estimation"\nduration = 1.0\n[faults.iron]\nsignal = "imu.mag"\n{lines}'
    with pytest.raises(ScenarioError, match=r"^bad.cosim.toml: faults\.") as refused:
        scenario.parse(text, Path("bad.cosim.toml")).scenario({})
    assert says in str(refused.value)


KP = 2.0
SYSTEM = f"""
template = "estimation"
duration = 12.0
record = ["imu.gyro"]
motion.rotation.roll_deg.sines = [{{ amplitude = 20.0, frequency = 0.3 }}]
motion.rotation.yaw_deg.sines = [{{ amplitude = 30.0, frequency = 0.25 }}]
components.imu.parameters.errors = false
components.estimator.model = "complementary"
components.estimator.parameters.kp = {KP}
"""
"""Perfect sensors in motion; the filter of the first order has the time constant 1/KP."""
OTHER = """
start_values = ["other.gyro", "other.accel", "other.mag", "other.accel_valid", "other.mag_valid"]
components.other.model = "gcf"
"""
BEGIN, END = 2.0, 5.0
IN_A_SYSTEM: tuple[tuple[str, str, float], ...] = (
    # A gyroscope that is wrong by w shows as at most w/KP; the motion turns at up to 47 deg/s.
    ("stuck", 'signal = "imu.gyro"', 10.0),
    ("bias", 'signal = "imu.gyro"\namount = ["6 deg/s", 0, 0]', 2.7),
    ("drift", 'signal = "imu.gyro"\nrate = "2 deg/s2"', 2.0),
    ("scale", 'signal = "imu.gyro"\nerror = 0.2', 2.0),
    ("noise", 'signal = "imu.gyro"\nstd = "50 deg/s"', 2.0),
    ("saturation", 'signal = "imu.gyro"\nlimit = "20 deg/s"', 4.0),
    ("dropout", 'signal = "imu.gyro"', 10.0),
    ("delay", 'signal = "imu.gyro"\ntime = 0.1', 2.0),
    ("jitter", 'signal = "imu.gyro"\ntime = 0.2', 1.5),
    ("outliers", 'signal = "imu.gyro"\namount = "200 deg/s"\nprobability = 0.1', 2.0),
    # At the sampling rate a vibration looks constant: it acts like a bias.
    ("vibration", 'signal = "imu.gyro"\namplitude = "6 deg/s"\nfrequency = 100.0\nphase = 1.5707963', 2.7),
    # 9 uT across 22.7 uT of horizontal field turn the heading by 22 deg.
    ("field", 'signal = "imu.mag"\nattitude = "motion.q"\namount = [0, "9 uT", 0]', 15.0),
    ("swap", 'signal = "imu.gyro"\norder = [2, 1, 3]', 5.0),
    ("flip", 'signal = "imu.gyro"\nelements = [3]', 10.0),
    ("quaternion-order", 'signal = "estimator.q"\nmistake = "inverse"', 20.0),
)  # fmt: skip


def recorded(text: str, changes: Mapping[str, object] | None = None) -> Recording:
    file = scenario.parse(text, Path("test.cosim.toml"))
    with Instances() as instances:
        return running.run(next(iter(file.cases(changes or {}))), instances, Path()).recording


def test_every_kind_is_tried_in_a_system() -> None:
    assert {kind for kind, _, _ in IN_A_SYSTEM} == set(KINDS)


@pytest.mark.parametrize(("kind", "lines", "least"), IN_A_SYSTEM, ids=[kind for kind, *_ in IN_A_SYSTEM])
def test_an_estimator_suffers_from_a_fault_and_recovers_at_its_bandwidth(
    kind: str, lines: str, least: float
) -> None:
    text = f'{SYSTEM}\n[faults.it]\nkind = "{kind}"\nstart = {BEGIN}\nduration = {END - BEGIN}\n{lines}'
    recording = recorded(text)
    time, error = recording.time, recording["attitude_error.total"]
    # Row 0 is at rest in the first attitude while the vehicle moves already: that is forgotten first.
    before = (time > BEGIN - 0.3) & (time < BEGIN - 1e-6)
    during = (time > BEGIN - 1e-6) & (time < END - 1e-6)
    after = time > END - 1e-6
    assert np.degrees(error[before].max()) < 0.03
    assert np.degrees(error[during].max()) > least
    left = error[during][-1]
    assert (error[after] < 1.02 * left * np.exp(-KP * (time[after] - END)) + np.radians(0.01)).all()


class StepByStep:
    """A component that does not take records as a whole, so that nobody takes the system for a chain."""

    def __init__(self, inner: Stepper) -> None:
        self.inputs, self.outputs = inner.inputs, inner.outputs
        self.set, self.get, self.step = inner.set, inner.get, inner.step
        self.save, self.restore, self.reset = inner.save, inner.restore, inner.reset


def test_faults_of_a_system_that_is_stepped_have_the_bits_of_one_that_is_taken_as_a_whole() -> None:
    lines = "\n".join(
        f'[faults.{kind}]\nkind = "{kind}"\nstart = {BEGIN}\n{text}' for kind, text, _ in IN_A_SYSTEM
    )
    case = next(iter(scenario.parse(SYSTEM + lines, Path("all.cosim.toml")).cases()))
    names = ["imu.gyro", "imu.mag", "estimator.q"]
    with Instances() as instances:
        chain = running.assemble(case, instances, Path()).run(4.0, names)
        system = running.assemble(case, instances, Path())
    system.components["imu"] = StepByStep(system.components["imu"])
    begun = system.run(2.5, names)
    saved = system.save()
    rest = system.run(1.5, names)
    system.restore(saved)
    again = system.run(1.5, names)
    for name in names:
        assert same_bits(np.concatenate((begun[name], rest[name])), chain[name])
        assert same_bits(again[name], rest[name])


LOOP = """
template = "quadrotor-attitude"
duration = 2.0
wind.turbulence = 1.0
[faults.vibration]
kind = "vibration"
signal = "quadrotor.specific_force"
amplitude = 2.0
frequency = 130.0
[faults.room]
kind = "field"
signal = "imu.mag"
attitude = "quadrotor.q"
amount = [0.0, "5 uT", 0.0]
[faults.silence]
kind = "dropout"
signal = "imu.mag"
flag = "imu.mag_valid"
probability = 0.3
[faults.jitter]
kind = "jitter"
signal = "imu.gyro"
time = 0.008
[faults.late]
kind = "delay"
signal = "estimator.q"
time = 0.008
[faults.motor]
kind = "noise"
signal = "controller.rotor_speed_command"
std = 5.0
"""


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_a_loop_with_faults_goes_on_from_where_it_was_saved_bit_for_bit(method: str) -> None:
    case = next(iter(scenario.parse(LOOP, Path("loop.cosim.toml")).cases({"method": method})))
    names = ["quadrotor.q", "imu.gyro", "imu.mag", "imu.mag_valid", "estimator.q"]
    with Instances() as instances:
        whole = running.assemble(case, instances, Path()).run(2.0, names)
        system = running.assemble(case, instances, Path())
    begun = system.run(0.8, names)
    saved = system.save()
    first = system.run(1.2, names)
    system.restore(saved)
    again = system.run(1.2, names)
    system.reset()
    anew = system.run(2.0, names)
    for name in names:
        assert same_bits(np.concatenate((begun[name], first[name])), whole[name])
        assert same_bits(again[name], first[name])
        assert same_bits(anew[name], whole[name])


def test_a_field_needs_an_attitude_that_is_known_before_the_sensor() -> None:
    text = f'{SYSTEM}\n[faults.it]\nkind = "field"\nsignal = "imu.mag"\nattitude = "imu.q"\namount = 1e-5'
    with pytest.raises(ScenarioError, match=r"attitude = 'imu.q': imu has no such output; it has gyro"):
        recorded(text)
    late = text.replace('"imu.q"', '"other.q"').replace(
        'template = "estimation"', f'template = "estimation"\n{OTHER}'
    )
    with pytest.raises(
        SimulationError, match=r"'other.q' comes after imu.mag: name what the sensor is given"
    ):
        recorded(late)
