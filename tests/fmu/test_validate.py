"""The validation finds what importers trip over."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from ahrs_fmu.errors import BuildError
from ahrs_fmu.export.shared_library import read_binaries
from ahrs_fmu.export.validate import validate_fmu
from ahrs_fmu.toolchain import compile_library


@pytest.fixture(params=["2", "3", "3-scalar"])
def good(request: pytest.FixtureRequest, fmu_file: Callable[..., Path]) -> Path:
    return fmu_file(request.param)


def changed(source: Path, target: Path, changes: Mapping[str, Callable[[bytes], bytes]]) -> Path:
    """A copy with some files changed."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for entry in old.infolist():
            change = changes.get(entry.filename, lambda data: data)
            new.writestr(entry, change(old.read(entry)))
    return target


def in_description(old: str, new: str) -> Mapping[str, Callable[[bytes], bytes]]:
    def change(data: bytes) -> bytes:
        assert old.encode() in data
        return data.replace(old.encode(), new.encode())

    return {"modelDescription.xml": change}


def test_our_fmus_have_no_problem(good: Path) -> None:
    assert validate_fmu(good) == []


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('name="gyro', 'name="gy ro', "gy ro"),
        ('description="', 'description="two\nlines ', "(line "),
        ('description="', 'description="two&#10;lines ', "contains a line break"),
        ('unit="rad/s"', 'unit="furlong"', "furlong"),
        ('causality="input"', 'causality="input" initial="exact"', "must not have the attribute initial"),
        ('modelIdentifier="GCF"', 'modelIdentifier="Other"', "is not the binary Other"),
        ("CoSimulation", "ModelExchange", "no co-simulation"),
        ("</ModelVariables>", "", "not well-formed"),
    ],
)
def test_a_fault_in_the_description_is_found(
    old: str, new: str, problem: str, good: Path, tmp_path: Path
) -> None:
    bad = changed(good, tmp_path / "bad.fmu", in_description(old, new))
    assert any(problem in found for found in validate_fmu(bad))


def test_several_faults_are_all_listed(good: Path, tmp_path: Path) -> None:
    first = changed(good, tmp_path / "a.fmu", in_description('unit="rad/s"', 'unit="furlong"'))
    both = changed(first, tmp_path / "b.fmu", in_description('modelIdentifier="GCF"', 'modelIdentifier="X"'))
    problems = validate_fmu(both)
    assert any("furlong" in p for p in problems)
    assert any("is not the binary X" in p for p in problems)


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("resources\\a.txt", "contains a backslash"),
        ("../a.txt", "leads out of the archive"),
        ("modelDescription.xml", "is in the archive twice"),
        ("binaries/mars/GCF.so", "binaries/mars is none of FMI"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_file_in_the_wrong_place_is_found(name: str, problem: str, good: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.fmu"
    shutil.copy(good, bad)
    with zipfile.ZipFile(bad, "a") as archive:
        archive.writestr(name, archive.read("modelDescription.xml"))
    assert any(problem in found for found in validate_fmu(bad))


def test_a_truncated_file_is_found(good: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.fmu"
    bad.write_bytes(good.read_bytes()[:5000])
    assert validate_fmu(bad) == ["is not a ZIP file: File is not a zip file"]


def test_a_foreign_binary_is_judged_by_what_it_exports_and_needs(good: Path, tmp_path: Path) -> None:
    source = tmp_path / "other.c"
    source.write_text("int helper(void); int helper(void) { return 1; }\n")
    library = compile_library([source], tmp_path / "other.so", hide_symbols=False)
    with zipfile.ZipFile(good) as archive:
        binary = next(n for n in archive.namelist() if n.startswith("binaries/") and not n.endswith("/"))
    bad = changed(good, tmp_path / "bad.fmu", {binary: lambda _: library.read_bytes()})
    problems = validate_fmu(bad)
    assert any("lacks the functions" in p and "DoStep" in p for p in problems)
    assert any("exports symbols besides FMI's helper" in p for p in problems)


@pytest.mark.parametrize("content", [b"", b"text", b"\x7fELF\x02\x01", b"MZ", b"\xca\xfe\xba\xbe"])
def test_what_is_no_library_is_refused(content: bytes) -> None:
    with pytest.raises(BuildError, match=r"damaged|no shared library"):
        read_binaries(content)
