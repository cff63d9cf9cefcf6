"""Kalman-calibrated complementary filter (docs/accuracy.md), the readable twin of fmu_src/models/kcf/kcf.c.

The level frame is z down with a free heading; the magnetometer counts in the norm of its first sample. Every
run of a batch has its own slow step; where one run works and another waits is kept in masks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import frames, quaternion
from ahrs_fmu.estimators.common import LONGEST_STEP
from ahrs_fmu.estimators.filter import Filter
from ahrs_fmu.estimators.geometry import dot, down_of
from ahrs_fmu.estimators.state import Array, Condition, Mask, Parameters, Sample, select
from ahrs_fmu.frames import Frame
from ahrs_fmu.quaternion import cross

FIELD, IRON, GYRO, SCALE = slice(0, 3), slice(3, 6), slice(7, 10), slice(10, 19)
LATENCY = 6
CORRECTION = slice(7, 19)
"""Bias and scale of the gyroscope."""
N, G = 19, 12

PROFILE_TIME = {"hand": 3.5, "multirotor": 10.0}
"""s, time constant of the tilt."""
BIAS_GROWTH = np.radians(0.1)
"""rad/s, in bias_forget_time."""
REST_TIME, REST_START_TIME, REST_FILTER_TIME = 1.4999, 0.4999, 0.5
REST_GYRO, REST_ACCEL = np.radians(2.0), 0.5
IRON_VARIANCE_MAX = 4.0
IRON_MAX, SCALE_MAX, LATENCY_MAX = 10.0, 0.2, 0.1
SENSE_POWER, SENSE_OPPOSED = 0.5, 0.3
SENSE_LEAST_POWER, SENSE_CLEARLY = 0.15, 0.7
SENSE_GRAVITY = 0.85
SENSE_WINDOW = 10.0
LAG_MAX = 0.3
SETTLED = 20.0
MISFIT_MAX = 1e4
MAG_TIME_MAX = 0.2
VIEWS_AT_REST, VIEW_ANGLE, VIEWS_MAX = 0.02, 0.5, 1.0
RATE_BANDWIDTH = 10.0
"""rad/s."""
LOST = 0.03
TURNED = 6e-4
EVIDENCE_DECIDES = np.exp(8.0)
NEW, OPEN, ANSWERED = 0, 1, 2
CALM, SUSPECT, STRANGE, OTHER = 0, 1, 2, 3
VIEWS_REFUTE, VIEWS_PROVE = 6.0, 2.0
OLD_FIELD_TIME, OLD_FIELD_FITS = 2.0, 1.5
PHASES = 6


class State(NamedTuple):
    """State of the filter; the descriptor says what the fields mean, arrays have the batch in front.

    Attributes
    ----------
    x, cov : ndarray (..., 19), (..., 19, 19)
        Field, hard iron, latency, gyroscope bias, scale and misalignment; their covariance.
    q_int, q_tilt, q_level, q_north : ndarray (..., 4)
        Integrated gyroscope; inertial to level frame, without and with its lag made good; to magnetic north.
    heading : ndarray (..., 2)
        Cosine and sine of half the angle from the level frame to magnetic north.
    block_time, force_time, sum_force, sum_error, sum_sens, sum_rate2, turn : ndarray
        Sums since the last slow step; `sum_sens` is (..., 3, 12).
    blind : ndarray (...)
        Time for which the gyroscope has been held, s.
    rate : ndarray (..., 3)
        Rate of the sample before.
    mag, mag_q, mag_rate, mag_time, mag_fresh : ndarray
        Last usable magnetometer sample.
    rest_one, rest_two, rest_gyro, rest_count, rest_age, rest_time : ndarray
        Rest detection.
    tilt_age, tilt_slope, tilt_force : ndarray
        Low-passed force.
    sens_level, sens_slope : ndarray (..., 2, 13)
        Low-passed sensitivities.
    phase : ndarray (...) of int
        Next part of the slow step.
    job_rest, job_drifts, job_field, job_first : ndarray (...) of bool
        What the slow step under way has to do.
    job_time, job_vertical, job_drift, job_rate2, job_q, job_mag, job_rate, job_mag_time, job_nu : ndarray
        What it works with.
    job_expected, job_variance : ndarray (...)
        Variance of a magnetometer sample, and of its update.
    dx : ndarray (..., 19)
        Corrections it has collected.
    mag_scale, misfit, excess : ndarray (...)
        Magnetometer: unit, mean squared misfit, its excess.
    change : ndarray (...) of int
        The field: as it was, suspect, another one and not known, another one and known.
    iron_known, change_views, fit_views, old_misfit, calm_field, calm_iron, north_angle : ndarray
        What tells a change of the field from one of the hard iron.
    question : ndarray (...) of int
        Is the magnetometer calibrated: not yet asked, open, answered.
    alt_x, alt_cov, alt_q, alt_misfit, alt_jump, alt_probability : ndarray
        The hypothesis that it is not.
    seen_force, seen_field, has_seen_force, has_seen_field, sense, sense_power : ndarray
        Comparison of the senses of rotation; `sense` is (..., 2, 3).
    realign, first_kept, reset : ndarray (...) of bool
        The heading is lost; the first sample waits for the second; the covariance was reset.
    """

    x: Array
    cov: Array
    q_int: Array
    q_tilt: Array
    q_level: Array
    q_north: Array
    heading: Array
    block_time: Array
    force_time: Array
    sum_force: Array
    sum_error: Array
    sum_sens: Array
    sum_rate2: Array
    turn: Array
    blind: Array
    rate: Array
    mag: Array
    mag_q: Array
    mag_rate: Array
    mag_time: Array
    mag_fresh: Mask
    rest_one: Array
    rest_two: Array
    rest_gyro: Array
    rest_count: Array
    rest_age: Array
    rest_time: Array
    tilt_age: Array
    tilt_slope: Array
    tilt_force: Array
    sens_level: Array
    sens_slope: Array
    phase: NDArray[np.int64]
    job_rest: Mask
    job_drifts: Mask
    job_field: Mask
    job_first: Mask
    job_time: Array
    job_vertical: Array
    job_drift: Array
    job_rate2: Array
    job_q: Array
    job_mag: Array
    job_rate: Array
    job_mag_time: Array
    job_nu: Array
    job_expected: Array
    job_variance: Array
    dx: Array
    mag_scale: Array
    misfit: Array
    excess: Array
    change: NDArray[np.int64]
    iron_known: Mask
    change_views: Array
    fit_views: Array
    old_misfit: Array
    calm_field: Array
    calm_iron: Array
    north_angle: Array
    question: NDArray[np.int64]
    alt_x: Array
    alt_cov: Array
    alt_q: Array
    alt_misfit: Array
    alt_jump: Array
    alt_probability: Array
    seen_force: Array
    seen_field: Array
    has_seen_force: Mask
    has_seen_field: Mask
    sense: Array
    sense_power: Array
    realign: Mask
    first_kept: Mask
    reset: Mask


SHAPES: dict[str, tuple[int, ...]] = {
    "x": (N,),
    "cov": (N, N),
    "sum_sens": (3, G),
    "heading": (2,),
    "north_angle": (2,),
    "rest_one": (6,),
    "rest_two": (6,),
    "sens_level": (2, G + 1),
    "sens_slope": (2, G + 1),
    "job_vertical": (G,),
    "dx": (N,),
    "alt_x": (6,),
    "alt_cov": (6, 6),
    "sense": (2, 3),
    "sense_power": (2, 3),
    **dict.fromkeys(("q_int", "q_tilt", "q_level", "q_north", "mag_q", "job_q", "alt_q"), (4,)),
    **dict.fromkeys(("sum_force", "sum_error", "turn", "rate", "mag", "mag_rate", "rest_gyro"), (3,)),
    **dict.fromkeys(("tilt_slope", "tilt_force", "job_drift", "job_mag", "job_rate", "job_nu"), (3,)),
    **dict.fromkeys(("seen_force", "seen_field", "calm_field", "calm_iron"), (3,)),
}
"""Trailing shapes of the fields of `State` that are not scalars."""

MASKS = frozenset(
    (
        "mag_fresh",
        "job_rest",
        "job_drifts",
        "job_field",
        "job_first",
        "has_seen_force",
        "has_seen_field",
        "realign",
        "first_kept",
        "iron_known",
        "reset",
    )
)
INTEGERS = frozenset(("phase", "change", "question"))


class Work:
    """A state that is being changed: fields by name, assigned whole or where a mask holds."""

    def __init__(self, state: State) -> None:
        self.now = state._asdict()

    def __getitem__(self, name: str) -> Array:
        """Give a field of numbers."""
        array: Array = self.now[name]
        return array

    def mask(self, name: str) -> Mask:
        """Give a field of truth values."""
        array: Mask = self.now[name]
        return array

    def __setitem__(self, name: str, value: NDArray[np.generic]) -> None:
        """Assign a whole field."""
        self.now[name] = value

    def put(self, where: Mask, name: str, value: NDArray[np.generic] | float) -> None:
        """Assign where a mask holds."""
        old = self.now[name]
        self.now[name] = select(where, np.broadcast_to(np.asarray(value, dtype=old.dtype), old.shape), old)

    def state(self) -> State:
        """Give the changed state."""
        return State(**self.now)


class KCF(Filter[State]):
    """Tilt from an average in a slowly moving frame; a slow Kalman filter calibrates the sensors."""

    def initial(self, q: Array) -> State:
        """Start at q with nothing learned."""
        s = Work(empty_state(self.shape))
        s["cov"] = np.broadcast_to(initial_covariance(self.p), (*self.shape, N, N))
        for name in ("q_int", "mag_q", "job_q", "alt_q"):
            s[name] = np.broadcast_to(quaternion.IDENTITY, (*self.shape, 4))
        for name in ("q_tilt", "q_level", "q_north"):
            s[name] = q
        s["heading"] = np.broadcast_to(np.array([1.0, 0.0]), (*self.shape, 2))
        s["phase"] = np.full(self.shape, PHASES)
        s["misfit"] = np.ones(self.shape)
        if self.p.initialisation == "given":
            s["tilt_force"] = self.p.gravity * down_of(q)
            s["tilt_age"] = np.full(self.shape, tilt_time(self.p))
        return s.state()

    def turned(self, state: State, q: Array) -> State:
        """Take over the heading."""
        level = quaternion.multiply(state.q_level, state.q_int)
        d = quaternion.multiply(q, quaternion.conjugate(level))[..., ::3]
        heading = d / np.sqrt(dot(d, d))[..., None]
        return state._replace(heading=heading, q_north=facing_north(heading, state.q_level))

    def step(self, state: State, q: Array, z: Sample) -> tuple[State, Array]:  # noqa: ARG002
        """Integrate one sample; average tilt and learn at the end of a slow period."""
        s = Work(state)
        s["reset"] = np.zeros(self.shape, dtype=np.bool_)
        kept = s.mask("first_kept") & z.run
        if kept.any():
            self._sample(s, first_sample(s, z, min(z.dt, self.p.slow_period)), kept, 0.0)
            s.put(kept, "first_kept", 0.0)
        held = self.common.has(Condition.GYRO_HELD)
        over = z.run & ((s["blind"] > 0.0) & ~held | (z.dt > LONGEST_STEP))
        if over.any():
            account_for_blindness(s, self.p, z, over)
        s.put(z.run, "blind", np.where(held, s["blind"] + z.dt, 0.0))
        self._sample(s, z, z.run, z.dt)
        return s.state(), quaternion.multiply(s["q_north"], s["q_int"])

    def _sample(self, s: Work, z: Sample, where: Mask, turn_time: float) -> None:
        p = self.p
        integrate(s, p, z, where, turn_time)
        detect_rest(s, z, where)
        half = 0.499 * z.dt
        due = where & (s["block_time"] + half >= p.slow_period)
        if due.any():
            run_phases(s, p, np.where(due, PHASES, 0))
            begin_slow_step(s, p, z, due)
        until = np.full(self.shape, PHASES)
        if p.spread:
            done = np.minimum((s["block_time"] + half) / p.slow_period, 1.0)
            until = (PHASES * done).astype(np.int64)
        run_phases(s, p, np.where(where, until, 0))

    def _advance(self, z: Sample) -> None:
        super()._advance(z)
        if z.start.any():
            s = Work(self.state)
            s.put(z.start, "rate", z.rate)
            s.put(z.start, "seen_force", z.force)
            s.put(z.start, "mag", z.mag)
            s.put(z.start, "has_seen_force", z.force_usable)
            s.put(z.start, "mag_fresh", z.mag_usable)
            s.put(z.start, "first_kept", 1.0)
            self.state = s.state()
        if z.run.any():
            self.common.assign(Condition.MAG_DISTURBED, disturbed(self.state, self.p), z.run)
            self.common.assign(Condition.IMPLAUSIBLE, implausible(self.state, self.p), z.run)

    def gyro_bias(self, state: State) -> Array:
        """Give the learned bias."""
        return state.x[..., GYRO]

    def covariance_reset(self, state: State) -> Mask:
        """Where the last step had to reset the covariance."""
        return state.reset

    def outputs(self) -> dict[str, NDArray[np.generic]]:
        """Give the outputs of the model by name, in the axes of the user."""
        s, frame = self.state, Frame(self.p.frame)
        result = super().outputs()
        with np.errstate(divide="ignore", invalid="ignore"):
            unit = np.where(s.mag_scale > 0.0, 1.0 / s.mag_scale, 0.0)
        signs = frames.body_vector(np.ones(3), Frame.NED, frame)
        field, p = s.x[..., FIELD], s.cov
        horizontal2 = field[..., 0] ** 2 + field[..., 1] ** 2
        across = field[..., 1] ** 2 * p[..., 0, 0] + field[..., 0] ** 2 * p[..., 1, 1]
        across = across - 2.0 * field[..., 0] * field[..., 1] * p[..., 1, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            std = np.minimum(np.sqrt(np.maximum(across, 0.0)) / horizontal2, np.pi)
        result["rate"] = frames.body_vector(
            self.common.gyro - gyro_error(s.x, self.common.gyro), Frame.NED, frame
        )
        result["hard_iron"] = signs * s.x[..., IRON] * unit[..., None]
        result["gyro_scale"] = np.outer(signs, signs).ravel() * s.x[..., SCALE]
        result["mag_latency"] = s.x[..., LATENCY]
        result["local_field"] = np.stack((unit * np.sqrt(horizontal2), unit * field[..., 2]), axis=-1)
        result["heading_std"] = np.where(horizontal2 > 0.0, std, np.pi)
        result["disturbance"] = s.misfit
        result["uncalibrated"] = s.alt_probability
        result["at_rest"] = s.rest_time >= REST_TIME
        result["mag_disturbed"] = disturbed(s, self.p)
        result["implausible"] = implausible(s, self.p)
        return result


def empty_state(shape: tuple[int, ...]) -> State:
    """All zero and false, for a batch of `shape`."""

    def kind(name: str) -> type[np.generic]:
        return np.bool_ if name in MASKS else np.int64 if name in INTEGERS else np.float64

    return State(*(np.zeros((*shape, *SHAPES.get(name, ())), dtype=kind(name)) for name in State._fields))


def tilt_time(p: Parameters) -> float:
    """Time constant of the tilt, s."""
    return float(PROFILE_TIME.get(p.profile, p.accel_time_constant))


def initial_covariance(p: Parameters) -> Array:
    """Covariance (19, 19) before anything is learned."""
    scale = np.full((3, 3), p.gyro_misalignment_std**2)
    np.fill_diagonal(scale, p.gyro_scale_std**2)
    blocks = ([1.0] * 3, [p.hard_iron_std**2] * 3, [p.mag_latency_std**2], [p.bias_std**2] * 3, scale.ravel())
    return np.diag(np.concatenate([np.asarray(block) for block in blocks]))


def gyro_error(x: Array, gyro: Array) -> Array:
    """What has been learned of the error of a gyroscope sample (..., 3)."""
    scale = x[..., SCALE].reshape(*x.shape[:-1], 3, 3)
    return x[..., GYRO] + rotated(scale, gyro)


def rotated(m: Array, v: Array) -> Array:
    """Matrices (..., 3, 3) times vectors (..., 3)."""
    product: Array = np.einsum("...ij,...j->...i", m, v)
    return product


def facing_north(heading: Array, q_level: Array) -> Array:
    """Level frame turned by the heading."""
    zero = np.zeros_like(heading[..., 0])
    return quaternion.multiply(np.stack((heading[..., 0], zero, zero, heading[..., 1]), axis=-1), q_level)


def first_sample(s: Work, z: Sample, dt: float) -> Sample:
    """The first sample as it was kept, with the interval of the second."""
    force_usable, mag_usable = s.mask("has_seen_force"), s.mask("mag_fresh")
    sample = z._replace(
        rate=s["rate"],
        force=s["seen_force"],
        accel=s["seen_force"],
        mag=s["mag"],
        force_usable=force_usable,
        accel_usable=force_usable,
        mag_usable=mag_usable,
        dt=dt,
        gain_dt=dt,
    )
    kept = s.mask("first_kept")
    s.put(kept, "has_seen_force", 0.0)
    s.put(kept, "mag_fresh", 0.0)
    return sample


def rotation(s: Work, p: Parameters, rate: Array, where: Mask, dt: float) -> Array:
    """Rotation vector (..., 3) over one sample, to second order in the change of the rate."""
    before = s["rate"]
    s.put(where, "rate", rate)
    if not p.refine or dt <= 0.0:
        return rate * dt
    mean = 0.5 * (before + rate) if p.gyro_sampling == "instant" else rate
    return cross(before, rate) * (dt * dt / 12.0) + dt * mean


def integrate(s: Work, p: Parameters, z: Sample, where: Mask, turn_time: float) -> None:
    """Integrate the rate and the sums that the slow step needs."""
    dt, g = z.dt, z.rate
    c = gyro_error(s["x"], g)
    w = g - c
    angle = rotation(s, p, w, where, turn_time)
    q = quaternion.multiply(s["q_int"], quaternion.exp(angle))
    q = q * (1.5 - 0.5 * dot(q, q))[..., None]
    s.put(where, "q_int", q)
    s.put(where, "turn", s["turn"] + angle)
    r = quaternion.to_matrix(q)
    s.put(where, "sum_error", s["sum_error"] + dt * rotated(r, c))
    by_gyro = (dt * r)[..., :, :, None] * g[..., None, None, :]
    sens = np.concatenate((dt * r, by_gyro.reshape(*by_gyro.shape[:-2], 9)), axis=-1)
    s.put(where, "sum_sens", s["sum_sens"] + sens)
    s.put(where, "sum_rate2", s["sum_rate2"] + dt * dot(w, w))
    s.put(where, "block_time", s["block_time"] + dt)
    forced = where & z.accel_usable
    s.put(forced, "sum_force", s["sum_force"] - dt * rotated(r, z.accel))
    s.put(forced, "force_time", s["force_time"] + dt)
    s.put(where, "mag_time", s["mag_time"] + dt)
    fresh = where & z.mag_usable
    s.put(fresh, "mag", z.mag)
    s.put(fresh, "mag_q", q)
    s.put(fresh, "mag_rate", w)
    s.put(fresh, "mag_fresh", 1.0)


def detect_rest(s: Work, z: Sample, where: Mask) -> None:
    """Low-pass gyroscope and accelerometer, see whether they stay near their averages."""
    usable = where & z.force_usable & ~(s["blind"] > 0.0)
    values = np.concatenate((z.rate, z.force), axis=-1)
    starting = usable & (s["rest_age"] < REST_START_TIME)
    running = usable & ~starting
    low = values
    if starting.any():
        s.put(starting, "rest_age", s["rest_age"] + z.dt)
        s.put(starting, "rest_count", s["rest_count"] + 1.0)
        s.put(starting, "rest_two", s["rest_two"] + values)
        mean = s["rest_two"] / s["rest_count"][..., None]
        s.put(starting & (s["rest_age"] >= REST_START_TIME), "rest_two", mean)
        low = select(starting, mean, low)
    if running.any():
        g = np.tan(z.dt / (np.sqrt(2.0) * REST_FILTER_TIME))
        a = 1.0 / (1.0 + g * (g + np.sqrt(2.0)))
        b, c = g * a, g * g * a
        one, two = s["rest_one"], s["rest_two"]
        filtered = two + b * one + c * (values - two)
        s.put(running, "rest_one", 2.0 * (a * one + b * (values - two)) - one)
        s.put(running, "rest_two", 2.0 * filtered - two)
        low = select(running, filtered, low)
    off = values - low
    s.put(usable, "rest_gyro", low[..., :3])
    gyro, accel = off[..., :3], off[..., 3:]
    quiet = (dot(gyro, gyro) < REST_GYRO**2) & (dot(accel, accel) < REST_ACCEL**2)
    quiet = quiet & (np.abs(low[..., :3]) <= REST_GYRO).all(axis=-1)
    s.put(where, "rest_time", np.where(usable & quiet, np.minimum(s["rest_time"] + z.dt, 2 * REST_TIME), 0.0))


def begin_slow_step(s: Work, p: Parameters, z: Sample, due: Mask) -> None:
    """Level the frame, follow the sensitivities, set up what the rest of the slow step works with."""
    interval, tau = s["block_time"], tilt_time(p)
    force = due & (s["force_time"] > 0.0)
    s.put(force, "tilt_age", np.minimum(s["tilt_age"] + interval, 100.0 * tau))
    speed = np.sqrt(2.0) / np.minimum(tau, np.maximum(s["tilt_age"], 2.0 * interval))
    pull = np.where(force, interval * speed**2, 0.0)
    inverse = 1.0 / (1.0 + np.sqrt(2.0) * speed * interval + (speed * interval) ** 2)
    e = level(s, interval, pull, inverse, due)
    follow_sensitivities(s, interval, pull, inverse, due)
    make_good_lag(s, p, due)

    s.put(due, "job_time", interval)
    s.put(due, "job_rate2", s["sum_rate2"] / interval)
    rest = due & (s["rest_time"] >= REST_TIME)
    drifts = force & ~rest
    s.put(due, "job_rest", rest)
    s.put(due, "job_drifts", drifts)
    s.put(rest, "job_drift", s["rest_gyro"] - s["x"][..., GYRO])
    sens = s["sens_slope"]
    learned = np.einsum("...ik,...k->...i", sens[..., :G], s["x"][..., CORRECTION])
    tilt_rate = np.stack((-e[..., 1], e[..., 0]), axis=-1) / interval[..., None]
    rows = tilt_rate + sens[..., G] - learned
    s.put(drifts, "job_drift", np.concatenate((rows, s["job_drift"][..., 2:]), axis=-1))
    compare_all_senses(s, p, z, due)

    fresh = due & s.mask("mag_fresh") & np.bool_(p.use_mag)
    first = fresh & ~(s["mag_scale"] > 0.0)
    s.put(due, "job_field", fresh)
    s.put(due, "job_first", first)
    s.put(first, "mag_scale", 1.0 / np.sqrt(dot(s["mag"], s["mag"])))
    s.put(fresh, "job_mag", s["mag"] * s["mag_scale"][..., None])
    s.put(fresh, "job_q", quaternion.multiply(s["q_level"], s["mag_q"]))
    s.put(fresh, "job_rate", s["mag_rate"])
    s.put(fresh, "job_mag_time", np.minimum(s["mag_time"], np.maximum(MAG_TIME_MAX, interval)))
    s.put(fresh, "mag_time", 0.0)
    s.put(due, "mag_fresh", 0.0)
    s.put(due, "dx", 0.0)
    clear_block(s, due)
    s.put(due, "phase", 0.0)


def clear_block(s: Work, where: Mask) -> None:
    """Begin the sums of a slow period."""
    for name in ("sum_force", "sum_error", "sum_sens", "turn", "sum_rate2", "block_time", "force_time"):
        s.put(where, name, 0.0)


def level(s: Work, interval: Array, pull: Array, inverse: Array, due: Mask) -> Array:
    """Low-pass the force and turn the level frame so that it is vertical; the tilt error (..., 3) before."""
    mean = s["sum_force"] / s["force_time"][..., None]
    pulled = due & (pull > 0.0)
    s.put(pulled & ~(s["tilt_age"] > interval), "tilt_force", mean)
    s.put(pulled, "tilt_slope", s["tilt_slope"] + pull[..., None] * (mean - s["tilt_force"]))
    s.put(due, "tilt_slope", s["tilt_slope"] * inverse[..., None])
    s.put(due, "tilt_force", s["tilt_force"] + interval[..., None] * s["tilt_slope"])
    q = s["q_tilt"]
    turned = quaternion.rotate(q, s["tilt_force"])
    length = np.sqrt(dot(turned, turned))
    known = length > 0.0
    e = select(known, turned / length[..., None], np.broadcast_to(np.array([0.0, 0.0, 1.0]), turned.shape))
    along = 1.0 + e[..., 2]
    step = np.stack((along, e[..., 1], -e[..., 0], np.zeros_like(along)), axis=-1)
    half_turn = np.broadcast_to(np.array([0.0, 1.0, 0.0, 0.0]), step.shape)
    step = select(along > 2e-12, step, half_turn)
    s.put(due & known, "q_tilt", quaternion.normalise(quaternion.multiply(step, q)))
    return e


def follow_sensitivities(s: Work, interval: Array, pull: Array, inverse: Array, due: Mask) -> None:
    """Take the sensitivities into the level frame, its horizontal rows through the low-pass of the force."""
    columns = np.concatenate((s["sum_sens"], s["sum_error"][..., None]), axis=-1)
    turned = quaternion.to_matrix(s["q_tilt"]) @ columns
    rows = turned[..., :2, :] / interval[..., None, None]
    grown = s["sens_level"] + interval[..., None, None] * (rows - s["sens_slope"])
    s.put(due, "sens_level", grown)
    s.put(due, "sens_slope", (s["sens_slope"] + pull[..., None, None] * grown) * inverse[..., None, None])
    s.put(due, "job_vertical", turned[..., 2, :G])


def make_good_lag(s: Work, p: Parameters, due: Mask) -> None:
    """Turn the level frame by the drift that has since become known."""
    sens = s["sens_level"]
    lag = np.einsum("...ik,...k->...i", sens[..., :G], s["x"][..., CORRECTION]) - sens[..., G]
    lag = -0.5 * np.clip(lag, -LAG_MAX, LAG_MAX) if p.refine else np.zeros_like(lag)
    turn = np.stack(
        (np.ones_like(lag[..., 0]), lag[..., 0], lag[..., 1], np.zeros_like(lag[..., 0])), axis=-1
    )
    q_level = quaternion.multiply(quaternion.normalise(turn), s["q_tilt"])
    s.put(due, "q_level", q_level)
    s.put(due, "q_north", facing_north(s["heading"], q_level))


def compare_all_senses(s: Work, p: Parameters, z: Sample, due: Mask) -> None:
    """Correlate the turns of force and field with the one that the gyroscope predicts."""
    scale = s["mag_scale"][..., None]
    pairs = (
        ("seen_force", "has_seen_force", z.force / p.gravity, z.force_usable),
        (
            "seen_field",
            "has_seen_field",
            z.mag * scale - s["x"][..., IRON],
            z.mag_usable & (scale[..., 0] > 0),
        ),
    )
    for i, (seen, has_seen, now, usable) in enumerate(pairs):
        both = due & usable & s.mask(has_seen)
        if both.any():
            sense, power = compare_senses(
                s["sense"][..., i, :], s["sense_power"][..., i, :], now, s[seen], s["turn"]
            )
            for name, value in (("sense", sense), ("sense_power", power)):
                merged = s[name].copy()
                merged[..., i, :] = select(both, value, merged[..., i, :])
                s[name] = merged
        s.put(due & usable, seen, now)
        s.put(due, has_seen, usable)


def compare_senses(sense: Array, power: Array, now: Array, before: Array, turn: Array) -> tuple[Array, Array]:
    """Correlation and power of the predicted turn, axis by axis, over a window of rotation."""
    v = 0.5 * (now + before)
    predicted = -cross(turn[..., :, None] * np.eye(3), v[..., None, :])
    rest = (now - before) - predicted.sum(axis=-2)
    norm2 = dot(predicted, predicted)
    kept = SENSE_WINDOW / (SENSE_WINDOW + norm2)
    return kept * (sense + norm2 + np.einsum("...ik,...k->...i", predicted, rest)), kept * (power + norm2)


def disturbed(s: State, p: Parameters) -> Mask:
    """Where the field does not fit what has been learned."""
    return np.asarray((s.misfit > p.jump_threshold) | (s.change >= STRANGE))


def implausible(s: State, p: Parameters) -> Mask:
    """Where sensors turn in opposite senses."""
    enough = np.where(s.sense_power > SENSE_POWER, SENSE_OPPOSED, SENSE_CLEARLY)
    opposed = np.asarray(
        ((s.sense_power > SENSE_LEAST_POWER) & (s.sense < -enough * s.sense_power)).any(axis=-1)
    )
    no_gravity = dot(s.tilt_force, s.tilt_force) < (SENSE_GRAVITY * p.gravity) ** 2
    return np.asarray(opposed[..., 1] | (opposed[..., 0] & no_gravity))


def measure(cov: Array, dx: Array, h: Array, innovation: Array, variance: Array) -> tuple[Array, Array, Mask]:
    """Scalar measurement of h x: covariance and collected corrections after it, and where it was sound."""
    y = np.einsum("...ij,...j->...i", cov, h)
    total = variance + dot(h, y)
    innovation = innovation - dot(h, dx)
    sound = (total >= variance) & np.isfinite(total) & np.isfinite(innovation)
    corrected = cov - y[..., :, None] * y[..., None, :] / total[..., None, None]
    return corrected, dx + y * (innovation / total)[..., None], sound


def learn(s: Work, p: Parameters, where: Mask, h: Array, innovation: Array, variance: Array) -> None:
    """Use scalar measurements (..., n) with rows h (..., n, 19); where the covariance is lost, begin anew."""
    if not where.any():
        return
    cov, dx, sound = s["cov"], s["dx"], where
    for i in range(h.shape[-2]):
        cov, dx, good = measure(cov, dx, h[..., i, :], innovation[..., i], variance)
        sound = sound & good
    s.put(sound, "cov", cov)
    s.put(sound, "dx", dx)
    lose_covariance(s, p, where & ~sound)


def lose_covariance(s: Work, p: Parameters, where: Mask) -> None:
    """Return to the first covariance, forget the corrections under way."""
    if where.any():
        s.put(where, "cov", initial_covariance(p))
        s.put(where, "dx", 0.0)
        s.put(where, "reset", 1.0)


def on_diagonal(n: int, first: int, variance: Array) -> Array:
    """Matrices (..., n, n) with a variance (...) on three elements of the diagonal."""
    mark = np.zeros(n)
    mark[first : first + 3] = 1.0
    return variance[..., None, None] * np.diag(mark)


def field_turn(n: int, field: Array, variance: Array) -> Array:
    """Covariance (..., n, n) that a turn of the level frame adds, the field first."""
    u = np.zeros((*field.shape[:-1], n))
    u[..., 0], u[..., 1] = -field[..., 1], field[..., 0]
    return variance[..., None, None] * u[..., :, None] * u[..., None, :]


def couple(s: Work, p: Parameters, where: Mask) -> None:
    """Let the errors of the gyroscope turn the level frame, and with it the field."""
    cov = s["cov"].copy()
    growth = BIAS_GROWTH**2 / p.bias_forget_time * s["job_time"]
    for i in range(GYRO.start, GYRO.stop):
        cov[..., i, i] += np.where(cov[..., i, i] < p.bias_std**2, growth, 0.0)
    h = np.zeros((*where.shape, N))
    h[..., CORRECTION] = s["job_vertical"]
    y = np.einsum("...ij,...j->...i", cov, h)
    u = np.zeros_like(h)
    u[..., 0], u[..., 1] = -s["x"][..., 1], s["x"][..., 0]
    uy = u[..., :, None] * y[..., None, :]
    cov = cov + uy + np.swapaxes(uy, -1, -2) + field_turn(N, s["x"], dot(h, y))
    s.put(where, "cov", cov)


def learn_gyro(s: Work, p: Parameters, where: Mask) -> None:
    """Learn from the low-passed gyroscope at rest, from the drift of the tilt in motion."""
    couple(s, p, where)
    innovation = np.clip(s["job_drift"], -p.bias_limit, p.bias_limit)
    at_rest = np.zeros((*where.shape, 3, N))
    at_rest[..., GYRO] = np.eye(3)
    learn(s, p, where & s.mask("job_rest"), at_rest, innovation, drift_variance(s, p, p.rest_drift_std))
    in_motion = np.zeros((*where.shape, 2, N))
    in_motion[..., CORRECTION] = s["sens_slope"][..., :G]
    young = np.maximum(1.0, (tilt_time(p) / s["tilt_age"]) ** 2)
    variance = drift_variance(s, p, p.motion_drift_std) * young
    learn(s, p, where & s.mask("job_drifts"), in_motion, innovation[..., :2], variance)


def drift_variance(s: Work, p: Parameters, accuracy: float) -> Array:
    """Variance of one slow step of a drift that a bias, which walks, shows to this accuracy."""
    r, interval = accuracy**2, s["job_time"]
    variance: Array = (r * r / (BIAS_GROWTH**2 / p.bias_forget_time) + r * interval) / interval
    return variance


def level_field(s: Work, r: Array, hard_iron: Array) -> Array:
    """The sample (..., 3) as it would read without hard iron and latency, in the level frame."""
    lag = s["x"][..., LATENCY, None]
    m = s["job_mag"] - hard_iron
    first = cross(s["job_rate"], m)
    second = cross(s["job_rate"], first)
    return rotated(r, (m - lag * first) + 0.5 * lag * lag * second)


def excess_of(
    p: Parameters, misfit: Array, ratio: Array, expected: Array, interval: Array
) -> tuple[Array, Array]:
    """Mean squared misfit over jump_time, and the variance it has in excess of the expected one."""
    weight = np.minimum(interval / p.jump_time, 1.0)
    misfit = misfit + weight * (np.minimum(ratio, MISFIT_MAX) - misfit)
    return misfit, np.minimum(expected * np.maximum(0.0, misfit - p.jump_threshold), 1.0)


def rotation_difference(q: Array, r: Array) -> Array:
    """Squared difference of two rotation matrices, summed."""
    return 8.0 * np.maximum(1.0 - dot(q, r) ** 2, 0.0)


def follow_field(s: Work, p: Parameters, where: Mask) -> None:
    """Let the field walk and turn, then see what the magnetometer says."""
    interval = s["job_time"]
    heading = (p.heading_walk**2 + p.heading_rate_walk**2 * s["job_rate2"]) * interval
    field = p.field_walk**2 * interval
    s.put(where, "cov", s["cov"] + on_diagonal(N, 0, field) + field_turn(N, s["x"], heading))
    asked = where & (s["question"] == OPEN)
    s.put(asked, "alt_cov", s["alt_cov"] + on_diagonal(6, 0, field) + field_turn(6, s["alt_x"], heading))
    seen = where & s.mask("job_field")
    if seen.any():
        expect_field(s, p, seen)


def aligned(field: Array, seen: Array) -> Array:
    """Field turned about the vertical to where it is seen."""
    have2, want2 = dot(field[..., :2], field[..., :2]), dot(seen[..., :2], seen[..., :2])
    turned = np.concatenate((np.sqrt(have2 / want2)[..., None] * seen[..., :2], field[..., 2:]), axis=-1)
    return select(want2 > 0.0, turned, field)


def expect_field(s: Work, p: Parameters, where: Mask) -> None:
    """Innovation of the magnetometer, its noise, and how far field and hard iron may have changed with it."""
    interval = s["job_mag_time"]
    r = quaternion.to_matrix(s["job_q"])
    field = level_field(s, r, s["x"][..., IRON])
    put_part(s, where & s.mask("job_first"), "x", FIELD, field)
    lost = where & s.mask("realign")
    if lost.any():
        put_part(s, lost, "x", slice(0, 2), aligned(s["x"], field)[..., :2])
        put_part(
            s,
            lost,
            "alt_x",
            slice(0, 2),
            aligned(s["alt_x"], level_field(s, r, s["alt_x"][..., 3:]))[..., :2],
        )
        s.put(lost, "realign", 0.0)
        s.put(lost, "change", CALM)
    rate2 = dot(s["job_rate"], s["job_rate"])
    age = s["tilt_age"] / tilt_time(p)
    settling = np.where(age < SETTLED, p.mag_tilt_noise**2 * np.exp(-age), 0.0)
    expected = p.mag_noise**2 + p.mag_rate_noise**2 * rate2 + settling
    judge_field(s, p, where, r, expected)
    nu = level_field(s, r, s["x"][..., IRON]) - s["x"][..., FIELD]
    s.put(where, "job_nu", nu)
    misfit2 = dot(nu, nu) / 3.0
    ratio = misfit2 / expected
    misfit, excess = excess_of(p, s["misfit"], ratio, expected, interval)
    s.put(where, "misfit", misfit)
    s.put(where, "job_expected", expected)
    outlier = 1.0 + p.outlier_weight * np.maximum(0.0, ratio - 1.0)
    s.put(where, "job_variance", p.mag_density**2 / interval * expected / p.mag_noise**2 * outlier)
    cov = s["cov"].copy()
    jump = (p.hard_iron_walk**2 + p.jump_hard_iron * excess) * interval
    for i in range(IRON.start, IRON.stop):
        cov[..., i, i] += np.where(cov[..., i, i] < IRON_VARIANCE_MAX, jump, 0.0)
    s.put(where, "cov", cov + on_diagonal(N, 0, p.jump_field * s["excess"] * interval))
    s.put(where, "excess", excess)
    asked = where & (s["question"] == OPEN)
    if asked.any():
        unexplained = p.uncalibrated_std**2 * rotation_difference(s["job_q"], s["alt_q"]) / 3.0
        change_alternative(s, p, misfit2 / (expected + unexplained), asked)


def renew_field(s: Work, p: Parameters, where: Mask, field: Array, variance: float, change: int) -> None:
    """Take field and hard iron from before a change, or the field that is seen."""
    if not where.any():
        return
    put_part(s, where, "x", FIELD, field)
    put_part(s, where, "x", IRON, s["calm_iron"])
    cov = s["cov"].copy()
    cov[..., :6, :], cov[..., :, :6] = 0.0, 0.0
    cov[..., :6, :6] = np.diag([variance] * 3 + [p.hard_iron_std**2] * 3)
    s.put(where, "cov", cov)
    for name, value in (("misfit", 1.0), ("excess", 0.0), ("old_misfit", MISFIT_MAX), ("change", change)):
        s.put(where, name, value)
    for name in ("change_views", "fit_views"):
        s.put(where, name, 0.0)


def judge_field(s: Work, p: Parameters, where: Mask, r: Array, expected: Array) -> None:
    """Tell a change of the field from one of the hard iron, and keep north until the old field is back."""
    misfit, fits = s["misfit"] > p.jump_threshold, s["misfit"] < 0.5 * p.jump_threshold
    views = s["job_mag_time"] * np.minimum(VIEWS_MAX, np.sqrt(s["job_rate2"]) / VIEW_ANGLE)
    s.put(where, "change_views", s["change_views"] + np.where(misfit, views, 0.0))
    s.put(where, "fit_views", np.where(fits, s["fit_views"] + views, 0.0))
    certain = (np.diagonal(s["cov"], axis1=-2, axis2=-1)[..., IRON] < p.hard_iron_std**2).all(axis=-1)
    certain = certain & (s.mask("iron_known") | (s["fit_views"] > VIEWS_REFUTE))
    s.put(where & (s["change"] == CALM) & ~misfit, "iron_known", certain)
    calm = (s["change"] == CALM) & ~(misfit & s.mask("iron_known"))
    calm = where & ((s["question"] == OPEN) | calm | (not p.refine))
    s.put(calm, "calm_field", s["x"][..., FIELD])
    s.put(calm, "calm_iron", s["x"][..., IRON])
    s.put(calm, "change_views", 0.0)
    suspect = where & ~calm & (s["change"] <= SUSPECT)
    changed = where & ~calm & ~suspect
    s.put(calm, "change", CALM)
    s.put(suspect, "change", np.where(s["fit_views"] > VIEWS_PROVE, CALM, SUSPECT))
    refuted = suspect & (s["change_views"] > VIEWS_REFUTE)
    renew_field(s, p, refuted, level_field(s, r, s["calm_iron"]), 1.0, STRANGE)
    if not changed.any():
        return
    off = level_field(s, r, s["calm_iron"]) - s["calm_field"]
    ratio = np.minimum(dot(off, off) / (3.0 * expected), MISFIT_MAX)
    weight = np.where(s["old_misfit"] < MISFIT_MAX, np.minimum(s["job_mag_time"] / OLD_FIELD_TIME, 1.0), 1.0)
    s.put(changed, "old_misfit", s["old_misfit"] + weight * (ratio - s["old_misfit"]))
    back = changed & (s["old_misfit"] < OLD_FIELD_FITS)
    strange = changed & ~back & misfit
    other = changed & ~back & ~misfit
    known = other & (s["change"] == OTHER)
    proven = other & ~known & (s["fit_views"] > VIEWS_PROVE)
    renew_field(s, p, back, s["calm_field"], p.mag_noise**2, CALM)
    s.put(strange, "change", STRANGE)
    a, b, angle = s["x"][..., :2], s["calm_field"], s["north_angle"]
    seen = np.stack((dot(angle * [1.0, -1.0], a), dot(angle[..., ::-1], a)), axis=-1)
    s.put(known, "calm_field", aligned(b, seen))
    scale = 1.0 / np.sqrt(dot(a, a) * dot(b[..., :2], b[..., :2]))
    across = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    s.put(proven, "north_angle", scale[..., None] * np.stack((dot(a, b[..., :2]), across), axis=-1))
    s.put(proven, "change", OTHER)


def put_part(s: Work, where: Mask, name: str, part: slice, value: Array) -> None:
    """Assign some elements of a vector where a mask holds."""
    whole = s[name].copy()
    whole[..., part] = select(where, value, whole[..., part])
    s[name] = whole


def change_alternative(s: Work, p: Parameters, ratio: Array, where: Mask) -> None:
    """Changes of the field that no hard iron explains count for both hypotheses."""
    interval = s["job_mag_time"]
    misfit, excess = excess_of(p, s["alt_misfit"], ratio, s["job_expected"], interval)
    jump = (p.hard_iron_walk**2 + p.jump_hard_iron * excess) * interval
    s.put(where, "alt_misfit", misfit)
    grown = on_diagonal(6, 0, p.jump_field * excess * interval) + on_diagonal(6, 3, jump)
    s.put(where, "alt_cov", s["alt_cov"] + grown)
    s.put(where, "alt_jump", s["alt_jump"] + jump)


def learn_mag(s: Work, p: Parameters, where: Mask) -> None:
    """Use the magnetometer."""
    where = where & s.mask("job_field") & ~s.mask("job_first")
    if not where.any():
        return
    r = quaternion.to_matrix(s["job_q"])
    h = np.zeros((*where.shape, 3, N))
    h[..., FIELD] = np.eye(3)
    h[..., IRON] = r
    h[..., LATENCY] = rotated(r, cross(s["job_rate"], s["job_mag"] - s["x"][..., IRON]))
    learn(s, p, where, h, s["job_nu"], s["job_variance"])


def ask(s: Work, p: Parameters, where: Mask) -> None:
    """Begin the hypothesis that the magnetometer is not calibrated."""
    variance = p.uncalibrated_std**2
    r = quaternion.to_matrix(s["job_q"])
    x, cov = np.zeros((*where.shape, 6)), np.zeros((*where.shape, 6, 6))
    x[..., :3] = s["x"][..., FIELD]
    cov[..., :3, :3] = (variance + s["job_expected"])[..., None, None] * np.eye(3)
    cov[..., 3:, 3:] = variance * np.eye(3)
    cov[..., :3, 3:] = -variance * r
    cov[..., 3:, :3] = -variance * np.swapaxes(r, -1, -2)
    for name, value in (("alt_x", x), ("alt_cov", cov), ("alt_q", s["job_q"])):
        s.put(where, name, value)
    s.put(where, "alt_misfit", 1.0)
    s.put(where, "alt_jump", 0.0)
    s.put(where, "question", OPEN)


def learn_alternative(s: Work, p: Parameters, where: Mask) -> None:
    """Use the magnetometer for the hypothesis; slow disturbances count once per view of the field."""
    where = where & (s["question"] == OPEN) & s.mask("job_field")
    if not where.any():
        return
    r = quaternion.to_matrix(s["job_q"])
    nu = level_field(s, r, s["alt_x"][..., 3:]) - s["alt_x"][..., :3]
    h = np.concatenate((np.broadcast_to(np.eye(3), r.shape), r), axis=-1)
    cov, dx = s["alt_cov"], np.zeros_like(s["alt_x"])
    trace = np.einsum("...ik,...kl,...il->...", h, cov, h)
    expected = s["job_expected"]
    ratio = dot(nu, nu) / (3.0 * expected + trace)
    views = np.minimum(VIEWS_MAX, np.sqrt(s["job_rate2"]) / VIEW_ANGLE + VIEWS_AT_REST)
    outlier = 1.0 + p.outlier_weight * np.maximum(0.0, ratio - 1.0)
    variance = expected / (s["job_mag_time"] * views) * outlier
    sound = np.ones_like(where)
    for i in range(3):
        cov, dx, good = measure(cov, dx, h[..., i, :], nu[..., i], variance)
        sound = sound & good
    s.put(where & sound, "alt_cov", cov)
    s.put(where & sound, "alt_x", s["alt_x"] + dx)
    s.put(where & ~sound, "question", ANSWERED)


def odds_of(s: Work, p: Parameters) -> Array:
    """Odds of the hypothesis, from the posterior of its hard iron and the widths of both priors."""
    narrow, wide = p.hard_iron_std**2 + s["alt_jump"], p.uncalibrated_std**2 + s["alt_jump"]
    posterior, b = s["alt_cov"][..., 3:, 3:], s["alt_x"][..., 3:]
    identity = np.broadcast_to(np.eye(3), posterior.shape)
    safe = select(np.linalg.det(posterior) > 0.0, posterior, identity)
    information = np.asarray(np.linalg.inv(safe), dtype=np.float64)
    weighted = rotated(information, b)
    sharper = information + (1.0 / narrow - 1.0 / wide)[..., None, None] * np.eye(3)
    shift = dot(weighted, b - np.linalg.solve(sharper, weighted[..., None])[..., 0])
    widths = np.linalg.det(sharper) * np.linalg.det(posterior) * (narrow / wide) ** 3
    odds: Array = (
        p.uncalibrated_odds * np.sqrt(np.maximum(widths, 0.0)) * np.exp(np.clip(0.5 * shift, 0.0, 40.0))
    )
    return odds


def weigh_evidence(s: Work, p: Parameters, where: Mask) -> None:
    """Decide between the hypotheses when the evidence suffices."""
    new = where & (s["question"] == NEW) & s.mask("job_first")
    if new.any():
        if p.uncalibrated_odds > 0.0:
            ask(s, p, new)
        else:
            s.put(new, "question", ANSWERED)
    is_open = where & (s["question"] == OPEN)
    s.put(where & ~is_open, "alt_probability", 0.0)
    if not is_open.any():
        return
    odds = odds_of(s, p)
    largest = np.diagonal(s["alt_cov"], axis1=-2, axis2=-1)[..., 3:].max(axis=-1)
    converged = largest < p.hard_iron_std**2
    s.put(is_open, "alt_probability", odds / (1.0 + odds))
    refuted = is_open & (~np.isfinite(odds) | (odds * EVIDENCE_DECIDES < 1.0) | (converged & (odds < 1.0)))
    adopted = is_open & ~refuted & ((odds > EVIDENCE_DECIDES) | converged)
    s.put(refuted | adopted, "question", ANSWERED)
    if adopted.any():
        put_part(s, adopted, "x", slice(0, 6), s["alt_x"])
        cov = s["cov"].copy()
        cov[..., :6, :], cov[..., :, :6] = 0.0, 0.0
        cov[..., :6, :6] = s["alt_cov"]
        s.put(adopted, "cov", cov)
        s.put(adopted, "misfit", 1.0)


def apply_corrections(s: Work, p: Parameters, where: Mask) -> None:
    """Apply what was collected, within physical bounds."""
    variances = np.diagonal(s["cov"], axis1=-2, axis2=-1)
    sound = np.isfinite(s["dx"]).all(axis=-1) & ((variances >= 0.0) & np.isfinite(variances)).all(axis=-1)
    lose_covariance(s, p, where & ~sound)
    x = s["x"] + s["dx"]
    limits = np.full(N, np.inf)
    limits[IRON], limits[LATENCY], limits[GYRO], limits[SCALE] = (
        IRON_MAX,
        LATENCY_MAX,
        p.bias_limit,
        SCALE_MAX,
    )
    s.put(where, "x", np.clip(x, -limits, limits))


def conclude(s: Work, p: Parameters, where: Mask) -> None:
    """Weigh the hypotheses and find north."""
    weigh_evidence(s, p, where)
    seen = where & s.mask("job_field")
    if not seen.any():
        return
    same = np.bool_(p.refine) & (rotation_difference(s["job_q"], s["alt_q"]) < TURNED)
    other = np.where((s["question"] == OPEN) & ~same, s["alt_probability"], 0.0)[..., None]
    held = select(s["change"] >= STRANGE, s["calm_field"][..., :2], s["x"][..., :2])
    field = (1.0 - other) * held + other * s["alt_x"][..., :2]
    length = np.sqrt(dot(field, field))
    cosine, sine = field[..., 0] / length, -field[..., 1] / length
    near, far = np.sqrt(0.5 * (1.0 + cosine)), np.sqrt(0.5 * (1.0 - cosine))
    far = np.where(sine < 0.0, -far, far)
    ahead = cosine > 0.0
    heading = np.stack(
        (np.where(ahead, near, 0.5 * sine / far), np.where(ahead, 0.5 * sine / near, far)), axis=-1
    )
    known = seen & (length > 0.0)
    s.put(known, "heading", heading)
    s.put(known, "q_north", facing_north(heading, s["q_level"]))


def run_phases(s: Work, p: Parameters, until: NDArray[np.int64]) -> None:
    """Run the parts of the slow step up to a number (...), run by run."""
    while (waiting := s["phase"] < until).any():
        phase = int(s["phase"][waiting].min())
        run_phase(s, p, waiting & (s["phase"] == phase), phase)


def run_phase(s: Work, p: Parameters, where: Mask, phase: int) -> None:
    """Run one part of the slow step."""
    s.put(where, "phase", phase + 1)
    (learn_gyro, follow_field, learn_mag, learn_alternative, apply_corrections, conclude)[phase](s, p, where)


def account_for_blindness(s: Work, p: Parameters, z: Sample, where: Mask) -> None:
    """Make a held rate good; a time without a rate costs certainty of the heading, or the attitude."""
    rate, blind = z.rate - gyro_error(s["x"], z.rate), s["blind"]
    rate2 = np.maximum(s["job_rate2"], dot(rate, rate))
    lost = rate2 * (RATE_BANDWIDTH**2 * blind**3 / 12.0) ** 2
    everything = where & ((np.maximum(blind, z.dt) > LONGEST_STEP) | (lost > LOST))
    if everything.any():
        restart_tilt(s, p, everything)
    missed = (0.5 * blind)[..., None] * (rate - s["rate"])
    turned = quaternion.normalise(quaternion.multiply(s["q_int"], quaternion.exp(missed)))
    s.put(where & ~everything, "q_int", turned)
    s.put(where & ~everything, "turn", s["turn"] + missed)
    variance = np.where(everything, 1.0, lost)
    s.put(where, "cov", s["cov"] + field_turn(N, s["x"], variance))
    s.put(where, "alt_cov", s["alt_cov"] + field_turn(6, s["alt_x"], variance))


def restart_tilt(s: Work, p: Parameters, where: Mask) -> None:
    """Begin the average of the force anew, and seek the field where it is now."""
    run_phases(s, p, np.where(where, PHASES, 0))
    clear_block(s, where)
    for name in ("tilt_slope", "sens_level", "sens_slope", "rest_one", "rest_two", "tilt_age"):
        s.put(where, name, 0.0)
    for name in ("rest_age", "rest_count", "rest_time", "mag_fresh", "has_seen_force", "has_seen_field"):
        s.put(where, name, 0.0)
    s.put(where, "realign", 1.0)
