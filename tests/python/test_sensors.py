from __future__ import annotations

import msgspec
import numpy as np
import pytest

from ahrs_fmu import sensors
from ahrs_fmu.errors import ScenarioError
from ahrs_fmu.sensors import CounterDraws, GeneratorDraws, Imu, Readings, Triad

T = 0.01
DEG = np.pi / 180.0
ZERO = np.zeros((1000, 3))


def read(imu: Imu, truth: np.ndarray = ZERO, sample_time: float = T, seed: object = 1) -> Readings:
    draws = CounterDraws(seed)  # type: ignore[arg-type]
    return sensors.measure(imu, truth, truth, truth, sample_time=sample_time, draws=draws)


def gyro(triad: Triad, truth: np.ndarray = ZERO, **options: object) -> np.ndarray:
    return read(Imu(gyro=triad), truth, **options).gyro  # type: ignore[arg-type]


def test_a_perfect_sensor_reads_the_truth() -> None:
    truth = np.random.default_rng(0).standard_normal((50, 3))
    y = read(Imu(), truth)
    for reading in (y.gyro, y.accel, y.mag):
        np.testing.assert_array_equal(reading, truth)
    np.testing.assert_array_equal(y.gyro_bias, 0.0)
    assert y.accel_fresh.all()
    assert y.mag_fresh.all()


@pytest.mark.parametrize("sample_time", [0.001, 0.01, 0.1])
def test_white_noise_keeps_its_density_at_every_rate(sample_time: float) -> None:
    y = gyro(Triad(noise_density=2e-3), np.zeros((40_000, 3)), sample_time=sample_time)
    assert y.std() * np.sqrt(sample_time) == pytest.approx(2e-3, rel=0.01)


def test_noise_stated_per_sample_does_not_depend_on_the_rate() -> None:
    for sample_time in (0.001, 0.1):
        y = gyro(Triad(noise_std=0.3), np.zeros((40_000, 3)), sample_time=sample_time)
        assert y.std() == pytest.approx(0.3, rel=0.01)


def test_bandwidth_limits_noise_and_delays_a_ramp_by_its_time_constant() -> None:
    corner = 2.0
    y = gyro(Triad(noise_density=1e-2, bandwidth=corner), np.zeros((50_000, 3)))
    pole = np.exp(-2 * np.pi * corner * T)
    assert y.std() == pytest.approx(1e-2 / np.sqrt(T) * np.sqrt((1 - pole) / (1 + pole)), rel=0.02)
    ramp = np.arange(1000)[:, None] * T * np.ones(3)
    lag = ramp[-1] - gyro(Triad(bandwidth=corner), ramp)[-1]
    np.testing.assert_allclose(lag, T * pole / (1 - pole), rtol=1e-9)


def test_bias_walk_grows_with_the_square_root_of_time() -> None:
    bias = read(Imu(gyro=Triad(bias_walk=1e-3)), np.zeros((501, 3)), seed=np.arange(400)).gyro_bias
    assert bias.shape == (400, 501, 3)
    np.testing.assert_array_equal(bias[:, 0], 0.0)
    for k in (50, 500):
        assert bias[:, k].std() == pytest.approx(1e-3 * np.sqrt(k * T), rel=0.1)


def test_bias_instability_is_stationary_with_its_correlation_time() -> None:
    triad = Triad(bias_instability=0.2, bias_time=1.0)
    bias = read(Imu(gyro=triad), np.zeros((151, 3)), seed=np.arange(1000)).gyro_bias
    for k in (0, 150):
        assert bias[:, k].std() == pytest.approx(0.2, rel=0.05)
    lagged = np.mean(bias[:, 0] * bias[:, 100]) / 0.04
    assert lagged == pytest.approx(np.exp(-1.0), abs=0.05)


def test_constant_and_turn_on_bias_stay_for_a_run_and_are_reported() -> None:
    y = read(
        Imu(gyro=Triad(bias=(0.1, -0.2, 0.3), turn_on_bias=0.05)), np.zeros((5, 3)), seed=np.arange(2000)
    )
    np.testing.assert_array_equal(y.gyro[:, 0], y.gyro[:, -1])
    np.testing.assert_array_equal(y.gyro, y.gyro_bias)
    np.testing.assert_allclose(y.gyro[:, 0].mean(axis=0), (0.1, -0.2, 0.3), atol=0.004)
    assert y.gyro[:, 0].std(axis=0) == pytest.approx(0.05, rel=0.06)


def test_scale_and_misalignment_turn_and_stretch() -> None:
    truth = np.tile([1.0, 0.0, 0.0], (5, 1))
    np.testing.assert_allclose(gyro(Triad(scale=(0.1, 0, 0)), truth)[0], (1.1, 0, 0))
    # A sensor turned by +1 mrad about z sees x slightly along its -y.
    np.testing.assert_allclose(gyro(Triad(misalignment=(0, 0, 1e-3)), truth)[0], (1.0, -1e-3, 0))


def test_soft_iron_acts_before_hard_iron() -> None:
    imu = Imu(hard_iron=(1e-6, 0, 0), soft_iron=((2, 0, 0), (0, 1, 0), (0.5, 0, 1)))
    y = read(imu, np.tile([4e-5, 0.0, 3e-5], (5, 1)))
    np.testing.assert_allclose(y.mag[0], (8.1e-5, 0, 5e-5))


def test_quantisation_and_saturation_bound_the_reading() -> None:
    ramp = np.linspace(-3, 3, 601)[:, None] * np.ones(3)
    y = gyro(Triad(quantisation=0.25, saturation=2.0), ramp)
    np.testing.assert_array_equal(y, np.round(y / 0.25) * 0.25)
    assert y.min() == -2.0
    assert y.max() == 2.0
    inside = np.abs(ramp) < 2.0
    assert np.abs(y - ramp)[inside].max() <= 0.125 + 1e-12


def test_delay_shifts_by_whole_samples() -> None:
    ramp = np.arange(100.0)[:, None] * np.ones(3)
    np.testing.assert_array_equal(gyro(Triad(delay=0.03), ramp)[:, 0], np.maximum(np.arange(100) - 3, 0))


def test_a_slower_output_is_held_and_its_rows_marked() -> None:
    truth = np.arange(100.0)[:, None] * np.ones(3)
    y = read(Imu(mag=Triad(rate=20.0)), truth)
    np.testing.assert_array_equal(np.flatnonzero(y.mag_fresh), np.arange(0, 100, 5))
    np.testing.assert_array_equal(y.mag[:, 0], np.arange(100) // 5 * 5)


def test_sensors_and_axes_have_noise_of_their_own() -> None:
    white = Triad(noise_std=1.0)
    y = read(Imu(gyro=white, accel=white, mag=white), np.zeros((20_000, 3)))
    together = np.concatenate((y.gyro, y.accel, y.mag), axis=1)
    correlation = np.corrcoef(together, rowvar=False) - np.eye(9)
    assert np.abs(correlation).max() < 0.03


def test_a_longer_run_begins_like_a_shorter_one_and_a_batch_holds_the_single_runs() -> None:
    imu = sensors.load("adis16405")
    batch = read(imu, np.zeros((300, 3)), seed=np.array([4, 9]))
    single = read(imu, np.zeros((500, 3)), seed=9)
    np.testing.assert_array_equal(batch.gyro[1], single.gyro[:300])
    assert not np.array_equal(batch.gyro[0], batch.gyro[1])


def test_a_numpy_generator_can_drive_the_same_model() -> None:
    imu = Imu(gyro=Triad(noise_std=0.5))
    draws = GeneratorDraws(np.random.default_rng(3))
    y = sensors.measure(imu, ZERO, ZERO, ZERO, sample_time=T, draws=draws)
    np.testing.assert_array_equal(
        y.gyro, 0.5 * np.random.default_rng(3).standard_normal((1000, 3, 2))[..., 0]
    )


def test_the_named_sensors_carry_the_data_sheet_figures() -> None:
    adis = sensors.load("adis16405")
    assert adis.gyro.noise_density * np.sqrt(2) == pytest.approx(0.05 * DEG, rel=1e-3)
    assert adis.accel.noise_density * np.sqrt(2) == pytest.approx(0.5e-3 * 9.80665, rel=1e-3)
    assert adis.gyro.saturation == pytest.approx(300 * DEG, rel=1e-3)
    assert adis.accel.quantisation == pytest.approx(3.33e-3 * 9.80665, rel=1e-3)
    mpu = sensors.load("mpu9250")
    assert mpu.gyro.noise_density * np.sqrt(2) == pytest.approx(0.01 * DEG, rel=1e-3)
    assert mpu.accel.noise_density * np.sqrt(2) == pytest.approx(300e-6 * 9.80665, rel=1e-3)
    assert mpu.gyro.quantisation == pytest.approx(DEG / 16.4, rel=1e-3)
    assert mpu.mag.quantisation == 1.5e-7


@pytest.mark.parametrize(
    ("name", "gyro_deg", "accel", "mag"),
    [
        ("me-static", 0.05, 0.03, 0.3e-6),
        ("me-dynamic", 0.1, 0.15, 0.5e-6),
        ("me-hover", 0.1, 0.17, 0.5e-6),
        ("ac", 0.41, 0.043, 0.125e-6),
        ("cg", 0.1, 0.05, 0.4e-6),
        ("gc", 0.05, 0.01, 0.1e-6),
        ("gc-hardware", 0.05, 0.01, 2e-6),
    ],
)
def test_the_sources_sensors_have_the_stated_noise(
    name: str, gyro_deg: float, accel: float, mag: float
) -> None:
    y = read(sensors.load(name), np.zeros((20_000, 3)), sample_time=0.02)
    assert (y.gyro - y.gyro_bias).std() == pytest.approx(gyro_deg * DEG, rel=0.02)
    assert y.accel.std() == pytest.approx(accel, rel=0.02)
    assert (y.mag - y.mag.mean(axis=0)).std() == pytest.approx(mag, rel=0.02)


def test_the_gc_bias_steps_a_thousandth_of_a_degree_per_second() -> None:
    bias = read(sensors.load("gc"), np.zeros((20_000, 3)), sample_time=0.02).gyro_bias
    assert np.diff(bias, axis=0).std() == pytest.approx(0.001 * DEG, rel=0.02)


def test_an_unknown_sensor_is_refused_with_the_known_names() -> None:
    with pytest.raises(ScenarioError, match=r"'bmi088' is unknown; known are .*adis16405.*mpu9250"):
        sensors.load("bmi088")


@pytest.mark.parametrize("entry", [{"noise": 1.0}, {"noise_density": -1.0}, {"bias": [0.0, 1.0]}])
def test_a_sensor_file_with_a_wrong_entry_is_refused(entry: dict[str, object]) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"gyro": entry}, Imu)
