"""FMUs whose model is a Python class: the bits of the class, and importers that survive it."""

from __future__ import annotations

import ctypes
import functools
import gc
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import numpy as np
import pytest
from host import ERROR, OK, Instance, Library
from numpy.typing import NDArray
from troublesome import DEEDS, Troublesome

from ahrs_fmu import descriptors
from ahrs_fmu.errors import BuildError, DescriptorError, ParameterError
from ahrs_fmu.estimators.model import FILTERS, NumpyModel
from ahrs_fmu.export.package import build_fmu, export_component
from ahrs_fmu.export.source_code import fmi_headers
from ahrs_fmu.export.validate import validate_fmu
from ahrs_fmu.serve.resources import load_class
from ahrs_fmu.toolchain import cache_folder

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")

HERE = Path(__file__).resolve().parent
PACKAGES = str(Path(descriptors.__file__).resolve().parents[1])
VARIANTS = ("2", "3", "3-scalar")
Rows = NDArray[np.float64]


@pytest.fixture(autouse=True)
def interpreter(monkeypatch: pytest.MonkeyPatch) -> None:
    """The children use this interpreter and this package, and the tests find them all gone."""
    monkeypatch.setenv("AHRS_FMU_PYTHON", sys.executable)
    monkeypatch.setenv("PYTHONPATH", PACKAGES)
    monkeypatch.delenv("AHRS_FMU_TIMEOUT", raising=False)


def children() -> set[int]:
    """Processes of this one that run or were not waited for."""
    pids = [
        int(pid)
        for task in Path("/proc/self/task").iterdir()
        for pid in (task / "children").read_text().split()
    ]
    # The command line of a process that was not waited for is empty.
    lines = {pid: Path(f"/proc/{pid}/cmdline").read_bytes() for pid in pids}
    return {pid for pid, line in lines.items() if not line or b"ahrs_fmu.serve" in line}


@pytest.fixture(autouse=True)
def no_child_is_left() -> Iterator[None]:
    before = children()
    yield
    assert children() - before == set()


@pytest.fixture(scope="session")
def of_model(build_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Library]:
    """The FMU of an estimator's numpy class."""
    loaded: dict[tuple[str, str], Library] = {}

    def library(model: str, fmi: str) -> Library:
        if (model, fmi) not in loaded:
            path = build_fmu(model, fmi=fmi, backend="python", output=build_folder)
            title = descriptors.load(model).title
            assert path == build_folder / "python" / f"fmi{fmi}" / f"{title}.fmu"
            loaded[model, fmi] = Library(path, tmp_path_factory.mktemp("a folder äöü%41"))
            loaded[model, fmi].path = path
        return loaded[model, fmi]

    return library


@pytest.fixture(scope="session")
def gcf(of_model: Callable[[str, str], Library]) -> Callable[[str], Library]:
    return functools.partial(of_model, "gcf")


@pytest.fixture(scope="session")
def trouble(build_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Library]:
    loaded: dict[str, Library] = {}

    def library(fmi: str) -> Library:
        if fmi not in loaded:
            path = build_folder / f"trouble{fmi}.fmu"
            export_component(HERE / "troublesome.py", "Troublesome", fmi=fmi, output=path)
            loaded[fmi] = Library(path, tmp_path_factory.mktemp("trouble"))
            loaded[fmi].path = path
        return loaded[fmi]

    return library


@pytest.fixture(params=["2", "3"])
def running(request: pytest.FixtureRequest, trouble: Callable[[str], Library]) -> Iterator[Instance]:
    instance = trouble(request.param).instance(logging=True).run(signal=[1.0, 2.0])
    yield instance
    instance.free()


def do(instance: Instance, deed: str) -> None:
    assert instance.set("deed", DEEDS.index(deed)) == OK


def numpy_attitudes(rows: Rows, name: str = "gcf") -> Rows:
    """What the numpy class gives in this process, row by row."""
    model = NumpyModel(descriptors.load(name))
    found = []
    for k, row in enumerate(rows):
        for name, columns in (("gyro", row[:3]), ("accel", row[3:6]), ("mag", row[6:])):
            model.set(name, columns)
        model.update(0.01 if k else 0.0)
        found.append(model.get("q"))
    return np.array(found)


def begin(library: Library, row: Rows, **parameters: object) -> Instance:
    return library.instance().run(gyro=row[:3], accel=row[3:6], mag=row[6:], **parameters)


def set_row(instance: Instance, row: Rows) -> None:
    for name, columns in (("gyro", row[:3]), ("accel", row[3:6]), ("mag", row[6:])):
        assert instance.set(name, columns) == OK


# ---------------------------------------------------------------- the same bits


@pytest.mark.parametrize("fmi", VARIANTS)
def test_the_fmu_gives_the_bits_of_the_numpy_class(
    fmi: str, gcf: Callable[[str], Library], rows: Rows
) -> None:
    instance = begin(gcf(fmi), rows[0])
    found = [instance.get("q")]
    for k, row in enumerate(rows[1:200]):
        set_row(instance, row)
        assert instance.step(k * 0.01, 0.01) == OK
        found.append(instance.get("q"))
    instance.free()
    np.testing.assert_array_equal(found, numpy_attitudes(rows[:200]))


# Each FMU is compiled, and each child imports numpy: two estimators by default, all of them when slow.
ESTIMATORS = [
    pytest.param(name, marks=() if name in ("gcf", "mekf") else pytest.mark.slow) for name in sorted(FILTERS)
]


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("model", ESTIMATORS)
def test_fmpy_gets_the_bits_of_the_numpy_class(
    model: str, fmi: str, of_model: Callable[[str, str], Library], rows: Rows
) -> None:
    n = 100
    scalars = [(f"{name}[{i}]", np.float64) for name in ("gyro", "accel", "mag") for i in (1, 2, 3)]
    arrays = [(name, np.float64, (3,)) for name in ("gyro", "accel", "mag")]
    signals = np.zeros(n, dtype=[("time", np.float64), *(scalars if fmi == "2" else arrays)])
    signals["time"] = np.arange(n) * 0.01
    for i, (name, *_) in enumerate(scalars if fmi == "2" else arrays):
        signals[name] = rows[:n, i] if fmi == "2" else rows[:n, 3 * i : 3 * i + 3]
    names = [f"q[{i}]" for i in (1, 2, 3, 4)] if fmi == "2" else ["q"]
    result = fmpy.simulate_fmu(
        str(of_model(model, fmi).path),
        input=signals,
        output=names,
        stop_time=(n - 1) * 0.01,
        step_size=0.01,
        output_interval=0.01,
    )
    q = np.stack([result[name] for name in names], axis=-1).reshape(len(result), 4)
    # FMPy sets the inputs of time t and then steps from t: the row of the initialisation counts twice.
    delayed = rows[[0, *range(n - 1)]]
    np.testing.assert_array_equal(q, numpy_attitudes(delayed, model)[: len(q)])


@pytest.fixture(scope="session")
def c_host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program in C that runs an FMU."""
    program = tmp_path_factory.mktemp("host") / "host"
    source = HERE.parent / "c" / "python_host.c"
    zig = str(cache_folder() / "zig")
    command = [sys.executable, "-m", "ziglang", "cc", "-O1", "-g", f"-isystem{fmi_headers()}", str(source)]
    subprocess.run(
        [*command, "-o", str(program), "-ldl"],
        check=True,
        env={**os.environ, "ZIG_GLOBAL_CACHE_DIR": zig, "ZIG_LOCAL_CACHE_DIR": zig},
    )
    return program


def host_command(program: Path, library: Library, rows: Rows, folder: Path) -> list[str]:
    (folder / "rows").write_bytes(np.ascontiguousarray(rows).tobytes())
    version = str(library.version)
    paths = [str(folder / "rows"), str(folder / "q")]
    return [
        str(program),
        str(library.binary),
        version,
        library.token,
        library.resources.decode(),
        "0.01",
        *paths,
    ]


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("model", ESTIMATORS)
def test_a_host_in_c_gets_the_bits_of_the_numpy_class(
    model: str, fmi: str, of_model: Callable[[str, str], Library], c_host: Path, rows: Rows, tmp_path: Path
) -> None:
    command = host_command(c_host, of_model(model, fmi), rows[:200], tmp_path)
    subprocess.run(command, check=True, timeout=120)
    q = np.fromfile(tmp_path / "q").reshape(-1, 4)
    np.testing.assert_array_equal(q, numpy_attitudes(rows[:200], model))


def test_valgrind_finds_nothing_in_the_library(
    gcf: Callable[[str], Library], c_host: Path, rows: Rows, tmp_path: Path
) -> None:
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    command = host_command(c_host, gcf("3"), rows[:20], tmp_path)
    checks = ["--quiet", "--leak-check=full", "--track-fds=yes", "--error-exitcode=99"]
    done = subprocess.run(
        ["valgrind", *checks, *command], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert "definitely lost" not in done.stderr


def test_several_ticks_in_a_step_are_one_message(gcf: Callable[[str], Library], rows: Rows) -> None:
    instance = begin(gcf("3"), rows[0])
    for k in range(20):
        set_row(instance, rows[k])
        assert instance.step(k * 0.07, 0.07) == OK
    order = np.repeat(np.arange(20), 7)
    expected = numpy_attitudes(rows[[0, *order]])
    np.testing.assert_array_equal(instance.get("q"), expected[-1])
    child = next(iter(children()))
    before = reads(child)
    assert instance.step(1.4, 1.0) == OK
    instance.get("q")
    assert reads(child) - before <= 3
    instance.free()


def reads(pid: int) -> int:
    """Reads that a process has made."""
    counts = dict(line.split(": ") for line in Path(f"/proc/{pid}/io").read_text().splitlines())
    return int(counts["syscr"])


def test_a_tuned_parameter_reaches_the_class(gcf: Callable[[str], Library], rows: Rows) -> None:
    instance = begin(gcf("2"), rows[0])
    model = NumpyModel(descriptors.load("gcf"))
    for name, columns in (("gyro", rows[0, :3]), ("accel", rows[0, 3:6]), ("mag", rows[0, 6:])):
        model.set(name, columns)
    model.update(0.0)
    for k in range(10):
        if k == 5:
            assert instance.set("kp", 2.0) == OK
            model.set("kp", 2.0)
        assert instance.step(k * 0.01, 0.01) == OK
        model.update(0.01)
        for output in descriptors.load("gcf").outputs:
            np.testing.assert_array_equal(
                instance.get(output.name), model.get(output.name), err_msg=output.name
            )
    instance.free()


def test_a_class_of_the_user_gives_the_same_bits_behind_the_fmu(trouble: Callable[[str], Library]) -> None:
    here = Troublesome()
    here.signal = [1.0, 2.0]
    here.gain = 3.0
    here.initialise()
    for fmi in VARIANTS:
        instance = trouble(fmi).instance().run(signal=[1.0, 2.0], gain=3.0)
        if fmi == "2":
            for _ in range(25):
                here.update(0.01)
        assert instance.step(0.0, 0.25) == OK
        np.testing.assert_array_equal(instance.get("total"), here.total)
        assert [instance.get(n)[0] for n in ("count", "odd", "shape")] == [25, 1, 1]
        instance.free()


# ---------------------------------------------------------------- states


@pytest.mark.parametrize("through_bytes", [False, True])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_a_restored_state_goes_on_with_the_same_bits(
    fmi: str,
    through_bytes: bool,
    gcf: Callable[[str], Library],
    trouble: Callable[[str], Library],
    rows: Rows,
) -> None:
    for library, output in ((gcf(fmi), "q"), (trouble(fmi), "total")):
        values = {"gyro": rows[0, :3], "accel": rows[0, 3:6]} if output == "q" else {"signal": [1.0, 2.0]}
        instance = library.instance().run(**values)
        assert instance.step(0.0, 0.05) == OK
        saved = instance.serialise() if through_bytes else instance.save()
        at_save = instance.get(output)
        assert instance.step(0.05, 0.05) == OK
        later = instance.get(output)
        if through_bytes:
            instance.free()
            instance = library.instance("another")
            status, saved = instance.deserialise(saved)
            assert status == OK
        assert instance.restore(saved) == OK
        np.testing.assert_array_equal(instance.get(output), at_save)
        assert instance.step(0.05, 0.05) == OK
        np.testing.assert_array_equal(instance.get(output), later)
        assert instance.free_state(saved) == OK
        instance.free()


def test_a_reset_instance_is_a_fresh_one(running: Instance) -> None:
    first = [running.get("total")]
    assert running.step(0.0, 0.05) == OK
    first.append(running.get("total"))
    assert running.call("Reset") == OK
    fresh = running.library.instance()
    assert running.serialise() == fresh.serialise()
    fresh.free()
    running.run(signal=[1.0, 2.0])
    second = [running.get("total")]
    assert running.step(0.0, 0.05) == OK
    second.append(running.get("total"))
    np.testing.assert_array_equal(first, second)


def test_a_state_can_be_restored_after_the_child_has_died(running: Instance) -> None:
    assert running.step(0.0, 0.05) == OK
    saved, at_save = running.save(), running.get("total")
    do(running, "exit")
    assert running.step(0.05, 0.01) == ERROR
    assert running.restore(saved) == OK
    np.testing.assert_array_equal(running.get("total"), at_save)
    assert running.step(0.05, 0.01) == OK
    assert running.free_state(saved) == OK


# ---------------------------------------------------------------- a class that misbehaves


@pytest.mark.parametrize(
    ("deed", "said"),
    [
        ("raise", ["RuntimeError: the gyroscope has fallen off", 'troublesome.py", line', "do_raise"]),
        ("leave", ["SystemExit: enough"]),
        ("new_attribute", ["'totl', which is neither declared nor set in initialise"]),
        ("wrong_size", ["total has 2 elements; 3 are given"]),
        ("recurse", ["RecursionError"]),
        ("flood_and_raise", ["zzzz"]),
    ],
)
def test_an_exception_is_an_error_with_its_traceback_and_the_instance_goes_on(
    deed: str, said: list[str], running: Instance
) -> None:
    do(running, deed)
    assert running.step(0.0, 0.01) == ERROR
    line = running.log[-1]
    assert line.category == "logStatusError"
    assert all(text in line.message for text in said), line.message
    assert "ahrs_fmu/serve/__main__" not in line.message
    do(running, "behave")
    assert running.call("Reset") == OK
    running.run(signal=[1.0, 2.0])
    assert running.step(0.0, 0.01) == OK


@pytest.mark.parametrize(
    ("deed", "said"),
    [
        ("exit", "ended with exit code 7"),
        ("kill", "was ended by signal 9"),
        ("hang", "did not answer within 2 s (set AHRS_FMU_TIMEOUT for more)"),
        ("partial", "did not answer within 2 s"),
        ("garbage", "answered with bytes that are no message"),
    ],
)
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_a_child_that_is_lost_is_an_error_and_a_reset_starts_another(
    deed: str, said: str, fmi: str, trouble: Callable[[str], Library], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AHRS_FMU_TIMEOUT", "2")
    before = children()
    instance = trouble(fmi).instance(logging=True).run()
    first = children() - before
    do(instance, deed)
    assert instance.step(0.0, 0.01) == ERROR
    assert said in instance.log[-1].message
    assert children() & first == set()
    assert instance.step(0.0, 0.01) == ERROR
    assert "has ended; reset the instance" in instance.log[-1].message
    assert instance.call("Reset") == OK
    instance.run()
    assert instance.step(0.0, 0.01) == OK
    instance.free()


def test_what_the_class_prints_is_in_the_log_and_harms_nothing(running: Instance) -> None:
    do(running, "print")
    assert running.step(0.0, 0.01) == OK
    printed = [line for line in running.log if line.category == "logEvents" and "printed" in line.message]
    assert len(printed) == 1
    assert "hello from Python\nno newline straight to the descriptor" in printed[0].message
    do(running, "chatter")
    assert running.step(0.01, 0.01) == OK
    assert running.log[-1].message.endswith("last words\n")
    assert "printed 2621451 bytes, of which the last" in running.log[-1].message
    do(running, "behave")
    assert running.step(0.02, 0.01) == OK


def test_limits_of_a_class_are_checked_before_the_child_hears_of_them(running: Instance) -> None:
    assert running.set("gain", 11.0) == ERROR
    assert running.set("gain", 9.5) == OK
    assert running.step(0.0, 0.01) == OK
    assert running.call("Reset") == OK
    assert running.set("gain", 9.5) == OK
    assert running.set("steps", 2) == OK
    assert running.start() == OK
    assert running.call("ExitInitializationMode") == ERROR
    assert 'a "large" gain goes with one step: lower \\ it' in running.log[-1].message


# ---------------------------------------------------------------- starting


def refusal(library: Library) -> str:
    with pytest.raises(ValueError, match="Instantiate") as caught:
        library.instance()
    return str(caught.value.args[0][-1].message)


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_an_interpreter_that_is_missing_is_named(
    fmi: str, gcf: Callable[[str], Library], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AHRS_FMU_PYTHON", "/nowhere/python")
    message = refusal(gcf(fmi))
    assert "/nowhere/python" in message
    assert "set AHRS_FMU_PYTHON" in message or "AHRS_FMU_PYTHON names another one" in message


def test_an_interpreter_without_the_package_is_named_with_what_it_said(
    gcf: Callable[[str], Library], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['ahrs_fmu'] = None\n")
    message = refusal(gcf("3"))
    assert sys.executable in message
    assert "needs the package ahrs-fmu" in message
    assert "ahrs_fmu" in message.partition("last it printed")[2]


def test_without_the_variable_the_interpreter_of_the_export_is_used(
    gcf: Callable[[str], Library], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("AHRS_FMU_PYTHON")
    monkeypatch.setenv("PATH", "/nowhere")
    gcf("2").instance().free()
    recorded = gcf("2").folder / "resources" / "python.txt"
    text = recorded.read_text()
    recorded.write_text("/nowhere/else/python\n")
    try:
        assert "'python3' (from PATH" in refusal(gcf("2"))
    finally:
        recorded.write_text(text)


def test_a_module_that_cannot_be_imported_is_an_error_with_its_traceback(
    trouble: Callable[[str], Library],
) -> None:
    library = trouble("3")
    module = library.folder / "resources" / "troublesome.py"
    text = module.read_text()
    try:
        module.write_text("import no_such_module\n" + text)
        assert "ModuleNotFoundError: No module named 'no_such_module'" in refusal(library)
        module.write_text(text.replace("    odd = Output(False", "    even = Output(False"))
        assert "other variables than when the FMU was built" in refusal(library)
        module.unlink()
        assert "troublesome.py" in refusal(library)
    finally:
        module.write_text(text)


def test_an_importer_that_names_no_resources_is_told(gcf: Callable[[str], Library]) -> None:
    library = gcf("3")
    resources = library.resources
    library.resources = b""
    try:
        assert "does not say where the FMU's resources are" in refusal(library)
    finally:
        library.resources = resources


# ---------------------------------------------------------------- many, and the end


def descriptors_open() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_instances_made_and_freed_leave_no_descriptor_behind(
    gcf: Callable[[str], Library], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The child here only answers: 50 times Python with numpy would take a minute."""
    stand_in = tmp_path / "ahrs_fmu" / "serve"
    stand_in.mkdir(parents=True)
    (tmp_path / "ahrs_fmu" / "__init__.py").touch()
    (stand_in / "__init__.py").touch()
    (stand_in / "__main__.py").write_text(
        "import os, struct\n"
        "while os.read(0, 1000):\n"
        "    os.write(0, struct.pack('<IIQ', 0x53524841, 100, 0))\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    library = gcf("3")
    library.instance().free()
    gc.collect()
    before = descriptors_open()
    for _ in range(50):
        library.instance().free()
    gc.collect()
    assert descriptors_open() == before
    assert children() == set()


def test_ten_instances_run_at_once_in_threads(trouble: Callable[[str], Library]) -> None:
    library = trouble("3")
    totals: dict[int, Rows] = {}

    def work(number: int) -> None:
        instance = library.instance(f"number {number}").run(signal=[number, 1.0])
        for k in range(20):
            assert instance.step(k * 0.01, 0.01) == OK
        totals[number] = instance.get("total")
        instance.free()

    threads = [threading.Thread(target=work, args=(number,)) for number in range(10)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(totals) == list(range(10))
    for number in range(10):
        np.testing.assert_allclose(totals[number] - totals[0], [0.2 * number, 0.0], atol=1e-12)


def test_a_child_ends_with_its_importer_even_in_an_endless_update(
    trouble: Callable[[str], Library], tmp_path: Path
) -> None:
    script = tmp_path / "importer.py"
    script.write_text(
        "import sys, pathlib\n"
        f"sys.path.insert(0, {str(HERE)!r})\n"
        "from host import Library\n"
        "from troublesome import DEEDS\n"
        f"fmu, folder = {str(trouble('3').path)!r}, {str(tmp_path / 'fmu')!r}\n"
        "library = Library(pathlib.Path(fmu), pathlib.Path(folder))\n"
        "instance = library.instance().run()\n"
        "instance.set('deed', DEEDS.index('hang'))\n"
        "print('hanging', flush=True)\n"
        "instance.step(0.0, 0.01)\n"
    )
    importer = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert importer.stdout.readline() == "hanging\n"
    time.sleep(0.2)
    found = Path(f"/proc/{importer.pid}/task/{importer.pid}/children").read_text()
    (child,) = (int(pid) for pid in found.split())
    importer.send_signal(signal.SIGKILL)
    importer.wait()
    importer.stdout.close()
    deadline = time.monotonic() + 20.0
    while Path(f"/proc/{child}").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f"/proc/{child}").exists()


# ---------------------------------------------------------------- files


@pytest.mark.parametrize("fmi", VARIANTS)
def test_the_files_have_no_problem(
    fmi: str, gcf: Callable[[str], Library], trouble: Callable[[str], Library]
) -> None:
    assert validate_fmu(gcf(fmi).path) == []
    assert validate_fmu(trouble(fmi).path) == []
    assert 'needsExecutionTool="true"' in (gcf(fmi).folder / "modelDescription.xml").read_text()


def test_variables_are_those_of_the_compiled_fmu_and_the_token_is_another(
    gcf: Callable[[str], Library], load: Callable[..., Library]
) -> None:
    for fmi in VARIANTS:
        compiled, python = load(fmi), gcf(fmi)
        assert python.variables == compiled.variables
        assert python.token != compiled.token


def test_the_windows_library_compiles(build_folder: Path) -> None:
    path = build_fmu(
        "gcf", fmi="3", backend="python", platforms=["x86_64-windows"], output=build_folder / "windows"
    )
    assert validate_fmu(path) == []


def test_single_precision_is_refused(build_folder: Path) -> None:
    with pytest.raises(BuildError, match="double precision"):
        build_fmu("gcf", fmi="3", backend="python", precision="single", output=build_folder)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("y = Output(unt='m')", "unt"),
        ("double = Output()", "no word of C"),
        ("y = Output(unit='m'); k = Parameter(5.0, max=1.0)", "k = 5 is refused"),
        ("y = Output(); limits = (Limit('gain < 1', ''),)", "unknown parameter 'gain'"),
        ("x = Input()", "declares no Output"),
        ("y = Output(); k = Parameter('a', choices={'b': ''})", "k = 'a' is not one of b"),
        ("y = Output(); k = Parameter('a')", "is not a number"),
    ],
)
def test_a_wrong_declaration_is_refused(body: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / f"wrong_{re.sub(r'[^a-z]', '', body)}.py"
    lines = "\n".join(f"    {line}" for line in body.split("; "))
    path.write_text(
        "from ahrs_fmu.component import *\nfrom ahrs_fmu.component import Limit\n"
        f"class Wrong(Component):\n{lines}\n    def update(self, dt): pass\n"
    )
    with pytest.raises((DescriptorError, TypeError), match=re.escape(message)):
        export_component(path, "Wrong", fmi="3", output=tmp_path / "wrong.fmu")
    sys.modules.pop(path.stem, None)


def test_a_file_without_the_class_is_refused() -> None:
    with pytest.raises(DescriptorError, match="no class Missing"):
        load_class(HERE / "troublesome.py", "Missing")


def test_values_of_a_class_are_checked_when_they_are_set() -> None:
    model = Troublesome()
    with pytest.raises(ParameterError, match="gain = 11 is refused"):
        model.gain = 11.0
    with pytest.raises(ParameterError, match="is not one of"):
        model.deed = "fly"
    with pytest.raises(ParameterError, match="signal has 2 elements"):
        model.signal = 1.0
    assert model.gain == 1.0


def test_the_example_of_the_documentation_works(tmp_path: Path) -> None:
    page = (HERE.parents[1] / "docs" / "python-fmu.md").read_text()
    example = re.search(r"```python\n(.*?)```", page, re.DOTALL)
    assert example is not None
    (tmp_path / "my_filter.py").write_text(example[1])
    path = export_component(tmp_path / "my_filter.py", "MyFilter", fmi="3", output=tmp_path / "MyFilter.fmu")
    assert validate_fmu(path) == []
    instance = (
        Library(path, tmp_path / "unpacked").instance().run(gyro=[0.1, 0.0, 0.0], accel=[0.0, 0.0, -9.81])
    )
    for k in range(100):
        assert instance.step(k * 0.01, 0.01) == OK
    # The accelerometer says 0 and the gyroscope 0.1 rad/s: the roll angle nears 0.1 / crossover.
    expected = 0.1 / 0.5 * (1.0 - (1.0 - 0.5 * 0.01) ** 100)
    np.testing.assert_allclose(instance.get("roll"), expected, rtol=1e-9)
    instance.free()
    del sys.modules["my_filter"]


def test_a_closed_standard_input_of_the_importer_does_no_harm(
    gcf: Callable[[str], Library], c_host: Path, rows: Rows, tmp_path: Path
) -> None:
    command = host_command(c_host, gcf("2"), rows[:5], tmp_path)
    script = " ".join(f"'{word}'" for word in command) + " <&- >&-"
    subprocess.run(["sh", "-c", script], check=True, timeout=60)
    np.testing.assert_array_equal(np.fromfile(tmp_path / "q").reshape(-1, 4), numpy_attitudes(rows[:5]))
    assert ctypes.sizeof(ctypes.c_void_p) == 8
