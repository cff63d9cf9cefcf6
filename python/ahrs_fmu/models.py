"""The estimators by name, with their parameters.

Generated from the descriptors by ``python -m ahrs_fmu.export.classes``: change those, not this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from ahrs_fmu.estimator import Estimator
from ahrs_fmu.host_library import Precision

__all__ = ["GCF"]


class GCF(Estimator):
    """Generalized complementary filter.

    Integrates the gyroscope and corrects the attitude by H(s) times the error between measured and
    expected directions of gravity and magnetic north. H(s) is of first order (kp), second order (kp, ki:
    the gyroscope bias is learned) or third order (kp, ki, kii: a ramp of the bias is followed too). With
    the decoupled error the loop gain is one on all axes, so that the crossover frequency is the one
    designed.

    Parameters
    ----------
    kp : float, default 0.5
        Proportional gain: about the crossover frequency between accelerometer/magnetometer and
        gyroscope [rad/s]. Must be at least 0 and at most 1000.
    ki : float, default 0.1
        Integral gain: how fast the gyroscope bias is learned; 0 makes the filter first order
        [rad2/s2]. Must be at least 0 and at most 1e+06.
    kii : float, default 0.0
        Double integral gain: follows a ramp of the gyroscope bias; 0 leaves the filter second
        order [rad3/s3]. Must be at least 0 and at most 1e+09.
    bias_limit : float, default 1.0
        Largest gyroscope bias that is learned, per axis [rad/s]. Must be at least 0 and at most
        100.
    realisation : {"quaternion", "vector", "dcm", "euler"}, default "quaternion"
        What the filter stores as its attitude.
    form : {"direct", "attitude"}, default "direct"
        What the error is formed from.
    error : {"decoupled", "coupled"}, default "decoupled"
        How the vector errors are put together.
    kg : float, default 1.0
        Weight of the gravity error, used when error is coupled. Must be at least 0 and at most
        100.
    kh : float, default 1.0
        Weight of the magnetic field error, used when error is coupled. Must be at least 0 and at
        most 100.
    sample_time : float, default 0.01
        Sample interval of the estimator [s]. Must be at least 1e-05 and at most 0.5.
    frame : {"ned", "enu"}, default "ned"
        Navigation and body frame of inputs and outputs.
    declination : float, default 0.0
        Magnetic declination, east positive: turns the navigation frame from magnetic to true
        north [rad]. Must be at least -3.14159 and at most 3.14159.
    gravity : float, default 9.80665
        Local gravity [m/s2]. Must be at least 0.1 and at most 100.
    field_reference : {"learned", "given"}, default "learned"
        Where the local magnetic field is known from.
    field_magnitude : float, default 5e-05
        Magnitude of the local field, used when field_reference is given [T]. Must be at least
        1e-07 and at most 0.01.
    field_dip : float, default 1.1
        Dip of the local field below the horizon, used when field_reference is given [rad]. Must
        be at least -1.5708 and at most 1.5708.
    initialisation : {"sensors", "given"}, default "sensors"
        Where the first attitude comes from.
    q0 : sequence of float, default (1.0, 0.0, 0.0, 0.0)
        First attitude, in the frame of the output, used when initialisation is given; scaled to
        unit length. Must be at least -1.1 and at most 1.1.
    init_time : float, default 0.0
        Time over which samples are averaged for the first attitude; 0 takes the first usable
        sample [s]. Must be at least 0 and at most 600.
    motion_compensation : bool, default False
        Subtract the estimated motion acceleration from the accelerometer; tilt is then observed
        more slowly.
    motion_time_constant : float, default 1.0
        How long an acceleration is taken for motion before it is taken for tilt; infinity never
        takes it back [s]. Must be above 0; infinity is allowed.
    accel_gating : bool, default False
        Ignore the accelerometer while its magnitude is far from gravity.
    accel_gate : float, default 1.0
        Deviation of the specific force from gravity beyond which the accelerometer is ignored
        [m/s2]. Must be at least 0 and at most 100.
    accel_gate_time : float, default 10.0
        Longest time without the accelerometer; then it is used until it has been inside the gate
        once [s]. Must be at least 0 and at most 600.
    precision : {"double", "single"}
        Floating-point type of the computation.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        kp: float = 0.5,
        ki: float = 0.1,
        kii: float = 0.0,
        bias_limit: float = 1.0,
        realisation: Literal["quaternion", "vector", "dcm", "euler"] = "quaternion",
        form: Literal["direct", "attitude"] = "direct",
        error: Literal["decoupled", "coupled"] = "decoupled",
        kg: float = 1.0,
        kh: float = 1.0,
        sample_time: float = 0.01,
        frame: Literal["ned", "enu"] = "ned",
        declination: float = 0.0,
        gravity: float = 9.80665,
        field_reference: Literal["learned", "given"] = "learned",
        field_magnitude: float = 5e-05,
        field_dip: float = 1.1,
        initialisation: Literal["sensors", "given"] = "sensors",
        q0: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        init_time: float = 0.0,
        motion_compensation: bool = False,
        motion_time_constant: float = 1.0,
        accel_gating: bool = False,
        accel_gate: float = 1.0,
        accel_gate_time: float = 10.0,
        precision: Precision = "double",
    ) -> None:
        super().__init__(
            "gcf",
            {
                "kp": kp,
                "ki": ki,
                "kii": kii,
                "bias_limit": bias_limit,
                "realisation": realisation,
                "form": form,
                "error": error,
                "kg": kg,
                "kh": kh,
                "sample_time": sample_time,
                "frame": frame,
                "declination": declination,
                "gravity": gravity,
                "field_reference": field_reference,
                "field_magnitude": field_magnitude,
                "field_dip": field_dip,
                "initialisation": initialisation,
                "q0": q0,
                "init_time": init_time,
                "motion_compensation": motion_compensation,
                "motion_time_constant": motion_time_constant,
                "accel_gating": accel_gating,
                "accel_gate": accel_gate,
                "accel_gate_time": accel_gate_time,
            },
            precision,
        )


BY_NAME: dict[str, type[Estimator]] = {
    "gcf": GCF,
}
"""The classes by the name of their descriptor."""
