"""The estimators by name, with their parameters.

Generated from the descriptors by ``python -m ahrs_fmu.export.classes``: change those, not this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from ahrs_fmu.estimator import Estimator
from ahrs_fmu.host_library import Precision

__all__ = ["GCF", "KCF"]


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
        precision: Precision = "double",
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
            },
            precision,
        )


BY_NAME: dict[str, type[Estimator]] = {
    "gcf": GCF,
    "kcf": KCF,
}
"""The classes by the name of their descriptor."""
