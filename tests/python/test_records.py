from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ahrs_fmu import extras, quaternion
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.errors import MissingExtraError, RecordError
from ahrs_fmu.frames import Frame
from ahrs_fmu.records import EXTENSIONS, Record, read, write

HEADER = (
    "time [s],gyro_x [rad/s],gyro_y [rad/s],gyro_z [rad/s],"
    "accel_x [m/s2],accel_y [m/s2],accel_z [m/s2],mag_x [uT],mag_y [uT],mag_z [uT]"
)
ROWS = [f"{k / 100},0.0,0.0,0.0,0.1,-0.2,-9.8,20,0,40" for k in range(5)]


@pytest.fixture(scope="module")
def flight() -> Record:
    return demo_flight(duration=8.0)


@pytest.fixture
def csv(tmp_path: Path) -> Callable[..., Path]:
    def make(*lines: str) -> Path:
        path = tmp_path / "log.csv"
        path.write_text("\n".join(lines) + "\n")
        return path

    return make


def with_cell(line: int, column: int, text: str) -> list[str]:
    rows = [row.split(",") for row in ROWS]
    rows[line][column] = text
    return [",".join(row) for row in rows]


def same(a: Record, b: Record, atol: float = 0.0) -> None:
    for name in ("time", "gyro", "accel", "mag", "accel_valid", "mag_valid", "q_true", "evaluate"):
        left, right = getattr(a, name), getattr(b, name)
        if left is None or right is None:
            assert left is right, name
        else:
            np.testing.assert_allclose(left, right, rtol=0.0, atol=atol, err_msg=name)


def test_a_record_refuses_arrays_of_the_wrong_shape() -> None:
    with pytest.raises(RecordError, match=r"accel has shape \(4, 3\); expected \(5, 3\)"):
        Record(np.arange(5.0), np.zeros((5, 3)), np.zeros((4, 3)))


def test_a_record_needs_two_samples() -> None:
    with pytest.raises(RecordError, match="N >= 2"):
        Record(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))


def test_a_record_copies_and_locks_what_it_is_given() -> None:
    gyro = np.zeros((5, 3))
    record = Record(np.arange(5.0), gyro, np.zeros((5, 3)))
    gyro[0] = 1.0
    assert record.gyro[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        record.gyro[0] = 1.0


def test_a_record_without_magnetometer_says_so() -> None:
    record = Record(np.arange(5.0), np.zeros((5, 3)), np.zeros((5, 3)))
    assert not record.has_mag
    assert np.isnan(record.mag).all()
    assert record.mag_valid.all()


def test_changing_the_frame_twice_gives_the_same_recording(flight: Record) -> None:
    enu = flight.in_frame(Frame.ENU)
    assert enu.accel[0, 2] > 9.0
    back = enu.in_frame(Frame.NED)
    np.testing.assert_array_equal(back.accel, flight.accel)
    assert flight.q_true is not None
    assert back.q_true is not None
    error = quaternion.multiply(back.q_true, quaternion.conjugate(flight.q_true))
    np.testing.assert_allclose(np.abs(error[:, 0]), 1.0, atol=1e-14)


def test_rows_cut_every_array(flight: Record) -> None:
    part = flight.rows(10, 20)
    assert len(part) == 10
    assert part.q_true is not None
    assert len(part.q_true) == 10


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_writing_and_reading_gives_the_same_bits(extension: str, flight: Record, tmp_path: Path) -> None:
    record = replace(flight.in_frame(Frame.ENU), name="there and back")
    gaps = record.mag.copy()
    gaps[3] = np.nan
    flags = np.arange(len(record)) % 7 != 0
    record = replace(record, mag=gaps, mag_valid=flags)
    path = tmp_path / f"flight{extension}"
    write(record, path)
    back = read(path)
    # Microtesla and back costs the last bit of the MAT layout.
    same(record, back, atol=1e-20 if extension == ".mat" else 0.0)
    assert back.frame is Frame.ENU
    assert back.name == ("flight" if extension == ".mat" else "there and back")


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_a_record_of_gyro_and_accelerometer_only_survives(
    extension: str, flight: Record, tmp_path: Path
) -> None:
    record = Record(flight.time, flight.gyro, flight.accel, frame=Frame.NED).in_frame(Frame.ENU)
    write(record, tmp_path / f"flight{extension}")
    same(record, read(tmp_path / f"flight{extension}"))


def test_irregular_time_survives_the_broad_layout(flight: Record, tmp_path: Path) -> None:
    time = flight.time + 1e-3 * np.sin(flight.time)
    write(replace(flight, time=time), tmp_path / "flight.mat")
    np.testing.assert_array_equal(read(tmp_path / "flight.mat").time, time)


def test_units_in_the_header_are_converted(csv: Callable[..., Path]) -> None:
    header = HEADER.replace("rad/s", "deg/s").replace("m/s2", "g").replace("[s]", "[ms]")
    rows = [f"{10 * k},90,0,0,0,0,-1,20,0,40" for k in range(3)]
    record = read(csv(header, *rows))
    np.testing.assert_allclose(record.gyro[0], [np.pi / 2, 0, 0])
    np.testing.assert_allclose(record.accel[0], [0, 0, -9.80665])
    np.testing.assert_allclose(record.mag[0], [20e-6, 0, 40e-6])
    np.testing.assert_allclose(record.time, [0.0, 0.01, 0.02])


def test_the_callers_unit_stands_above_the_header(csv: Callable[..., Path]) -> None:
    rows = [f"{k / 100},0,0,0,0,0,-1,20,0,40" for k in range(3)]
    np.testing.assert_allclose(read(csv(HEADER, *rows), units={"accel": "g"}).accel[0, 2], -9.80665)


def test_a_declared_unit_is_believed_even_when_it_looks_wrong(csv: Callable[..., Path]) -> None:
    rows = [f"{k / 100},0,0,0,0,0,-1,20,0,40" for k in range(3)]
    record = read(csv(HEADER, *rows), units={"accel": "m/s2"}, frame="ned")
    assert record.accel[0, 2] == -1.0


def test_a_header_without_units_means_si(csv: Callable[..., Path]) -> None:
    header = re.sub(r" \[.*?\]", "", HEADER).removesuffix(",mag_x,mag_y,mag_z")
    rows = [",".join(row.split(",")[:7]) for row in ROWS]
    assert read(csv(header, *rows)).accel[0, 2] == -9.8


@pytest.mark.parametrize(("signal", "factor", "unit"), [("accel", 1 / 9.80665, "g"), ("mag", 1e6, "uT"),
    ("mag", 1e4, "G"), ("mag", 1e9, "nT"), ("gyro", 180 / np.pi, "deg/s"), ("time", 1e3, "ms")])  # fmt: skip
def test_signals_in_another_unit_are_refused_and_the_message_says_how_to_declare_it(
    signal: str, factor: float, unit: str, flight: Record, tmp_path: Path
) -> None:
    write(replace(flight, **{signal: getattr(flight, signal) * factor}), tmp_path / "log.npz")
    with pytest.raises(RecordError, match=rf"{signal}.*apparently in {unit}.*--unit {signal}={unit}"):
        read(tmp_path / "log.npz")
    # What the message asks for is what makes the file readable.
    same(read(tmp_path / "log.npz", units={signal: unit}), flight, atol=1e-12)


@pytest.mark.parametrize("frame", [Frame.NED, Frame.ENU])
@pytest.mark.parametrize("truth", [True, False])
def test_the_frame_is_told_from_gravity_when_nobody_declares_it(
    frame: Frame, truth: bool, csv: Callable[..., Path], flight: Record
) -> None:
    record = flight.in_frame(frame)
    path = csv("placeholder")
    write(record if truth else replace(record, q_true=None), path)
    path.write_text("".join(path.read_text().splitlines(keepends=True)[1:]))
    assert read(path).frame is frame


def test_a_frame_that_cannot_be_told_must_be_declared(csv: Callable[..., Path]) -> None:
    on_its_side = [f"{k / 100},0,0,0,0,9.8,0,20,0,40" for k in range(3)]
    with pytest.raises(RecordError, match="declare frame 'ned' or 'enu'"):
        read(csv(HEADER, *on_its_side))
    assert read(csv(HEADER, *on_its_side), frame="enu").frame is Frame.ENU


def test_an_accelerometer_of_the_wrong_sign_is_refused_when_the_truth_is_known(
    flight: Record, tmp_path: Path
) -> None:
    write(replace(flight, accel=-flight.accel), tmp_path / "log.npz")
    with pytest.raises(RecordError, match="accel points down"):
        read(tmp_path / "log.npz")


def test_an_unknown_frame_or_unit_is_named(csv: Callable[..., Path]) -> None:
    path = csv(HEADER, *ROWS)
    with pytest.raises(RecordError, match="unknown frame 'nwu'; known are ned, enu"):
        read(path, frame="nwu")
    with pytest.raises(RecordError, match=r"accel cannot have the unit 'ft/s2'; known are m/s2"):
        read(path, units={"accel": "ft/s2"})
    with pytest.raises(RecordError, match="no unit can be declared for 'acc'"):
        read(path, units={"acc": "g"})


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "is empty"),
        (["# only a remark"], "is empty"),
        ([HEADER], "N >= 2"),
        ([HEADER, ROWS[0]], "N >= 2"),
        ([HEADER.replace("gyro_y", "other"), *ROWS], "column gyro_y is missing; found time, gyro_x"),
        ([HEADER.replace("gyro_", "gyr_"), *ROWS], r"gyro_x, gyro_y, gyro_z is missing; found time, gyr_x"),
        ([HEADER.replace("mag_z", "magz"), *ROWS], "column mag_z is missing"),
        ([HEADER.replace("gyro_y", "gyro_x"), *ROWS], "column gyro_x appears twice"),
        ([HEADER.replace("gyro_x [rad/s]", "gyro_x [deg/s]"), *ROWS], "gyro declare different units"),
        ([HEADER, *ROWS[:3], ROWS[3] + ",1", ROWS[4]], "line 5 has 11 cells; the header has 10"),
        ([HEADER, *ROWS[:3], "", *ROWS[3:]], "line 5 has 0 cells"),
        ([HEADER, *with_cell(2, 4, "abc")], "line 4: accel_x is 'abc', not a number"),
        ([HEADER, *with_cell(2, 0, "")], "line 4: time is nan"),
        ([HEADER, *with_cell(2, 0, "0.005")], r"line 4: time must increase, but 0.005 s comes after 0.01 s"),
        ([HEADER, *with_cell(2, 0, "0.01")], "line 4: time must increase"),
        (["# frame: up", HEADER, *ROWS], "unknown frame 'up'"),
        ([HEADER + ",accel_valid", *(row + ",2" for row in ROWS)], "accel_valid holds 2; it must be 0 or 1"),
    ],
)  # fmt: skip
def test_a_malformed_csv_is_refused_by_line_and_name(
    lines: list[str], message: str, csv: Callable[..., Path]
) -> None:
    with pytest.raises(RecordError, match=message) as caught:
        read(csv(*lines))
    assert str(caught.value).startswith("log.csv: ")
    assert "\n" not in str(caught.value)


def test_empty_cells_other_columns_and_other_separators_are_fine(csv: Callable[..., Path]) -> None:
    header = (HEADER + ",temperature,mag_valid").replace(",", ";")
    rows = [(row + ",warm,True").replace(",", ";") for row in with_cell(1, 7, "")]
    record = read(csv("# name: bench test", "", header, *rows, "", ""))
    assert np.isnan(record.mag[1, 0])
    assert record.mag[1, 1] == 0.0
    assert record.mag_valid.all()
    assert record.name == "bench test"


def test_a_byte_order_mark_is_no_part_of_the_header(tmp_path: Path) -> None:
    path = tmp_path / "excel.csv"
    path.write_text("\n".join([HEADER, *ROWS]), encoding="utf-8-sig")
    assert len(read(path)) == 5


def test_an_unknown_extension_names_the_known_ones(tmp_path: Path, flight: Record) -> None:
    for act in (read, lambda p: write(flight, p)):
        with pytest.raises(RecordError, match=r"'.xlsx'; known are .csv, .mat, .h5"):
            act(tmp_path / "log.xlsx")


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_a_missing_file_is_the_operating_systems_error(extension: str, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read(tmp_path / f"none{extension}")


@pytest.mark.parametrize("extension", [e for e in EXTENSIONS if e != ".csv"])
def test_a_file_without_gyro_is_refused(extension: str, flight: Record, tmp_path: Path) -> None:
    path = tmp_path / f"log{extension}"
    if extension == ".npz":
        np.savez(path, time=flight.time, accel=flight.accel)
    elif extension == ".mat":
        pytest.importorskip("scipy.io").savemat(path, {"imu_acc": flight.accel, "sampling_rate": 100.0})
    elif extension == ".parquet":
        arrow = pytest.importorskip("pyarrow")
        pytest.importorskip("pyarrow.parquet").write_table(arrow.table({"time": flight.time}), path)
    else:
        with pytest.importorskip("h5py").File(path, "w") as file:
            file["time"] = flight.time
            file["accel"] = flight.accel
    with pytest.raises(RecordError, match=r"gyro.* is missing|imu_gyr is missing"):
        read(path)


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_damaged_files_are_refused_as_such_and_never_crash(
    extension: str, flight: Record, tmp_path: Path
) -> None:
    path = tmp_path / f"log{extension}"
    write(flight.rows(0, 50), path)
    good = path.read_bytes()
    random = np.random.default_rng(5)
    damaged = [b"", b"\x00" * 200, random.bytes(500), good[: len(good) // 2], good[:20], good[10:]]
    # The HDF5 library itself may crash on flipped bits, which nothing above it can catch.
    for _ in range(0 if extension in (".h5", ".hdf5") else 60):
        flipped = bytearray(good)
        for position in random.integers(0, len(good), size=3):
            flipped[position] ^= 1 << int(random.integers(8))
        damaged.append(bytes(flipped))
    refused = 0
    for content in damaged:
        path.write_bytes(content)
        try:
            read(path)
        except RecordError:
            refused += 1
    assert refused >= 6


@pytest.mark.parametrize(("extension", "package"), [(".h5", "h5py"), (".parquet", "pyarrow")])
def test_a_format_whose_package_is_missing_names_the_extra(
    extension: str, package: str, flight: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(extras, "import_module", absent)
    with pytest.raises(MissingExtraError, match=rf"needs {package}: pip install 'ahrs-fmu\[records\]'"):
        write(flight, tmp_path / f"log{extension}")


def test_every_broad_recording_reads_with_units_and_frame(broad_dir: Path) -> None:
    paths = sorted(broad_dir.glob("*.mat"))
    assert paths
    for path in paths:
        record = read(path)
        assert record.frame is Frame.ENU
        assert record.sample_time == pytest.approx(0.0035)
        assert record.evaluate is not None
        assert record.evaluate.any()
        assert record.q_true is not None
        assert 20e-6 < np.nanmedian(np.linalg.norm(record.mag, axis=1)) < 80e-6


def test_steps_of_a_regular_record_are_equal_in_spite_of_rounding(flight: Record) -> None:
    time = 1e5 + np.arange(len(flight)) / 285.7
    record = replace(flight, time=time)
    assert record.is_regular
    assert set(np.diff(record.steps[1:])) == {0.0}
    assert record.sample_time == pytest.approx(1 / 285.7, rel=1e-9)


def test_steps_of_an_irregular_record_are_those_of_its_rows(flight: Record) -> None:
    time = flight.time + 1e-3 * np.sin(flight.time)
    record = replace(flight, time=time)
    assert not record.is_regular
    assert record.steps[0] == 0.0
    np.testing.assert_array_equal(record.steps[1:], np.diff(time))
