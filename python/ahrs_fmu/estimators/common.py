"""What all estimators share, over any leading batch dimensions: the twin of fmu_src/estimator/estimator.h.

Which samples are usable, the first attitude, motion compensation, gating, frames and the common outputs
(docs/algorithms.md section 2). Inside, the axes are forward-right-down and north-east-down with magnetic
north. Every run of a batch has conditions of its own; all of them share the clock.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntFlag
from types import SimpleNamespace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import frames, quaternion
from ahrs_fmu.frames import Frame

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
T = TypeVar("T", bound=np.generic)
Parameters = SimpleNamespace
"""Parameter values by name; that of an enumeration is the name of its item."""

# Larger samples are not physical and count as no measurement.
GYRO_LIMIT = 1e3
ACCEL_LIMIT = 1e4
MAG_LIMIT = 1.0

ACCEL_LEAST = 0.1
"""Of gravity: below is free fall."""
MAG_LEAST = 1e-3
"""Of the reference field."""
MAG_SINE = 0.05
"""Of the angle between field and gravity: below there is no heading."""
LONGEST_STEP = 0.5
"""s: after a longer gap the attitude is carried on, not corrected."""
REST_RATE = 0.1
"""rad/s: faster is motion."""
REST_FORCE = 0.5
"""m/s2: specific force further from gravity is motion."""


class Condition(IntFlag):
    """Bits of `CommonState.conditions`."""

    HAS_ATTITUDE = 1
    HAS_HEADING = 2
    HAS_FIELD = 4
    GYRO_HELD = 8
    ACCEL_USED = 16
    MAG_USED = 32
    STEP_REJECTED = 64
    MOVED = 128
    COVARIANCE_RESET = 256
    ACCEL_SUMMED = 512
    MAG_SUMMED = 1024
    IMPLAUSIBLE = 2048
    MAG_DISTURBED = 4096


MOMENTARY = (
    Condition.GYRO_HELD
    | Condition.ACCEL_USED
    | Condition.MAG_USED
    | Condition.STEP_REJECTED
    | Condition.COVARIANCE_RESET
    | Condition.IMPLAUSIBLE
    | Condition.MAG_DISTURBED
)
"""Those that tell of one sample only."""

STATUS = (
    "nominal",
    "mag_disturbed",
    "mag_unused",
    "accel_unused",
    "gyro_held",
    "step_rejected",
    "covariance_reset",
    "implausible",
    "initialising_in_motion",
    "initialising",
)
"""Names of the status, by its number."""


class Inputs(NamedTuple):
    """One sample of every run, in the axes of the user."""

    gyro: Array
    accel: Array
    mag: Array
    accel_valid: Mask
    mag_valid: Mask


class Sample(NamedTuple):
    """One sample of every run in inner axes. Vectors that are not usable are zero.

    `start`: the first attitude is there, begin from it. `turn`: the attitude was turned to north, take it
    over, then run. `run`: predict and correct. `gain_dt` is 0 after a gap that is too long to correct over.
    """

    rate: Array
    force: Array
    accel: Array
    mag: Array
    force_usable: Mask
    accel_usable: Mask
    mag_usable: Mask
    start: Mask
    turn: Mask
    run: Mask
    field: Array
    dt: float
    gain_dt: float


@dataclass(slots=True)
class CommonState:
    """State that every estimator has, leading dimensions are those of the batch.

    Attributes
    ----------
    q : ndarray (..., 4)
        Attitude, body (forward-right-down) to magnetic north-east-down.
    gyro : ndarray (..., 3)
        Last usable rate, rad/s.
    motion_accel : ndarray (..., 3)
        Estimated motion acceleration, body axes, m/s2.
    field : ndarray (..., 2)
        Reference field: horizontal and downward part, T.
    accel_sum, mag_sum : ndarray (..., 3)
        Sums of the samples that initialise the attitude.
    elapsed, gated : ndarray (...)
        Time since the first of these samples; time for which the accelerometer has been ignored, s.
    conditions : ndarray (...) of int32
        Bits of `Condition`.
    """

    q: Array
    gyro: Array
    motion_accel: Array
    field: Array
    accel_sum: Array
    mag_sum: Array
    elapsed: Array
    gated: Array
    conditions: NDArray[np.int32]

    @classmethod
    def initial(cls, shape: tuple[int, ...]) -> CommonState:
        """State before the first sample, for a batch of `shape`."""
        return cls(
            q=np.broadcast_to(quaternion.IDENTITY, (*shape, 4)),
            gyro=np.zeros((*shape, 3)),
            motion_accel=np.zeros((*shape, 3)),
            field=np.zeros((*shape, 2)),
            accel_sum=np.zeros((*shape, 3)),
            mag_sum=np.zeros((*shape, 3)),
            elapsed=np.zeros(shape),
            gated=np.zeros(shape),
            conditions=np.zeros(shape, dtype=np.int32),
        )

    def has(self, condition: Condition) -> Mask:
        """Where a condition holds."""
        held: Mask = (self.conditions & np.int32(condition)) != 0
        return held

    def mark(self, condition: Condition, where: Mask) -> None:
        """Set a condition where a mask is true."""
        self.conditions = np.where(where, self.conditions | np.int32(condition), self.conditions)

    def assign(self, condition: Condition, value: Mask, where: Mask) -> None:
        """Set or clear a condition where a mask is true."""
        kept = self.conditions & ~np.int32(condition)
        self.conditions = np.where(where, np.where(value, kept | np.int32(condition), kept), self.conditions)

    def restart(self, where: Mask) -> None:
        """Forget everything where a mask is true."""
        fresh = CommonState.initial(where.shape)
        for field in fields(self):
            old, new = getattr(self, field.name), getattr(fresh, field.name)
            setattr(self, field.name, select(where, new, old))


def select(where: Mask, new: NDArray[T], old: NDArray[T]) -> NDArray[T]:
    """Elements of `new` (..., any trailing shape) where the mask (...) is true, of `old` elsewhere."""
    where = np.asarray(where)
    return np.where(where.reshape(where.shape + (1,) * (np.ndim(old) - where.ndim)), new, old)


def dot(a: Array, b: Array) -> Array:
    """Scalar product over the last axis."""
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def norm(v: Array) -> Array:
    """Length over the last axis."""
    return np.sqrt(dot(v, v))


def unit(v: Array) -> Array:
    """Direction over the last axis; NaN for zero, which the caller masks."""
    return v / norm(v)[..., None]


def cross(a: Array, b: Array) -> Array:
    """Vector product of (..., 3) arrays."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def down_of(q: Array) -> Array:
    """Direction of gravity seen from the body, (..., 3)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return np.stack((2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z), axis=-1)


def north_of(q: Array) -> Array:
    """Direction of magnetic north seen from the body, (..., 3)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return np.stack((w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)), axis=-1)


def near(q: Array, reference: Array) -> Array:
    """The same attitude as q with the sign that is nearer to the reference."""
    return np.where(dot(q, reference)[..., None] < 0.0, -q, q)


def attitude_from_axes(axes: Array) -> Array:
    """Attitude whose rotation matrix has these rows (..., 3, 3): the navigation axes seen from the body.

    Its sign is that of the C core: the component with the largest square is positive.
    """
    q = quaternion.from_matrix(axes)
    diagonal = np.diagonal(axes, axis1=-2, axis2=-1)
    pivot = np.where(diagonal.sum(axis=-1) > 0.0, 0, 1 + np.argmax(diagonal, axis=-1))
    return np.where(np.take_along_axis(q, pivot[..., None], axis=-1) < 0.0, -q, q)


def attitude_of(force: Array, mag: Array) -> Array:
    """Attitude from specific force and field, accelerometer first; with a zero field the heading is zero."""
    down = unit(-force)
    east = unit(cross(down, mag))
    headed = norm(mag) > 0.0
    roll = np.arctan2(down[..., 1], down[..., 2])
    pitch = np.arctan2(-down[..., 0], np.hypot(down[..., 1], down[..., 2]))
    level = quaternion.from_euler(np.stack((roll, pitch, np.zeros_like(roll)), axis=-1))
    if not headed.any():
        return level
    axes = np.where(headed[..., None, None], np.stack((cross(east, down), east, down), axis=-2), np.eye(3))
    return np.where(headed[..., None], attitude_from_axes(axes), level)


def begin(s: CommonState, p: Parameters, u: Inputs, dt: float) -> Sample | None:
    """Take in one sample, `dt` seconds after the last, and tell what to do with it.

    Returns
    -------
    Sample or None
        None: nothing to do for any run.
    """
    if not (dt >= 0.0 and np.isfinite(dt)):
        s.conditions = s.conditions | np.int32(Condition.STEP_REJECTED)
        return None
    had_attitude = s.has(Condition.HAS_ATTITUDE)
    active = ~had_attitude if dt == 0.0 else np.ones_like(had_attitude)
    if not active.any():
        return None
    s.conditions = np.where(active, s.conditions & ~np.int32(MOMENTARY), s.conditions)
    z = _read_sample(s, p, u, dt, active)
    run = active & had_attitude
    if not had_attitude.all():
        z = z._replace(start=_initialise(s, p, z, active & ~had_attitude))
    return _prepare_sample(s, p, z._replace(run=run)) if run.any() else z


def end(s: CommonState, p: Parameters, z: Sample, q: Array) -> None:
    """Take over the attitude after a sample; one that has lost its meaning is initialised anew."""
    norm2 = dot(q, q)
    lost = z.run & ~((norm2 > 1e-12) & np.isfinite(norm2))
    alive = z.run & ~lost
    refined = near(q * (1.5 - 0.5 * norm2[..., None]), s.q)
    s.q = select(alive, refined, s.q)
    moving = z.force + p.gravity * down_of(s.q)
    s.motion_accel = select(alive & z.force_usable, moving, s.motion_accel)
    if lost.any():
        s.restart(lost)


def outputs(s: CommonState, p: Parameters, bias: Array) -> dict[str, NDArray[np.generic]]:
    """Give the common outputs by name; `bias` (..., 3) is the gyroscope bias in inner axes."""
    frame = Frame(p.frame)
    q = _to_output_frame(p, s.q)
    euler = quaternion.to_euler(q)
    return {
        "q": q,
        "roll": euler[..., 0],
        "pitch": euler[..., 1],
        "yaw": euler[..., 2],
        "rate": frames.body_vector(s.gyro - bias, Frame.NED, frame),
        "gyro_bias": frames.body_vector(bias, Frame.NED, frame),
        "motion_accel": frames.body_vector(s.motion_accel, Frame.NED, frame),
        "status": _status(s),
        "gyro_held": s.has(Condition.GYRO_HELD),
        "accel_used": s.has(Condition.ACCEL_USED),
        "mag_used": s.has(Condition.MAG_USED),
    }


def _to_output_frame(p: Parameters, q: Array) -> Array:
    declined = quaternion.multiply(_turn_about_down(p.declination), q)
    return _swap_frames(declined) if p.frame == "enu" else declined


def _from_output_frame(p: Parameters, q: Array) -> Array:
    inner = _swap_frames(q) if p.frame == "enu" else q
    return quaternion.multiply(_turn_about_down(-p.declination), inner)


def _swap_frames(q: Array) -> Array:
    """NED/FRD to ENU/FLU and back, with the sign of the C core."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    swapped: Array = np.sqrt(0.5) * np.stack((w + z, x + y, x - y, w - z), axis=-1)
    return swapped


def _turn_about_down(angle: Array | float) -> Array:
    half = 0.5 * np.asarray(angle)
    return np.stack((np.cos(half), np.zeros_like(half), np.zeros_like(half), np.sin(half)), axis=-1)


def _within(v: Array, limit: float) -> Mask:
    # NaN compares as false.
    return np.asarray((np.abs(v) <= limit).all(axis=-1))


def _has_horizontal_part(mag: Array, vertical: Array) -> Mask:
    across = cross(vertical, mag)
    # Strict, so that a zero field has none.
    return np.asarray(dot(across, across) > MAG_SINE**2 * dot(vertical, vertical) * dot(mag, mag))


def _read_sample(s: CommonState, p: Parameters, u: Inputs, dt: float, active: Mask) -> Sample:
    frame = Frame(p.frame)
    held = ~_within(u.gyro, GYRO_LIMIT)
    s.mark(Condition.GYRO_HELD, active & held)
    s.gyro = select(active & ~held, frames.body_vector(u.gyro, frame, Frame.NED), s.gyro)
    least = ACCEL_LEAST * p.gravity
    force_usable = u.accel_valid & _within(u.accel, ACCEL_LIMIT) & (dot(u.accel, u.accel) > least**2)
    force = select(force_usable, frames.body_vector(u.accel, frame, Frame.NED), np.zeros_like(s.gyro))
    mag_usable = u.mag_valid & _within(u.mag, MAG_LIMIT)
    mag = select(mag_usable, frames.body_vector(u.mag, frame, Frame.NED), np.zeros_like(s.gyro))
    vertical = select(force_usable, force, down_of(s.q))
    none = np.zeros_like(active)
    return Sample(
        rate=s.gyro,
        force=force,
        accel=force,
        mag=mag,
        force_usable=force_usable,
        accel_usable=force_usable,
        mag_usable=mag_usable & _has_horizontal_part(mag, vertical),
        start=none,
        turn=none,
        run=none,
        field=s.field,
        dt=dt,
        gain_dt=0.0 if dt > LONGEST_STEP else dt,
    )


def _learn_field(s: CommonState, p: Parameters, mag: Array, where: Mask) -> None:
    if p.field_reference == "given":
        given = p.field_magnitude * np.array([np.cos(p.field_dip), np.sin(p.field_dip)])
        s.field = select(where, given, s.field)
        s.mark(Condition.HAS_FIELD, where)
        return
    seen = where & (dot(mag, mag) > 0.0)
    m = quaternion.rotate(s.q, mag)
    s.field = select(seen, np.stack((np.hypot(m[..., 0], m[..., 1]), m[..., 2]), axis=-1), s.field)
    s.mark(Condition.HAS_FIELD, seen)


def _moves(p: Parameters, z: Sample) -> Mask:
    shaken = z.force_usable & (np.abs(norm(z.force) - p.gravity) > REST_FORCE)
    return np.asarray((dot(z.rate, z.rate) > REST_RATE**2) | shaken)


def _initialise(s: CommonState, p: Parameters, z: Sample, waiting: Mask) -> Mask:
    """Where the first attitude is complete with this sample."""
    if p.initialisation == "given":
        q0 = np.asarray(p.q0, dtype=np.float64)
        s.q = select(waiting, _from_output_frame(p, quaternion.normalise(q0)), s.q)
        s.mark(Condition.HAS_HEADING, waiting)
        complete = waiting
    else:
        complete = _average(s, p, z, waiting)
    s.mark(Condition.HAS_ATTITUDE, complete)
    _learn_field(s, p, select(z.mag_usable, z.mag, np.zeros_like(z.mag)), complete)
    moving = z.force + p.gravity * down_of(s.q)
    moving = select(z.force_usable, moving, np.zeros_like(moving))
    s.motion_accel = select(complete, moving, s.motion_accel)
    s.assign(Condition.ACCEL_USED, z.force_usable, complete)
    s.assign(Condition.MAG_USED, z.mag_usable, complete)
    return complete


def _average(s: CommonState, p: Parameters, z: Sample, waiting: Mask) -> Mask:
    """Average usable samples into the first attitude; where it is complete."""
    s.elapsed = s.elapsed + np.where(waiting & s.has(Condition.ACCEL_SUMMED), z.dt, 0.0)
    s.accel_sum = select(waiting & z.force_usable, s.accel_sum + z.force, s.accel_sum)
    s.mark(Condition.ACCEL_SUMMED, waiting & z.force_usable)
    s.mag_sum = select(waiting & z.mag_usable, s.mag_sum + z.mag, s.mag_sum)
    s.mark(Condition.MAG_SUMMED, waiting & z.mag_usable)
    s.mark(Condition.MOVED, waiting & _moves(p, z))
    known = waiting & s.has(Condition.ACCEL_SUMMED) & (dot(s.accel_sum, s.accel_sum) > 0.0)
    heading = s.has(Condition.MAG_SUMMED) & _has_horizontal_part(s.mag_sum, s.accel_sum)
    mean_field = select(heading, s.mag_sum, np.zeros_like(s.mag_sum))
    s.q = select(known, attitude_of(s.accel_sum, mean_field), s.q)
    s.assign(Condition.HAS_HEADING, heading, known)
    return np.asarray(known & (s.elapsed >= p.init_time))


def _prepare_sample(s: CommonState, p: Parameters, z: Sample) -> Sample:
    """Do what needs an attitude: reference field, gating, motion compensation."""
    turn = z.run & z.mag_usable & ~s.has(Condition.HAS_HEADING)
    if turn.any():
        m = quaternion.rotate(s.q, z.mag)
        back = _turn_about_down(-np.arctan2(m[..., 1], m[..., 0]))
        s.q = select(turn, near(quaternion.multiply(back, s.q), s.q), s.q)
        s.mark(Condition.HAS_HEADING, turn)
    learning = z.run & z.mag_usable & ~s.has(Condition.HAS_FIELD)
    if learning.any():
        _learn_field(s, p, z.mag, learning)
    mag_usable = z.mag_usable & (dot(z.mag, z.mag) > MAG_LEAST**2 * dot(s.field, s.field))
    accel_usable, accel = z.force_usable, z.force
    if p.accel_gating:
        accel_usable = accel_usable & ~_gated(s, p, z)
    if p.motion_compensation:
        motion = np.exp(-z.dt / p.motion_time_constant) * s.motion_accel
        accel = z.force - motion
        accel_usable = accel_usable & (dot(accel, accel) > 0.0)
        s.motion_accel = select(z.run & ~z.force_usable, motion, s.motion_accel)
    correcting = z.gain_dt > 0.0
    s.assign(Condition.ACCEL_USED, accel_usable & correcting, z.run)
    s.assign(Condition.MAG_USED, mag_usable & correcting, z.run)
    return z._replace(accel=accel, accel_usable=accel_usable, mag_usable=mag_usable, turn=turn, field=s.field)


def _gated(s: CommonState, p: Parameters, z: Sample) -> Mask:
    """Where the accelerometer is so far from gravity that it is ignored, for a limited time."""
    considered = z.run & z.force_usable
    far = np.abs(norm(z.force) - p.gravity) > p.accel_gate
    longer = np.where(far, np.minimum(s.gated + z.dt, p.accel_gate_time + 1.0), 0.0)
    s.gated = np.where(considered, longer, s.gated)
    return np.asarray(far & (s.gated <= p.accel_gate_time))


def _status(s: CommonState) -> NDArray[np.int32]:
    conditions = [
        ~s.has(Condition.HAS_ATTITUDE) & s.has(Condition.MOVED),
        ~s.has(Condition.HAS_ATTITUDE),
        s.has(Condition.IMPLAUSIBLE),
        s.has(Condition.COVARIANCE_RESET),
        s.has(Condition.STEP_REJECTED),
        s.has(Condition.GYRO_HELD),
        ~s.has(Condition.ACCEL_USED),
        ~s.has(Condition.MAG_USED),
        s.has(Condition.MAG_DISTURBED),
    ]
    status = [
        "initialising_in_motion",
        "initialising",
        "implausible",
        "covariance_reset",
        "step_rejected",
        "gyro_held",
        "accel_unused",
        "mag_unused",
        "mag_disturbed",
    ]
    numbers = [np.int32(STATUS.index(name)) for name in status]
    return np.select(conditions, numbers, np.int32(0)).astype(np.int32)
