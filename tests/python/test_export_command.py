"""``ahrs-fmu export``: a class of the user from the command line, and what people do wrong."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import fmpy
import numpy as np
import pytest

from ahrs_fmu.cli import main
from ahrs_fmu.component import Component
from ahrs_fmu.serve.resources import load_class

PAGE = Path(__file__).resolve().parents[2] / "docs" / "python-fmu.md"

FILES = {
    "plain.py": "class Plain:\n    pass\n",
    "needs.py": "\nimport no_such_module\n",
    "raises.py": "def read():\n    raise RuntimeError('calibration is missing')\nread()\n",
    "leaves.py": "import sys\nsys.exit('not here')\n",
    "syntax.py": "class A(:\n    pass\n",
    "silent.py": "from ahrs_fmu.component import Component\n"
    "class Silent(Component):\n    def update(self, dt): pass\n",
    "idle.py": "from ahrs_fmu.component import Component, Output\nclass Idle(Component):\n    y = Output()\n",
    "typo.py": "from ahrs_fmu.component import Component, Output\n"
    "class Typo(Component):\n    y = Output(unt='m')\n    def update(self, dt): pass\n",
    "unit.py": "from ahrs_fmu.component import Component, Output\n"
    "class Unit(Component):\n    y = Output(unit='furlong')\n    def update(self, dt): pass\n",
    "notes.txt": "no Python\n",
}


@pytest.fixture(autouse=True)
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with the example of the documentation and some files that are none."""
    example = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert example is not None
    for name, text in (FILES | {"my_filter.py": example[1]}).items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("AHRS_FMU_PYTHON", sys.executable)
    yield tmp_path
    for name in FILES:
        sys.modules.pop(Path(name).stem, None)
    sys.modules.pop("my_filter", None)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.py:Missing"], "none.py: No such file or directory"),
        (["plain.py:Plain"], "plain.py has no class Plain derived from ahrs_fmu.component.Component"),
        (["my_filter.py:Filter"], "my_filter.py has no class Filter derived from .*; it has MyFilter"),
        (["needs.py:X"], "needs.py cannot be imported: line 2: ModuleNotFoundError: No module named"),
        (["raises.py:X"], "raises.py cannot be imported: line 2: RuntimeError: calibration is missing"),
        (["leaves.py:X"], "leaves.py cannot be imported: line 2: SystemExit: not here"),
        (["syntax.py:A"], "syntax.py cannot be imported: line 1: SyntaxError: invalid syntax"),
        (["silent.py:Silent"], "Silent declares no Output"),
        (["idle.py:Idle"], r"Idle does not define update\(self, dt\)"),
        (["typo.py:Typo"], "typo.py cannot be imported: line 3: TypeError: .* keyword argument 'unt'"),
        (["unit.py:Unit"], "furlong"),
        (["notes.txt:X"], "notes.txt is no Python file"),
        (["my_filter.py"], "'my_filter.py' is not of the form FILE:CLASS, such as my_filter.py:MyFilter"),
        ([":MyFilter"], "is not of the form FILE:CLASS"),
        ([], "Missing argument 'FILE:CLASS'"),
        (["my_filter.py:MyFilter", "-o", "MyFilter"], "'MyFilter': the name of an FMU ends with .fmu"),
        (["my_filter.py:MyFilter", "--fmi", "1"], "'1' is not one of"),
        (["my_filter.py:MyFilter", "--platforms", "mars"], "unknown platform 'mars'"),
    ],
)
def test_what_cannot_be_exported_is_one_line_and_exit_code_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str], workplace: Path
) -> None:
    assert main(["export", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("ahrs-fmu: ")
    assert re.search(message, line), line
    assert not list(workplace.rglob("*.fmu"))


def test_the_documented_example_is_thirty_lines_at_most() -> None:
    assert len(Path("my_filter.py").read_text().strip().splitlines()) <= 30


@pytest.mark.parametrize(("fmi", "output"), [("2", "mine/my.fmu"), ("3", None)])
def test_the_documented_example_gives_the_bits_of_its_class_in_an_importer(
    fmi: str, output: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--fmi", fmi, *(["-o", output] if output else [])]
    assert main(["export", "my_filter.py:MyFilter", *options]) == 0
    path = output or "MyFilter.fmu"
    said = capsys.readouterr().out
    assert f"{path}: " in said
    assert sys.executable in said
    assert main(["validate", path]) == 0

    cls = load_class(Path("my_filter.py"), "MyFilter")
    accel = [0.5, -1.5, -9.5]
    names = {"gyro[1]": 0.1, "accel[1]": accel[0], "accel[2]": accel[1], "accel[3]": accel[2]}
    start = names if fmi == "2" else {"gyro": "0.1 0 0", "accel": " ".join(map(str, accel))}
    result = fmpy.simulate_fmu(
        path, start_values=start | {"crossover": 2.0}, stop_time=1.0, step_size=0.01, output_interval=0.01
    )
    np.testing.assert_array_equal(result["roll"], run(cls, accel, len(result)))


def run(cls: type[Component], accel: list[float], samples: int) -> list[float]:
    """The class in this process."""
    filter_ = cls()
    filter_.crossover, filter_.gyro, filter_.accel = 2.0, [0.1, 0.0, 0.0], accel
    filter_.initialise()
    rolls = [filter_.roll]
    for _ in range(samples - 1):
        filter_.update(0.01)
        rolls.append(filter_.roll)
    return rolls
