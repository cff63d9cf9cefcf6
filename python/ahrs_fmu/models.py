"""The estimators by name, with their parameters.

Generated from the descriptors by ``python -m ahrs_fmu.export.classes``: change those, not this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from ahrs_fmu.estimator import Backend, Estimator
from ahrs_fmu.host_library import Precision

__all__ = [
    "CGEKF",
    "GCF",
    "KCF",
    "MEKF",
    "UKF",
    "AdaptiveCKF",
    "Complementary",
    "ImprovedEKF",
    "Mahony",
    "MahonyEKF",
    "Strapdown",
]


class AdaptiveCKF(Estimator):
    """Cubature Kalman filter on the quaternion with adaptive noise.

    The state is the quaternion, predicted by the gyroscope and measured by the specific force and the
    heading. The covariances of measurement and process noise may be estimated while the filter runs,
    after Sage and Husa. It learns no gyroscope bias: the process noise has to cover it.

    Parameters
    ----------
    gyro_noise : float, default 0.006
        White noise of the gyroscope, rad/s/sqrt(Hz), large enough to cover its bias; used when
        process_noise is gyro. Must be at least 0 and at most 100.
    accel_noise : float, default 0.1
        White noise of the accelerometer with the motion, m/s2/sqrt(Hz), before it is estimated.
        Must be above 0 and at most 1000.
    heading_noise : float, default 0.0316
        White noise of the measured heading, rad/sqrt(Hz), before it is estimated. Must be above 0
        and at most 100.
    quaternion_noise : float, default 0.000316
        White noise of the change of every quaternion element, 1/s/sqrt(Hz). Must be above 0 and
        at most 100.
    motion_noise : float, default 0.5
        Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation.
        Must be at least 0 and at most 1000.
    initial_attitude_std : float, default 0.063
        Standard deviation of the first attitude [rad]. Must be at least 0.0001 and at most 0.5.
    adaptation : {"none", "r_only", "qr_safe", "textbook", "printed"}, default "r_only"
        Which noise covariances are estimated.
    process_noise : {"gyro", "isotropic"}, default "gyro"
        Form of the process noise, before it is estimated.
    forgetting : float, default 0.995
        Weight of the estimated noise covariances from one sample to the next. Must be at least
        0.5 and below 1.
    warm_up : int, default 200
        Samples that the given noise covariances count for when the estimation begins.
    measurement_variance_min : float, default 0.0001
        Least eigenvalue of the measurement covariance, in m2/s4 and rad2, when adaptation is
        r_only or qr_safe. Must be at least 1e-12 and at most 1e+06.
    measurement_variance_max : float, default 1000.0
        Largest eigenvalue of the measurement covariance, in m2/s4 and rad2, when adaptation is
        r_only or qr_safe. Must be at least 1e-12 and at most 1e+06.
    process_variance_min : float, default 1e-08
        Least eigenvalue of the process covariance per sample, when adaptation is qr_safe. Must be
        at least 1e-12 and at most 1.
    process_variance_max : float, default 1e-05
        Largest eigenvalue of the process covariance per sample, when adaptation is qr_safe. Must
        be at least 1e-12 and at most 1.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        gyro_noise: float = 0.006,
        accel_noise: float = 0.1,
        heading_noise: float = 0.0316,
        quaternion_noise: float = 0.000316,
        motion_noise: float = 0.5,
        initial_attitude_std: float = 0.063,
        adaptation: Literal["none", "r_only", "qr_safe", "textbook", "printed"] = "r_only",
        process_noise: Literal["gyro", "isotropic"] = "gyro",
        forgetting: float = 0.995,
        warm_up: int = 200,
        measurement_variance_min: float = 0.0001,
        measurement_variance_max: float = 1000.0,
        process_variance_min: float = 1e-08,
        process_variance_max: float = 1e-05,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "adaptive_ckf",
            {
                "gyro_noise": gyro_noise,
                "accel_noise": accel_noise,
                "heading_noise": heading_noise,
                "quaternion_noise": quaternion_noise,
                "motion_noise": motion_noise,
                "initial_attitude_std": initial_attitude_std,
                "adaptation": adaptation,
                "process_noise": process_noise,
                "forgetting": forgetting,
                "warm_up": warm_up,
                "measurement_variance_min": measurement_variance_min,
                "measurement_variance_max": measurement_variance_max,
                "process_variance_min": process_variance_min,
                "process_variance_max": process_variance_max,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class CGEKF(Estimator):
    """Attitude by conjugate gradients, smoothed by an extended Kalman filter.

    Fletcher-Reeves conjugate gradients, begun at the predicted attitude, find the attitude at which the
    directions of gravity and of the magnetic field fit best, both with equal weight. It measures the
    quaternion of an extended Kalman filter that the gyroscope predicts. It learns no gyroscope bias. In
    the steady state it is a first-order complementary filter whose crossover frequency is
    gyro_noise/attitude_noise.

    Parameters
    ----------
    gyro_noise : float, default 0.0316
        White noise of the gyroscope, rad/s/sqrt(Hz). Must be above 0 and at most 100.
    attitude_noise : float, default 0.004
        White noise of the attitude that the search finds, rad/sqrt(Hz). Must be above 0 and at
        most 100.
    motion_noise : float, default 0.5
        Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation.
        Must be at least 0 and at most 1000.
    initial_attitude_std : float, default 0.2
        Standard deviation of the first attitude [rad]. Must be at least 0.0001 and at most 10.
    iterations : int, default 4
        Most iterations of the search per sample; it ends before where the gradient vanishes.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        gyro_noise: float = 0.0316,
        attitude_noise: float = 0.004,
        motion_noise: float = 0.5,
        initial_attitude_std: float = 0.2,
        iterations: int = 4,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "cg_ekf",
            {
                "gyro_noise": gyro_noise,
                "attitude_noise": attitude_noise,
                "motion_noise": motion_noise,
                "initial_attitude_std": initial_attitude_std,
                "iterations": iterations,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class Complementary(Estimator):
    """First-order complementary filter.

    Integrates the gyroscope and turns the result by the fraction kp*sample_time of the way to the
    attitude that accelerometer and magnetometer show. It learns no gyroscope bias: a constant one leaves
    an error of bias/kp.

    Parameters
    ----------
    kp : float, default 0.58
        Crossover frequency between accelerometer/magnetometer and gyroscope: one over the time
        constant [rad/s]. Must be at least 0 and at most 1000.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        kp: float = 0.58,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "complementary",
            {
                "kp": kp,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class ImprovedEKF(Estimator):
    """Extended Kalman filter on the quaternion, measured by accelerometer and magnetometer.

    The state is the quaternion. The gyroscope predicts it, and the attitude that accelerometer and
    magnetometer show together measures it; that measurement counts less while the specific force is not
    that of gravity. It learns no gyroscope bias. In the steady state it is a first-order complementary
    filter whose crossover frequency is gyro_noise/attitude_noise.

    Parameters
    ----------
    gyro_noise : float, default 0.01
        White noise of the gyroscope, rad/s/sqrt(Hz). Must be above 0 and at most 100.
    attitude_noise : float, default 0.002
        White noise of the attitude from accelerometer and magnetometer at rest, rad/sqrt(Hz).
        Must be above 0 and at most 100.
    accel_distrust : float, default 1.0
        Relative growth of the variance of that attitude with the deviation of the specific force
        from gravity [s2/m]. Must be at least 0 and at most 100.
    motion_noise : float, default 0.5
        Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation.
        Must be at least 0 and at most 1000.
    initial_attitude_std : float, default 2.0
        Standard deviation of the first attitude [rad]. Must be at least 0.0001 and at most 10.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        gyro_noise: float = 0.01,
        attitude_noise: float = 0.002,
        accel_distrust: float = 1.0,
        motion_noise: float = 0.5,
        initial_attitude_std: float = 2.0,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "improved_ekf",
            {
                "gyro_noise": gyro_noise,
                "attitude_noise": attitude_noise,
                "accel_distrust": accel_distrust,
                "motion_noise": motion_noise,
                "initial_attitude_std": initial_attitude_std,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class KCF(Estimator):
    """Kalman-calibrated complementary filter.

    A complementary filter finds the tilt in a slowly moving inertial frame; a slow Kalman filter learns
    what limits it while it runs: bias, scale and misalignment of the gyroscope, hard iron and latency of
    the magnetometer, and the local field. A second hypothesis covers a magnetometer that was never
    calibrated.

    Parameters
    ----------
    profile : {"hand", "multirotor", "custom"}, default "hand"
        What carries the sensor.
    accel_time_constant : float, default 3.5
        Time constant of the specific force in the inertial frame, used when profile is custom
        [s]. Must be at least 0.1 and at most 600.
    use_mag : bool, default True
        False: six axes only, the heading is integrated from the gyroscope.
    spread : bool, default False
        Spread the slow step over the samples until the next one, so that no sample costs much
        more than another; its result comes one slow period later.
    slow_period : float, default 0.05
        Time between two slow steps, rounded to whole samples [s]. Must be at least 0.005 and at
        most 0.5.
    uncalibrated_odds : float, default 0.3329
        Odds that the magnetometer has an uncalibrated hard iron; 0 says that it is calibrated and
        ends the question. Must be at least 0 and at most 1000.
    uncalibrated_std : float, default 0.2
        Hard iron of an uncalibrated magnetometer, standard deviation per axis, of the local
        field. Must be at least 0.001 and at most 10.
    gyro_sampling : {"mean", "instant"}, default "mean"
        What a gyroscope sample stands for, used with refine.
    refine : bool, default True
        Correct the averaged tilt for what has since been learned of the gyroscope, join rate
        samples to second order, keep north through a change of the field; false: the plain
        equations, for comparison.
    bias_std : float, default 0.017453292519943295
        Gyroscope bias before anything is learned, standard deviation per axis [rad/s]. Must be at
        least 0 and at most 1.
    bias_forget_time : float, default 100.0
        Time after which a learned bias has become uncertain by 0.1 deg/s [s]. Must be at least 1
        and at most 1e+06.
    bias_limit : float, default 0.03490658503988659
        Largest gyroscope bias that is learned, per axis [rad/s]. Must be at least 0 and at most
        10.
    motion_drift_std : float, default 0.0017453292519943296
        Accuracy to which the drift of the tilt in motion shows an error of the gyroscope [rad/s].
        Must be at least 1e-06 and at most 1.
    rest_drift_std : float, default 0.0005235987755982988
        Accuracy to which the low-passed gyroscope shows its bias at rest [rad/s]. Must be at
        least 1e-06 and at most 1.
    gyro_scale_std : float, default 0.006
        Scale error of the gyroscope, standard deviation per axis. Must be at least 0 and at most
        0.1.
    gyro_misalignment_std : float, default 0.004
        Misalignment and cross coupling of the gyroscope, standard deviation per element [rad].
        Must be at least 0 and at most 0.1.
    hard_iron_std : float, default 0.02
        Hard iron that a calibration leaves, standard deviation per axis, of the local field. Must
        be at least 0 and at most 10.
    mag_latency_std : float, default 0.01
        Latency of the magnetometer against the gyroscope, standard deviation [s]. Must be at
        least 0 and at most 0.1.
    mag_density : float, default 0.1
        Deviation of the mean of the field over one second, with everything that varies slowly in
        it, of the local field. Must be at least 1e-06 and at most 10.
    mag_noise : float, default 0.03
        Usual deviation of one magnetometer sample from the expected field, of the local field.
        Must be at least 1e-06 and at most 10.
    mag_rate_noise : float, default 0.005
        Additional deviation per angular rate [s]. Must be at least 0 and at most 1.
    mag_tilt_noise : float, default 0.3
        Additional deviation while the first tilt settles. Must be at least 0 and at most 10.
    hard_iron_walk : float, default 0.0003
        Random walk of the hard iron: standard deviation after one second, of the local field.
        Must be at least 0 and at most 1.
    field_walk : float, default 0.0002
        Random walk of the local field: standard deviation after one second, of itself. Must be at
        least 0 and at most 1.
    heading_walk : float, default 0.001
        Random walk of the integrated heading: standard deviation after one second [rad]. Must be
        at least 0 and at most 1.
    heading_rate_walk : float, default 0.0015
        Random walk of the integrated heading per angular rate: standard deviation after one
        second at one rad/s [s]. Must be at least 0 and at most 1.
    jump_time : float, default 0.5
        Time over which a misfit of the field is averaged before it counts as a change [s]. Must
        be at least 0.01 and at most 60.
    jump_threshold : float, default 2.0
        Mean squared misfit, of the expected one, above which the field or the hard iron has
        changed. Must be at least 1 and at most 100.
    jump_hard_iron : float, default 1.5
        How fast a change makes the hard iron uncertain [1/s]. Must be at least 0 and at most 100.
    jump_field : float, default 0.01
        How fast a change makes the local field uncertain [1/s]. Must be at least 0 and at most
        100.
    outlier_weight : float, default 0.5
        How much a misfit of one sample raises its noise. Must be at least 0 and at most 100.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        profile: Literal["hand", "multirotor", "custom"] = "hand",
        accel_time_constant: float = 3.5,
        use_mag: bool = True,
        spread: bool = False,
        slow_period: float = 0.05,
        uncalibrated_odds: float = 0.3329,
        uncalibrated_std: float = 0.2,
        gyro_sampling: Literal["mean", "instant"] = "mean",
        refine: bool = True,
        bias_std: float = 0.017453292519943295,
        bias_forget_time: float = 100.0,
        bias_limit: float = 0.03490658503988659,
        motion_drift_std: float = 0.0017453292519943296,
        rest_drift_std: float = 0.0005235987755982988,
        gyro_scale_std: float = 0.006,
        gyro_misalignment_std: float = 0.004,
        hard_iron_std: float = 0.02,
        mag_latency_std: float = 0.01,
        mag_density: float = 0.1,
        mag_noise: float = 0.03,
        mag_rate_noise: float = 0.005,
        mag_tilt_noise: float = 0.3,
        hard_iron_walk: float = 0.0003,
        field_walk: float = 0.0002,
        heading_walk: float = 0.001,
        heading_rate_walk: float = 0.0015,
        jump_time: float = 0.5,
        jump_threshold: float = 2.0,
        jump_hard_iron: float = 1.5,
        jump_field: float = 0.01,
        outlier_weight: float = 0.5,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "kcf",
            {
                "profile": profile,
                "accel_time_constant": accel_time_constant,
                "use_mag": use_mag,
                "spread": spread,
                "slow_period": slow_period,
                "uncalibrated_odds": uncalibrated_odds,
                "uncalibrated_std": uncalibrated_std,
                "gyro_sampling": gyro_sampling,
                "refine": refine,
                "bias_std": bias_std,
                "bias_forget_time": bias_forget_time,
                "bias_limit": bias_limit,
                "motion_drift_std": motion_drift_std,
                "rest_drift_std": rest_drift_std,
                "gyro_scale_std": gyro_scale_std,
                "gyro_misalignment_std": gyro_misalignment_std,
                "hard_iron_std": hard_iron_std,
                "mag_latency_std": mag_latency_std,
                "mag_density": mag_density,
                "mag_noise": mag_noise,
                "mag_rate_noise": mag_rate_noise,
                "mag_tilt_noise": mag_tilt_noise,
                "hard_iron_walk": hard_iron_walk,
                "field_walk": field_walk,
                "heading_walk": heading_walk,
                "heading_rate_walk": heading_rate_walk,
                "jump_time": jump_time,
                "jump_threshold": jump_threshold,
                "jump_hard_iron": jump_hard_iron,
                "jump_field": jump_field,
                "outlier_weight": outlier_weight,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class Mahony(Estimator):
    """Mahony's complementary filter with decoupled heading.

    Integrates the gyroscope together with a proportional-integral correction from the directions of
    gravity and of the horizontal field. The magnetometer corrects heading only, and the loop gain is one
    on all axes.

    Parameters
    ----------
    kp : float, default 1.0
        Proportional gain: about the crossover frequency between accelerometer/magnetometer and
        gyroscope [rad/s]. Must be at least 0 and at most 1000.
    ki : float, default 0.1
        Integral gain: how fast the gyroscope bias is learned; 0 switches that off [rad2/s2]. Must
        be at least 0 and at most 1e+06.
    bias_limit : float, default 0.2
        Largest gyroscope bias that is learned, per axis [rad/s]. Must be at least 0 and at most
        100.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        kp: float = 1.0,
        ki: float = 0.1,
        bias_limit: float = 0.2,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "mahony",
            {
                "kp": kp,
                "ki": ki,
                "bias_limit": bias_limit,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class MahonyEKF(Estimator):
    """Mahony's filter, smoothed by an extended Kalman filter.

    Mahony's filter runs by itself, and its quaternion is the measurement of an extended Kalman filter on
    the quaternion. That filter adds a fast low-pass, whose corner is gyro_noise/attitude_noise; the
    accuracy is Mahony's. The covariance is what the filter believes: it does not know that its
    measurement comes from the same gyroscope.

    Parameters
    ----------
    kp : float, default 1.0
        Proportional gain: about the crossover frequency between accelerometer/magnetometer and
        gyroscope [rad/s]. Must be at least 0 and at most 1000.
    ki : float, default 0.1
        Integral gain: how fast the gyroscope bias is learned; 0 switches that off [rad2/s2]. Must
        be at least 0 and at most 1e+06.
    bias_limit : float, default 0.2
        Largest gyroscope bias that is learned, per axis [rad/s]. Must be at least 0 and at most
        100.
    bias_feed : bool, default True
        Predict with the rate without Mahony's bias; false is the printed form, which lets a bias
        error back in.
    gyro_noise : float, default 0.01
        White noise of the gyroscope, rad/s/sqrt(Hz). Must be above 0 and at most 100.
    attitude_noise : float, default 0.002
        White noise of the attitude from the Mahony filter at rest, rad/sqrt(Hz). Must be above 0
        and at most 100.
    accel_distrust : float, default 1.0
        Relative growth of the variance of that attitude with the deviation of the specific force
        from gravity [s2/m]. Must be at least 0 and at most 100.
    motion_noise : float, default 0.5
        Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation.
        Must be at least 0 and at most 1000.
    initial_attitude_std : float, default 2.0
        Standard deviation of the first attitude [rad]. Must be at least 0.0001 and at most 10.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        kp: float = 1.0,
        ki: float = 0.1,
        bias_limit: float = 0.2,
        bias_feed: bool = True,
        gyro_noise: float = 0.01,
        attitude_noise: float = 0.002,
        accel_distrust: float = 1.0,
        motion_noise: float = 0.5,
        initial_attitude_std: float = 2.0,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "mahony_ekf",
            {
                "kp": kp,
                "ki": ki,
                "bias_limit": bias_limit,
                "bias_feed": bias_feed,
                "gyro_noise": gyro_noise,
                "attitude_noise": attitude_noise,
                "accel_distrust": accel_distrust,
                "motion_noise": motion_noise,
                "initial_attitude_std": initial_attitude_std,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class MEKF(Estimator):
    """Multiplicative extended Kalman filter with gyroscope bias.

    The gyroscope without its estimated bias predicts the attitude; specific force and magnetic field
    correct attitude and bias together. The covariance is that of a small rotation about the body axes and
    of the bias. What the accelerometer feels beside gravity counts as its noise: accel_noise has to cover
    the motion of the vehicle.

    Parameters
    ----------
    bias_limit : float, default 0.2
        Largest gyroscope bias that is learned, per axis [rad/s]. Must be at least 0 and at most
        100.
    gyro_noise : float, default 0.0002
        White noise of the gyroscope, rad/s/sqrt(Hz). Must be at least 1e-07 and at most 100.
    gyro_bias_noise : float, default 0.000175
        Random walk of the gyroscope bias, rad/s/s/sqrt(Hz). Must be at least 0 and at most 100.
    accel_noise : float, default 0.1
        White noise of the accelerometer with the motion of the vehicle, m/s2/sqrt(Hz). Must be at
        least 0.0001 and at most 1000.
    mag_noise : float, default 1e-07
        White noise of the magnetometer with disturbances of the field, T/sqrt(Hz). Must be at
        least 1e-09 and at most 1.
    motion_noise : float, default 0.5
        Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation.
        Must be at least 0 and at most 1000.
    initial_attitude_std : float, default 0.1
        Standard deviation of the first attitude [rad]. Must be at least 0.0001 and at most 10.
    initial_bias_std : float, default 0.02
        Standard deviation of the gyroscope bias at the start [rad/s]. Must be at least 1e-06 and
        at most 10.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        bias_limit: float = 0.2,
        gyro_noise: float = 0.0002,
        gyro_bias_noise: float = 0.000175,
        accel_noise: float = 0.1,
        mag_noise: float = 1e-07,
        motion_noise: float = 0.5,
        initial_attitude_std: float = 0.1,
        initial_bias_std: float = 0.02,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "mekf",
            {
                "bias_limit": bias_limit,
                "gyro_noise": gyro_noise,
                "gyro_bias_noise": gyro_bias_noise,
                "accel_noise": accel_noise,
                "mag_noise": mag_noise,
                "motion_noise": motion_noise,
                "initial_attitude_std": initial_attitude_std,
                "initial_bias_std": initial_bias_std,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class Strapdown(Estimator):
    """Gyroscope alone.

    Integrates the gyroscope by fourth-order angle increments from the first attitude on. Accelerometer
    and magnetometer give that first attitude and are not used afterwards: the error grows with the
    gyroscope's bias. A baseline for the others.

    Parameters
    ----------
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "strapdown",
            {
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


class UKF(Estimator):
    """Unscented Kalman filter with gyroscope bias, in square-root form.

    States and noise are those of the multiplicative extended Kalman filter; means and covariances are
    taken over twelve points around the estimate and the estimate itself. The defaults weight the points
    equally and the estimate not at all, which are the cubature rules. A small alpha draws the points
    together, until in single precision little more than rounding is left of their differences.

    Parameters
    ----------
    bias_limit : float, default 0.2
        Largest gyroscope bias that is learned, per axis [rad/s]. Must be at least 0 and at most
        100.
    gyro_noise : float, default 0.0002
        White noise of the gyroscope, rad/s/sqrt(Hz). Must be at least 1e-07 and at most 100.
    gyro_bias_noise : float, default 0.000175
        Random walk of the gyroscope bias, rad/s/s/sqrt(Hz). Must be at least 0 and at most 100.
    accel_noise : float, default 0.1
        White noise of the accelerometer with the motion of the vehicle, m/s2/sqrt(Hz). Must be at
        least 0.0001 and at most 1000.
    mag_noise : float, default 1e-07
        White noise of the magnetometer with disturbances of the field, T/sqrt(Hz). Must be at
        least 1e-09 and at most 1.
    motion_noise : float, default 0.5
        Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation.
        Must be at least 0 and at most 1000.
    initial_attitude_std : float, default 0.1
        Standard deviation of the first attitude [rad]. Must be at least 0.0001 and at most 1.
    initial_bias_std : float, default 0.02
        Standard deviation of the gyroscope bias at the start [rad/s]. Must be at least 1e-06 and
        at most 10.
    alpha : float, default 1.0
        Spread of the points, in standard deviations over the square root of 6 + kappa. Must be at
        least 0.0001 and at most 2.
    beta : float, default 0.0
        Additional weight of the estimate in the covariances. Must be at least 0 and at most 10.
    kappa : float, default 0.0
        Further spread of the points: with alpha = 1 the weight of the estimate is kappa/(6 +
        kappa). Must be at least -5 and at most 100.
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
    gyro_zero_samples : int, default 0
        Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0
        switches it off.
    gyro_zero_std : float, default 0.02
        Standard deviation per sample and axis above which the vehicle is not at rest: about three
        times the sensor's [rad/s]. Must be at least 0 and at most 10.
    gyro_zero_limit : float, default 0.1
        Largest zero of the gyroscope that is believed; more is a rotation [rad/s]. Must be at
        least 0 and at most 10.
    accel_cutoff : float, default 0.0
        Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off
        [Hz]. Must be at least 0 and at most 10000.
    mag_offset : sequence of float, default (0.0, 0.0, 0.0)
        Hard iron, subtracted from the magnetometer, body axes [T]. Must be at least -0.01 and at
        most 0.01.
    mag_gain : sequence of float, default (1.0, 1.0, 1.0)
        What the magnetometer without its offset is multiplied with, body axes. Must be at least
        0.01 and at most 100.
    precision : {"double", "single"}
        Floating-point type of the computation.
    backend : {"c", "numpy"}
        Who computes: the C code, or its twin in numpy.

    Raises
    ------
    ParameterError
        If a value is outside its limits, or values contradict each other.
    """

    def __init__(
        self,
        *,
        bias_limit: float = 0.2,
        gyro_noise: float = 0.0002,
        gyro_bias_noise: float = 0.000175,
        accel_noise: float = 0.1,
        mag_noise: float = 1e-07,
        motion_noise: float = 0.5,
        initial_attitude_std: float = 0.1,
        initial_bias_std: float = 0.02,
        alpha: float = 1.0,
        beta: float = 0.0,
        kappa: float = 0.0,
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
        gyro_zero_samples: int = 0,
        gyro_zero_std: float = 0.02,
        gyro_zero_limit: float = 0.1,
        accel_cutoff: float = 0.0,
        mag_offset: Sequence[float] = (0.0, 0.0, 0.0),
        mag_gain: Sequence[float] = (1.0, 1.0, 1.0),
        precision: Precision = "double",
        backend: Backend = "c",
    ) -> None:
        super().__init__(
            "ukf",
            {
                "bias_limit": bias_limit,
                "gyro_noise": gyro_noise,
                "gyro_bias_noise": gyro_bias_noise,
                "accel_noise": accel_noise,
                "mag_noise": mag_noise,
                "motion_noise": motion_noise,
                "initial_attitude_std": initial_attitude_std,
                "initial_bias_std": initial_bias_std,
                "alpha": alpha,
                "beta": beta,
                "kappa": kappa,
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
                "gyro_zero_samples": gyro_zero_samples,
                "gyro_zero_std": gyro_zero_std,
                "gyro_zero_limit": gyro_zero_limit,
                "accel_cutoff": accel_cutoff,
                "mag_offset": mag_offset,
                "mag_gain": mag_gain,
            },
            precision,
            backend,
        )


BY_NAME: dict[str, type[Estimator]] = {
    "adaptive_ckf": AdaptiveCKF,
    "cg_ekf": CGEKF,
    "complementary": Complementary,
    "gcf": GCF,
    "improved_ekf": ImprovedEKF,
    "kcf": KCF,
    "mahony": Mahony,
    "mahony_ekf": MahonyEKF,
    "mekf": MEKF,
    "strapdown": Strapdown,
    "ukf": UKF,
}
"""The classes by the name of their descriptor."""
