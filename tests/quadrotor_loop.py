"""Connections of quadrotor, IMU, estimator and controller, for tests that make the loop themselves."""

from __future__ import annotations

CONNECTIONS = (
    "quadrotor.q -> imu.q",
    "quadrotor.rate -> imu.rate",
    "quadrotor.specific_force -> imu.specific_force",
    "quadrotor.rotor_speed -> imu.rotor_speed",
    "imu.gyro -> estimator.gyro",
    "imu.accel -> estimator.accel",
    "imu.mag -> estimator.mag",
    "imu.accel_valid -> estimator.accel_valid",
    "imu.mag_valid -> estimator.mag_valid",
    "estimator.q -> controller.q",
    "estimator.rate -> controller.rate",
    "controller.rotor_speed_command -> quadrotor.rotor_speed_command",
)
START_VALUES = ("quadrotor.wind", "controller.rate_ref", "controller.angular_acceleration_ref")
