"""What all estimators share, over any leading batch dimensions: the twin of fmu_src/estimator/estimator.h.

Which samples are usable, the first attitude, motion compensation, gating, frames and the common outputs
(docs/algorithms.md section 0). Inside, the axes are forward-right-down and north-east-down with magnetic
north. Every run of a batch has conditions of its own; all of them share the clock.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ahrs_fmu import frames, quaternion
from ahrs_fmu.estimators import preprocessing
from ahrs_fmu.estimators.geometry import (
    attitude_of,
    dot,
    down_of,
    has_horizontal_part,
    masked,
    near,
    norm,
    unit,
)
from ahrs_fmu.estimators.state import (
    MOMENTARY,
    STATUS,
    Array,
    CommonState,
    Condition,
    Inputs,
    Mask,
    Parameters,
    Sample,
    select,
)
from ahrs_fmu.frames import Frame
from ahrs_fmu.quaternion import join

# Larger samples are not physical and count as no measurement.
GYRO_LIMIT = 1e3
ACCEL_LIMIT = 1e4
MAG_LIMIT = 1.0

ACCEL_LEAST = 0.1
"""Of gravity: below is free fall."""
MAG_LEAST = 1e-3
"""Of the reference field."""
LONGEST_STEP = 0.5
"""s: after a longer gap the attitude is carried on, not corrected."""
REST_RATE = 0.1
"""rad/s: faster is motion."""
REST_FORCE = 0.5
"""m/s2: specific force further from gravity is motion."""


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
    zeroed = np.zeros_like(active)
    if p.gyro_zero_samples > 0:
        rate, zeroed = preprocessing.remove_gyro_zero(s, p, z, active & ~z.gyro_held)
        z = z._replace(rate=rate)
    run = active & had_attitude
    if not had_attitude.all():
        z = z._replace(start=_initialise(s, p, z, active & ~had_attitude))
    if not run.any():
        return z
    z = _prepare_sample(s, p, z._replace(run=run))
    # With a new zero of the gyroscope a filter begins again from its attitude.
    again = run & zeroed
    s.motion_accel = select(again, z.force + p.gravity * down_of(s.q), s.motion_accel)
    return z._replace(start=z.start | again, turn=z.turn & ~again, run=run & ~again)


def end(s: CommonState, p: Parameters, z: Sample, q: Array) -> None:
    """Take over the attitude after a sample; one that has lost its meaning is initialised anew."""
    q = unit(q)
    lost = z.run & ~np.isfinite(q).all(axis=-1)
    alive = z.run & ~lost
    s.q = select(alive, near(q, s.q), s.q)
    moving = z.force + p.gravity * down_of(s.q)
    s.motion_accel = select(alive & z.force_usable, moving, s.motion_accel)
    if lost.any():
        s.restart(lost)


def outputs(s: CommonState, p: Parameters, bias: Array) -> dict[str, NDArray[np.generic]]:
    """Give the common outputs by name; `bias` (..., 3) is what the filter has learned, in inner axes."""
    frame = Frame(p.frame)
    q = _to_output_frame(p, s.q)
    euler = quaternion.to_euler(q)
    return {
        "q": q,
        "roll": euler[..., 0],
        "pitch": euler[..., 1],
        "yaw": euler[..., 2],
        "rate": frames.body_vector(s.gyro - bias, Frame.NED, frame),
        "gyro_bias": frames.body_vector(bias + preprocessing.gyro_zero(s), Frame.NED, frame),
        "motion_accel": frames.body_vector(s.motion_accel, Frame.NED, frame),
        "status": _status(s),
        "gyro_held": s.has(Condition.GYRO_HELD),
        "accel_used": s.has(Condition.ACCEL_USED),
        "mag_used": s.has(Condition.MAG_USED),
    }


def _to_output_frame(p: Parameters, q: Array) -> Array:
    if p.declination != 0.0:
        q = quaternion.multiply(_turn_about_down(p.declination), q)
    return _swap_frames(q) if p.frame == "enu" else q


def _from_output_frame(p: Parameters, q: Array) -> Array:
    inner = _swap_frames(q) if p.frame == "enu" else q
    return quaternion.multiply(_turn_about_down(-p.declination), inner)


def _swap_frames(q: Array) -> Array:
    """NED/FRD to ENU/FLU and back, with the sign of the C core."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    swapped: Array = np.sqrt(0.5) * join(w + z, x + y, x - y, w - z)
    return swapped


def _turn_about_down(angle: Array | float) -> Array:
    half = 0.5 * np.asarray(angle)
    return join(np.cos(half), np.zeros_like(half), np.zeros_like(half), np.sin(half))


def _read_sample(s: CommonState, p: Parameters, u: Inputs, dt: float, active: Mask) -> Sample:
    frame = Frame(p.frame)
    # Comparisons fail for NaN and infinity.
    held = ~(dot(u.gyro, u.gyro) <= GYRO_LIMIT**2)
    s.mark(Condition.GYRO_HELD, active & held)
    s.gyro = select(active & ~held, frames.body_vector(u.gyro, frame, Frame.NED), s.gyro)
    force2, least2 = dot(u.accel, u.accel), (ACCEL_LEAST * p.gravity) ** 2
    force_usable = u.accel_valid & (force2 > least2) & (force2 <= ACCEL_LIMIT**2)
    force = masked(force_usable, frames.body_vector(u.accel, frame, Frame.NED))
    if p.accel_cutoff > 0.0:
        force = preprocessing.smooth_force(s, p, force, force_usable, dt, active)
        force_usable = force_usable & (dot(force, force) > least2)
    calibrated = preprocessing.calibrated_mag(p, u.mag)
    field2 = dot(calibrated, calibrated)
    # The reference field is zero until it is known.
    mag_read = u.mag_valid & (field2 > MAG_LEAST**2 * dot(s.field, s.field)) & (field2 <= MAG_LIMIT**2)
    mag = masked(mag_read, frames.body_vector(calibrated, frame, Frame.NED))
    vertical = select(force_usable, force, down_of(s.q))
    none = np.zeros_like(active)
    return Sample(
        rate=s.gyro,
        force=force,
        accel=force,
        mag=mag,
        gyro_held=held,
        force_usable=force_usable,
        accel_usable=force_usable,
        mag_usable=mag_read & has_horizontal_part(mag, vertical),
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
    s.field = select(seen, join(np.hypot(m[..., 0], m[..., 1]), m[..., 2]), s.field)
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
    _learn_field(s, p, masked(z.mag_usable, z.mag), complete)
    moving = masked(z.force_usable, z.force + p.gravity * down_of(s.q))
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
    heading = s.has(Condition.MAG_SUMMED) & has_horizontal_part(s.mag_sum, s.accel_sum)
    mean_field = masked(heading, s.mag_sum)
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
    s.assign(Condition.MAG_USED, z.mag_usable & correcting, z.run)
    return z._replace(accel=accel, accel_usable=accel_usable, turn=turn, field=s.field)


def _gated(s: CommonState, p: Parameters, z: Sample) -> Mask:
    """Where the accelerometer is so far from gravity that it is ignored, for a limited time."""
    considered = z.run & z.force_usable
    far = np.abs(norm(z.force) - p.gravity) > p.accel_gate
    longer = np.where(far, np.minimum(s.gated + z.dt, p.accel_gate_time + 1.0), 0.0)
    s.gated = np.where(considered, longer, s.gated)
    return np.asarray(far & (s.gated <= p.accel_gate_time))


def _status(s: CommonState) -> NDArray[np.int32]:
    # The worst condition last.
    conditions = {
        "mag_disturbed": s.has(Condition.MAG_DISTURBED),
        "mag_unused": ~s.has(Condition.MAG_USED),
        "accel_unused": ~s.has(Condition.ACCEL_USED),
        "gyro_held": s.has(Condition.GYRO_HELD),
        "step_rejected": s.has(Condition.STEP_REJECTED),
        "covariance_reset": s.has(Condition.COVARIANCE_RESET),
        "implausible": s.has(Condition.IMPLAUSIBLE),
        "initialising": ~s.has(Condition.HAS_ATTITUDE),
        "initialising_in_motion": ~s.has(Condition.HAS_ATTITUDE) & s.has(Condition.MOVED),
    }
    status = np.zeros_like(s.conditions)
    for name, holds in conditions.items():
        status = np.where(holds, np.int32(STATUS.index(name)), status)
    return status
