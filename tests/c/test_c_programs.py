"""The C tests, built from the sources that are shipped: plainly, and under the tools that watch them run."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from ahrs_fmu import descriptors, toolchain
from ahrs_fmu.export.source_code import fmi_headers, source_files
from ahrs_fmu.export.variant import Variant

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OWN_MEMORY = ["-Dcalloc=test_calloc", "-Dmalloc=test_malloc", "-Dfree=test_free"]
BASIC = ["-std=c99", "-g", "-ffp-contract=off", *(flag for flag in toolchain.FLAGS if flag.startswith("-W"))]
PRECISIONS = ["double", "single"]
Build = Callable[[Sequence[str], Sequence[str], str], Path]


@pytest.fixture
def build(tmp_path: Path) -> Build:
    """Compiles the test program, with both adapters, in a folder of its own."""

    def program(compiler: Sequence[str], options: Sequence[str], precision: str) -> Path:
        gcf = descriptors.load("gcf")
        sources = source_files(Variant(gcf, "2", precision)) | source_files(Variant(gcf, "3", precision))
        for name, text in sources.items():
            (tmp_path / name).write_text(text)
        for file in (*HERE.glob("test_*.c"), *HERE.glob("test_*.h")):
            own = '#include "fmu_config.h"\n' if file.suffix == ".c" else ""
            (tmp_path / file.name).write_text(own + file.read_text())
        # The test program includes the engine to wrap it.
        c_files = sorted(p.name for p in tmp_path.glob("*.c") if p.name != "engine_core.c")
        command = [*compiler, *BASIC, *OWN_MEMORY, *options, "-I.", "-isystem", str(fmi_headers()), *c_files]
        done = subprocess.run(
            [*command, "-o", "program", "-lm"],
            cwd=tmp_path,
            env=toolchain.environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return tmp_path / "program"

    return program


def run(*command: str | Path, folder: Path) -> None:
    done = subprocess.run([str(c) for c in command], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "all tests passed" in done.stdout


def needs(tool: str) -> str:
    path = shutil.which(tool)
    if path is None:
        pytest.skip(f"{tool} is not installed")
    return path


@pytest.mark.parametrize("precision", PRECISIONS)
def test_all_c_tests_pass(precision: str, build: Build) -> None:
    program = build([sys.executable, "-m", "ziglang", "cc"], ["-O1"], precision)
    run(program, folder=program.parent)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_all_c_tests_pass_under_the_address_and_undefined_behaviour_sanitizers(
    precision: str, build: Build
) -> None:
    options = ["-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    program = build([needs("gcc")], options, precision)
    run(program, folder=program.parent)


def test_all_c_tests_pass_under_valgrind_without_a_leak(build: Build) -> None:
    valgrind = needs("valgrind")
    program = build([needs("gcc")], ["-O1"], "double")
    run(valgrind, "-q", "--leak-check=full", "--error-exitcode=9", program, folder=program.parent)


def test_the_c_tests_reach_nearly_every_line(build: Build) -> None:
    gcov = needs("gcov")
    program = build([needs("gcc")], ["-O0", "--coverage"], "double")
    run(program, folder=program.parent)
    data = sorted(p.name for p in program.parent.glob("*.gcda"))
    subprocess.run([gcov, *data], cwd=program.parent, capture_output=True, check=True)
    texts: dict[str, str] = {}
    reached: set[str] = set()
    for report in sorted(program.parent.glob("*.gcov")):
        name = report.name.removesuffix(".gcov")
        if name.startswith("test_") or not (program.parent / name).is_file():
            continue
        for line in report.read_text().splitlines():
            if match := re.fullmatch(r"\s*(\d+\*?|#####):\s*(\d+):\s*(.*)", line):
                # An inline function appears once for each file that uses it.
                place = f"{name}:{match[2]}"
                texts[place] = match[3]
                if match[1] != "#####":
                    reached.add(place)
    missed = {place: text for place, text in texts.items() if place not in reached}
    share = len(reached) / len(texts)
    names = "\n".join(f"{place}: {text}" for place, text in missed.items())
    report_file = ROOT / "build" / "c_coverage.txt"
    report_file.write_text(f"{100 * share:.1f} % of {len(texts)} lines; not reached:\n{names}\n")
    assert len(texts) > 1000
    assert share >= 0.95, names
