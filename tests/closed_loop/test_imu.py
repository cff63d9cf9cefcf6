"""The IMU in C against the sensor model of the package, against theory, and against its own promises."""

from __future__ import annotations

import hashlib

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from ahrs_fmu import descriptors, quaternion, sensors
from ahrs_fmu.native import NativeModel, Precision
from ahrs_fmu.sensors import CounterDraws, Imu, Triad

Array = NDArray[np.float64]

STILL = {"vibration_accel": 0.0, "vibration_blade": 0.0, "vibration_gyro": 0.0}
TRIADS = ("gyro", "accel", "mag")


def model(precision: Precision = "double", **parameters: object) -> NativeModel:
    descriptor = descriptors.load("imu")
    native = NativeModel(descriptor, precision)
    for name, value in parameters.items():
        native.set(name, descriptor.numbers(descriptor.parameter(name), value))
    native.reset()
    return native


def of_sensor(imu: Imu) -> dict[str, object]:
    """Parameters of the C model for a sensor of the package; what is unbounded there is 0 here."""
    parameters: dict[str, object] = {"hard_iron": imu.hard_iron, "soft_iron": np.ravel(imu.soft_iron)}
    for name in TRIADS:
        for field, value in msgspec.structs.asdict(getattr(imu, name)).items():
            parameters[f"{name}_{field}"] = 0.0 if value == np.inf else value
    return parameters


def motion(samples: int, dt: float) -> tuple[Array, Array, Array]:
    """Attitude, mean rate and specific force of a vehicle that swings."""
    time = dt * np.arange(1, samples + 1)
    q = quaternion.from_euler(
        np.column_stack((0.6 * np.sin(2.0 * time), 0.4 * np.sin(1.3 * time), 0.9 * time))
    )
    turn = quaternion.log(quaternion.multiply(quaternion.conjugate(q[:-1]), q[1:])) / dt
    rate = np.vstack((turn[:1], turn))
    force = np.column_stack((np.sin(time), 0.5 * np.cos(3.0 * time), -9.8 + 0.2 * np.sin(5.0 * time)))
    return q, rate, force


def run(
    native: NativeModel, dt: float, q: Array, rate: Array, force: Array, **more: Array
) -> dict[str, Array]:
    names = [output.name for output in native.descriptor.outputs]
    inputs = {"q": q, "rate": rate, "specific_force": force, **more}
    return {name: np.asarray(v) for name, v in native.run(np.full(len(q), dt), inputs, names).items()}


def at_rest(native: NativeModel, samples: int, dt: float) -> dict[str, Array]:
    force = np.tile([0.0, 0.0, -9.80665], (samples, 1))
    return run(native, dt, np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1)), np.zeros((samples, 3)), force)


def everything() -> Imu:
    """A sensor with every error there is."""
    triad = Triad(
        noise_density=1e-3,
        noise_std=2e-3,
        bias=(0.01, -0.02, 0.03),
        turn_on_bias=0.02,
        bias_instability=0.01,
        bias_time=5.0,
        bias_walk=1e-3,
        scale=(0.01, -0.02, 0.005),
        misalignment=(0.01, 0.02, -0.03),
        bandwidth=40.0,
        delay=0.0098,
        rate=70.0,
        quantisation=1e-3,
        saturation=9.7,
    )
    field = msgspec.structs.replace(
        triad,
        noise_density=0.0,
        noise_std=3e-7,
        bias=(1e-6, 0.0, -2e-6),
        turn_on_bias=1e-6,
        bias_instability=5e-7,
        bias_walk=1e-7,
        delay=0.0201,
        rate=50.0,
        quantisation=1.5e-7,
        saturation=4.4e-5,
    )
    iron = ((1.05, 0.02, 0.0), (0.01, 0.97, -0.03), (0.0, 0.02, 1.01))
    return Imu(gyro=triad, accel=triad, mag=field, hard_iron=(5e-6, -3e-6, 1e-6), soft_iron=iron)


@pytest.mark.parametrize("name", ["everything", *sensors.names()])
def test_it_reads_what_the_sensor_model_of_the_package_reads(name: str) -> None:
    imu = everything() if name == "everything" else sensors.load(name)
    dt, samples, seed = 0.005, 3000, 42
    q, rate, force = motion(samples, dt)
    field = 5e-5 * np.array([np.cos(1.1), 0.0, np.sin(1.1)])
    expected = sensors.measure(
        imu,
        rate,
        force,
        quaternion.rotate(quaternion.conjugate(q), field),
        sample_time=dt,
        draws=CounterDraws(seed),
    )
    native = model(sample_time=dt, seed=seed, **STILL, **of_sensor(imu))
    ours = run(native, dt, q, rate, force)
    for triad in TRIADS:
        wanted, step = getattr(expected, triad), getattr(imu, triad).quantisation
        # Truth on the edge between two steps of the quantisation may fall to either side.
        apart = np.abs(ours[triad] - wanted) > 1e-9 * np.abs(wanted).max()
        assert np.abs(ours[triad] - wanted).max() <= 1.001 * step + 1e-9 * np.abs(wanted).max()
        assert apart.mean() < 1e-3
    assert np.abs(ours["true_gyro_bias"] - expected.gyro_bias).max() < 1e-12
    assert np.array_equal(ours["accel_valid"].ravel(), expected.accel_fresh)
    assert np.array_equal(ours["mag_valid"].ravel(), expected.mag_fresh)


def allan_deviation(x: Array, dt: float, cluster: int) -> float:
    """Overlapping Allan deviation at cluster * dt, mean over the axes."""
    angle = np.vstack((np.zeros(3), np.cumsum(x, axis=0) * dt))
    second = angle[2 * cluster :] - 2.0 * angle[cluster:-cluster] + angle[: -2 * cluster]
    return float(np.sqrt(np.mean(second**2) / (2.0 * (cluster * dt) ** 2)))


@pytest.mark.parametrize("triad", ["gyro", "accel"])
def test_the_allan_deviation_returns_density_and_walk(triad: str) -> None:
    """Half an hour at 100 Hz with N = 1e-3 and K = 2e-3: the two lines cross at sqrt(3) N/K = 0.9 s."""
    density, walk, dt, samples = 1e-3, 2e-3, 0.01, 180_000
    silent = of_sensor(Imu())
    native = model(
        sample_time=dt, **STILL, **silent | {f"{triad}_noise_density": density, f"{triad}_bias_walk": walk}
    )
    x = at_rest(native, samples, dt)[triad]
    x = x - x[0]
    assert allan_deviation(x, dt, 1) == pytest.approx(density / np.sqrt(dt), rel=0.1)
    assert allan_deviation(x, dt, 5) * np.sqrt(5 * dt) == pytest.approx(density, rel=0.1)
    tau = 15.0
    assert allan_deviation(x, dt, round(tau / dt)) / np.sqrt(tau / 3.0) == pytest.approx(walk, rel=0.1)


def test_the_default_sensor_has_the_white_noise_of_its_data_sheet() -> None:
    """MPU-9250 at rest for ten minutes at 250 Hz, quantised; without low-passes, which colour the noise."""
    dt, samples = 0.004, 150_000
    y = at_rest(model(gyro_bandwidth=0.0, accel_bandwidth=0.0, **STILL), samples, dt)
    for triad, density in (("gyro", 1.2e-4), ("accel", 2.1e-3)):
        found = allan_deviation(y[triad] - y[triad].mean(axis=0), dt, 25) * np.sqrt(25 * dt)
        assert found == pytest.approx(density, rel=0.1)
    fresh = y["mag"][y["mag_valid"].ravel().astype(bool)]
    assert len(fresh) * 0.01 == pytest.approx(samples * dt, rel=1e-3)
    assert allan_deviation(fresh - fresh.mean(axis=0), 0.01, 1) == pytest.approx(6e-7, rel=0.1)


def test_a_wandering_bias_has_the_deviation_and_the_correlation_time_given() -> None:
    silent = of_sensor(Imu())
    changes = {"gyro_bias_instability": 0.02, "gyro_bias_time": 0.5}
    runs = [
        at_rest(model(sample_time=0.05, seed=k, **STILL, **silent | changes), 4000, 0.05)["gyro"]
        for k in range(5)
    ]
    x = np.concatenate(runs, axis=1)
    assert x.std() == pytest.approx(0.02, rel=0.05)
    assert np.mean(x[10:] * x[:-10]) / np.mean(x**2) == pytest.approx(np.exp(-1.0), abs=0.05)


def test_a_seed_is_a_sequence_and_another_seed_another() -> None:
    one, again, other = (at_rest(model(seed=s), 100, 0.004)["gyro"] for s in (3, 3, 4))
    assert np.array_equal(one, again)
    assert np.mean(one == other) < 0.2


def test_the_bits_of_a_seed_do_not_change() -> None:
    """The truth is made of exact numbers, so that no library's rounding is in the hash."""
    samples = 2000
    native = model(seed=2024, **of_sensor(everything()))
    q, still = np.tile([0.8, 0.0, 0.6, 0.0], (samples, 1)), np.zeros((samples, 3))
    y = run(native, 0.004, q, still, still - 9.75, rotor_speed=np.full((samples, 4), 430.0))
    digest = hashlib.sha256(
        b"".join(np.ascontiguousarray(y[name]).tobytes() for name in sorted(y))
    ).hexdigest()
    assert digest[:16] == "b396c89eeb6bb24d"


def test_a_perfect_sensor_gives_the_mean_rate_between_samples() -> None:
    q, rate, force = motion(500, 0.004)
    y = run(model(errors=False), 0.004, q, rate, force)
    assert np.abs(y["gyro"] - rate).max() < 1e-11
    assert np.array_equal(y["accel"], force)
    assert np.abs(np.linalg.norm(y["mag"], axis=1) - 5e-5).max() < 1e-18
    assert all(y[f"{triad}_valid"].all() for triad in TRIADS)


def test_declination_turns_the_field_towards_east() -> None:
    native = model(errors=False, declination=0.3, field_dip=1.0)
    mag = at_rest(native, 1, 0.004)["mag"][0]
    assert np.arctan2(mag[1], mag[0]) == pytest.approx(0.3)
    assert np.arctan2(mag[2], np.hypot(mag[0], mag[1])) == pytest.approx(1.0)


def spectrum(x: Array, dt: float) -> tuple[Array, Array]:
    """Frequencies in rad/s and amplitudes."""
    window = np.hanning(len(x))
    return 2.0 * np.pi * np.fft.rfftfreq(len(x), dt), 2.0 * np.abs(np.fft.rfft(x * window)) / window.sum()


@pytest.mark.parametrize(
    ("speed", "shows"), [(300.0, 300.0), (600.0, 600.0), (1000.0, 2 * np.pi * 250.0 - 1000.0)]
)
def test_vibration_shows_at_the_rotor_speed_or_at_its_alias(speed: float, shows: float) -> None:
    samples = 5000
    native = model(seed=5, vibration_accel=1.0, vibration_blade=0.0, vibration_gyro=0.02, **of_sensor(Imu()))
    speeds = np.zeros((samples, 4))
    speeds[:, 0] = speed
    still = np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1))
    y = run(native, 0.004, still, np.zeros((samples, 3)), np.zeros((samples, 3)), rotor_speed=speeds)
    frequency, amplitude = spectrum(y["accel"][:, 0], 0.004)
    assert frequency[np.argmax(amplitude)] == pytest.approx(shows, abs=0.5)
    assert amplitude.max() == pytest.approx((speed / 434.27) ** 2, rel=0.2)
    assert np.abs(y["gyro"][:, :2]).max() == pytest.approx(0.02 * (speed / 434.27) ** 2, rel=0.01)
    assert np.array_equal(y["accel"][:, 2], np.zeros(samples))


def test_blades_shake_along_the_rotor_axis_twice_per_turn() -> None:
    samples = 5000
    native = model(seed=5, vibration_accel=0.0, vibration_blade=1.0, vibration_gyro=0.0, **of_sensor(Imu()))
    speeds = np.tile([200.0, 0.0, 0.0, 0.0], (samples, 1))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1))
    y = run(native, 0.004, still, np.zeros((samples, 3)), np.zeros((samples, 3)), rotor_speed=speeds)
    frequency, amplitude = spectrum(y["accel"][:, 2], 0.004)
    assert frequency[np.argmax(amplitude)] == pytest.approx(400.0, abs=0.5)


def test_a_slow_magnetometer_holds_its_reading_and_says_so() -> None:
    q, rate, force = motion(500, 0.004)
    y = run(model(mag_rate=25.0), 0.004, q, rate, force)
    valid = y["mag_valid"].ravel().astype(bool)
    assert np.array_equal(np.flatnonzero(valid), np.arange(0, 500, 10))
    assert np.array_equal(y["mag"][1:][~valid[1:]], y["mag"][:-1][~valid[1:]])
    assert y["accel_valid"].all()


@pytest.mark.parametrize("dt", [0.0, -0.01, np.nan, np.inf])
def test_a_step_that_is_no_time_takes_no_sample(dt: float) -> None:
    native = model()
    native.update(0.004)
    before = native.save()
    native.update(dt)
    assert native.save() == before


@pytest.mark.parametrize("broken", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("name", ["q", "rate", "force", "rotor_speed"])
def test_truth_that_cannot_be_is_forgotten(name: str, broken: float) -> None:
    rows = 60
    q, rate, force = motion(rows, 0.004)
    inputs = {"q": q, "rate": rate, "force": force, "rotor_speed": np.full((rows, 4), 430.0)}
    whole = run(model(), 0.004, **inputs)
    inputs[name] = inputs[name].copy()
    inputs[name][20:23] = broken
    hurt = run(model(), 0.004, **inputs)
    assert all(np.isfinite(column).all() for column in hurt.values())
    # The vibration goes on from another angle after rotor speeds that were held.
    tolerance = {"gyro": 0.01, "accel": 0.01, "mag": 1e-6} if name != "rotor_speed" else {"mag": 0.0}
    for triad, limit in tolerance.items():
        assert np.abs(hurt[triad] - whole[triad])[40:].max() <= limit


def test_states_saved_and_restored_give_the_same_samples() -> None:
    q, rate, force = motion(200, 0.004)
    native = model(**of_sensor(everything()))
    run(native, 0.004, q[:100], rate[:100], force[:100])
    kept = native.save()
    first = run(native, 0.004, q[100:], rate[100:], force[100:])
    native.restore(kept)
    second = run(native, 0.004, q[100:], rate[100:], force[100:])
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_single_precision_has_the_noise_of_double() -> None:
    single, double = (at_rest(model(p), 500, 0.004) for p in ("single", "double"))
    assert np.abs(single["gyro"] - double["gyro"]).max() <= 1.1e-3
    assert np.abs(single["accel"] - double["accel"]).max() <= 5e-3
