"""Noise densities from sensor models and from recordings, and what they lead to."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import Frame, Record, records
from ahrs_fmu.analysis.design import optimal_gains
from ahrs_fmu.analysis.sensor_noise import noise_of_imu, noise_of_record, rest
from ahrs_fmu.errors import RecordError
from ahrs_fmu.sensors import Imu, Triad

T = 0.01
GYRO, WALK, ACCEL, MAG = 1e-3, 3e-4, 5e-3, 5e-8
DIP = math.radians(60.0)


def recording(seconds: float, moving: float = 0.0) -> Record:
    """Rest of known noise, after some seconds of motion."""
    rng = np.random.default_rng(11)
    n, root = round(seconds / T), math.sqrt(T)
    gyro = GYRO / root * rng.standard_normal((n, 3))
    gyro += np.cumsum(WALK * root * rng.standard_normal((n, 3)), axis=0)
    shaken = round(moving / T)
    gyro[:shaken] += np.sin(np.arange(shaken)[:, None] * T * np.array([3.0, 4.0, 5.0]))
    field = 50e-6 * np.array([math.cos(DIP), 0.0, math.sin(DIP)])
    return Record(
        time=T * np.arange(n),
        gyro=gyro,
        accel=[0.0, 0.0, -9.8] + ACCEL / root * rng.standard_normal((n, 3)),
        mag=field + MAG / root * rng.standard_normal((n, 3)),
    )


def test_a_recording_at_rest_tells_the_densities_it_was_made_with() -> None:
    found = noise_of_record(recording(1200.0))
    assert found.walk_resolved
    assert found.noise.gyro == pytest.approx(GYRO, rel=0.1)
    assert found.noise.bias_walk == pytest.approx(WALK, rel=0.2)
    assert found.noise.accel == pytest.approx(ACCEL, rel=0.1)
    assert found.noise.mag == pytest.approx(MAG, rel=0.1)
    assert found.noise.dip == pytest.approx(DIP, abs=1e-3)
    assert found.noise.field == pytest.approx(50e-6, rel=1e-3)


def test_the_frame_of_a_recording_does_not_matter() -> None:
    record = recording(60.0)
    ned, enu = noise_of_record(record).noise, noise_of_record(record.in_frame(Frame.ENU)).noise
    assert enu.dip == pytest.approx(ned.dip, rel=1e-9)
    assert enu.gyro == pytest.approx(ned.gyro, rel=1e-6)


def test_the_longest_rest_is_found_after_motion() -> None:
    start, stop = rest(recording(60.0, moving=20.0))
    assert start * T == pytest.approx(20.0, abs=1.0)
    assert stop * T == pytest.approx(60.0, abs=1.0)


def test_a_short_rest_gives_an_upper_limit_of_the_bias_walk_and_says_so() -> None:
    found = noise_of_record(recording(20.0))
    assert not found.walk_resolved
    assert found.noise.bias_walk > WALK / 2.0


def test_a_recorded_rest_leads_to_gains(broad_dir: Path) -> None:
    found = noise_of_record(records.read(broad_dir / "03_undisturbed_slow_rotation_C.mat"))
    assert found.duration == pytest.approx(45.0, abs=3.0)
    assert math.degrees(found.noise.dip) == pytest.approx(67.0, abs=3.0)
    assert math.degrees(found.noise.gyro) == pytest.approx(0.006, rel=0.3)
    gains = optimal_gains(found.noise.tilt)
    assert 0.1 < gains.kp < 2.0
    assert gains.ki > 0.0


def test_without_rest_or_magnetometer_a_recording_is_refused() -> None:
    with pytest.raises(RecordError, match="the longest rest is 5 s: record 10 s or more at rest"):
        noise_of_record(recording(5.0))
    with pytest.raises(RecordError, match="longest rest"):
        noise_of_record(recording(30.0, moving=30.0))
    quiet = recording(30.0)
    with pytest.raises(RecordError, match="no magnetometer"):
        noise_of_record(replace(quiet, mag=np.full_like(quiet.mag, np.nan)))


def test_noise_per_sample_becomes_a_density_at_the_rate_of_the_sensor() -> None:
    imu = Imu(
        gyro=Triad(noise_density=3e-4, bias_instability=1e-4, bias_time=50.0, bias_walk=1e-5),
        accel=Triad(noise_density=3e-3, noise_std=0.04),
        mag=Triad(noise_std=1e-7, rate=25.0),
    )
    found = noise_of_imu(imu, T)
    assert found.gyro == pytest.approx(3e-4)
    assert found.bias_walk == pytest.approx(math.hypot(1e-5, 1e-4 * math.sqrt(2.0 / 50.0)))
    assert found.accel == pytest.approx(math.hypot(3e-3, 0.04 * math.sqrt(T)))
    assert found.mag == pytest.approx(1e-7 / 5.0)
