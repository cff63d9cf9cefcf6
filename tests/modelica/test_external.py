"""The C glue of AHRSExternal, called as a Modelica tool calls it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from modelica_libraries import MODELICA, parsed
from numpy.typing import NDArray

from ahrs_fmu import descriptors, quaternion
from ahrs_fmu.native import NativeModel
from ahrs_fmu.toolchain import compile_library, host_platform, suffix

Array = NDArray[np.float64]
Run = Callable[..., Array]

HERE = Path(__file__).parent / "external"
DT = 0.01
ESTIMATORS = [name for name in descriptors.names() if descriptors.load(name).interface is not None]


@pytest.fixture(scope="session")
def host(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """Two translation units that include the amalgamated header, warnings as errors."""
    library = compile_library(
        [HERE / "host.c", HERE / "elsewhere.c"],
        tmp_path_factory.mktemp("external") / f"host{suffix(host_platform())}",
        include=[HERE, MODELICA / "AHRSExternal" / "Resources" / "Include"],
        hide_symbols=False,
    )
    loaded = ctypes.CDLL(str(library))
    loaded.last_error.restype = ctypes.c_char_p
    return loaded


@pytest.fixture
def run(host: ctypes.CDLL) -> Run:
    """Attitude, rate, bias and status after each row of samples."""

    def call(kind: str, samples: Array, parameters: Mapping[str, float]) -> Array:
        results = np.zeros((len(samples), 11))
        names = (ctypes.c_char_p * len(parameters))(*(name.encode() for name in parameters))
        values = (ctypes.c_double * len(parameters))(*parameters.values())
        failed = host.run(
            kind.encode(),
            names,
            len(parameters),
            values,
            len(samples),
            ctypes.c_double(DT),
            np.ascontiguousarray(samples).ctypes.data_as(ctypes.c_void_p),
            results.ctypes.data_as(ctypes.c_void_p),
        )
        if failed:
            raise RuntimeError(host.last_error().decode())
        return results

    return call


def samples(rows: int) -> Array:
    """A swinging vehicle with noise, seeded; some samples are marked invalid."""
    random = np.random.default_rng(11)
    time = DT * np.arange(1, rows + 1)
    q = quaternion.from_euler(np.column_stack((0.8 * np.sin(2.0 * time), 0.5 * np.sin(1.3 * time), time)))
    back = quaternion.conjugate(q)
    gyro = np.vstack((np.zeros(3), quaternion.log(quaternion.multiply(back[:-1], q[1:])) / DT))
    accel, mag = quaternion.rotate(back, [0.0, 0.0, -9.8]), quaternion.rotate(back, [2e-5, 0.0, 4e-5])
    sensors = [gyro, accel, mag] + np.array([1e-3, 0.02, 1e-7])[:, None, None] * random.standard_normal(
        (3, rows, 3)
    )
    valid = (random.uniform(size=(rows, 2)) > [0.1, 0.5]).astype(float)
    return np.hstack([*sensors, valid])


def in_core(kind: str, rows: Array, parameters: Mapping[str, float]) -> Array:
    model = NativeModel(descriptors.load(kind))
    for name, value in parameters.items():
        model.set(name, value)
    model.reset()
    inputs = {
        "gyro": rows[:, :3],
        "accel": rows[:, 3:6],
        "mag": rows[:, 6:9],
        "accel_valid": rows[:, 9].astype(np.int32),
        "mag_valid": rows[:, 10].astype(np.int32),
    }
    y = model.run(np.full(len(rows), DT), inputs, ["q", "rate", "gyro_bias", "status"])
    return np.column_stack([y["q"], y["rate"], y["gyro_bias"], y["status"]])


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_an_external_estimator_gives_the_bits_of_the_core(kind: str, run: Run) -> None:
    rows = samples(2000)
    ours = run(kind, rows, {})
    assert np.array_equal(ours, in_core(kind, rows, {}))
    assert np.ptp(ours[:, 1]) > 0.5


def test_parameters_reach_the_core(run: Run) -> None:
    rows = samples(500)
    parameters = {"sample_time": DT, "kp": 2.0, "ki": 0.5, "kii": 0.02, "bias_limit": 0.01}
    ours = run("gcf", rows, parameters)
    assert np.array_equal(ours, in_core("gcf", rows, parameters))
    assert not np.array_equal(ours, run("gcf", rows, {}))


def test_elements_of_arrays_and_items_of_enumerations_are_parameters_too(run: Run) -> None:
    start = {"initialisation": 1.0, "q0[1]": 0.8, "q0[4]": 0.6}
    first = run("gcf", samples(1), start)[0]
    assert first[:4] == pytest.approx([0.8, 0.0, 0.0, 0.6], abs=1e-15)


@pytest.mark.parametrize(
    ("kind", "parameters", "words"),
    [
        ("madgwick", {}, "there is no estimator 'madgwick'"),
        ("gcf", {"kd": 1.0}, "parameter kd = 1 is no parameter of this estimator"),
        ("gcf", {"kp": -1.0}, "parameter kp = -1 is outside its limits"),
        ("gcf", {"kp": float("nan")}, "is outside its limits"),
        ("gcf", {"q0[5]": 1.0}, "has no such element"),
        ("gcf", {"roll": 1.0}, "is no parameter of this estimator"),
        ("gcf", {"kp": 200.0}, "lower kp or sample_time"),
    ],
)
def test_what_is_wrong_is_told_to_the_tool(
    kind: str, parameters: dict[str, float], words: str, run: Run
) -> None:
    with pytest.raises(RuntimeError, match=words):
        run(kind, samples(1), parameters)


def test_pymoca_knows_the_external_object_and_the_blocks() -> None:
    known = {c.name: c for c in parsed()[1]}
    assert known["AHRSExternal.Instance"].bases == ("ExternalObject",)
    assert {"constructor", "destructor"} == {
        n.rpartition(".")[2] for n in known if n.startswith("AHRSExternal.Instance.")
    }
    assert {"AHRSExternal.step", "AHRSExternal.Estimator", "AHRSExternal.GCF"} <= known.keys()
