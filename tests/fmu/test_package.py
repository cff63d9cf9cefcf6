"""What is inside an FMU: valid, complete, the same every time, and rebuildable from its own sources."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import elf
import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from host import Instance, Library, Replay
from numpy.typing import NDArray

from ahrs_fmu import descriptors, toolchain
from ahrs_fmu.errors import BuildError, ParameterError
from ahrs_fmu.export import icon
from ahrs_fmu.export.binaries import binary_folder, compile_binaries
from ahrs_fmu.export.package import build_fmu
from ahrs_fmu.export.shared_library import read_binaries
from ahrs_fmu.export.source_code import fmi_headers, source_files
from ahrs_fmu.export.variant import Variant

FmuFile = Callable[..., Path]
VARIANTS = ["2", "3", "3-scalar"]
GCF = descriptors.load("gcf")


def functions_of(version: int) -> set[str]:
    """Every function that the standard's header declares."""
    text = (fmi_headers() / f"fmi{version}Functions.h").read_text()
    return set(re.findall(rf"FMI{version}_Export\s+fmi{version}\w+TYPE\s+(fmi{version}\w+);", text))


def binaries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {n: archive.read(n) for n in archive.namelist() if n.startswith("binaries/")}


def glibc(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.removeprefix("GLIBC_").split("."))


@pytest.mark.parametrize("fmi", VARIANTS)
@pytest.mark.parametrize("precision", ["double", "single"])
def test_the_validation_of_fmpy_finds_no_problem(fmi: str, precision: str, fmu_file: FmuFile) -> None:
    assert validate_fmu(str(fmu_file(fmi, precision))) == []


@pytest.mark.parametrize("fmi", VARIANTS)
def test_a_second_build_is_the_same_to_the_byte(fmi: str, fmu_file: FmuFile, tmp_path: Path) -> None:
    again = build_fmu("gcf", fmi=fmi, output=tmp_path)
    assert again == tmp_path / f"fmi{fmi}" / "GCF.fmu"
    assert again.read_bytes() == fmu_file(fmi).read_bytes()


def test_a_second_compilation_is_the_same_to_the_byte_and_knows_no_path(tmp_path: Path) -> None:
    sources = source_files(Variant(GCF, "3"))
    results = []
    for name in ("one", "another"):
        folder = tmp_path / name
        folder.mkdir()
        for file, text in sources.items():
            (folder / file).write_text(text)
        library = toolchain.compile_library(
            sorted(folder.glob("*.c")), folder / "x.so", include=[folder], system_include=[fmi_headers()]
        )
        results.append(library.read_bytes())
    assert results[0] == results[1]
    assert str(tmp_path).encode() not in results[0]


@pytest.mark.parametrize("fmi", VARIANTS)
def test_the_archive_has_plain_forward_paths_and_fixed_times(fmi: str, fmu_file: FmuFile) -> None:
    with zipfile.ZipFile(fmu_file(fmi)) as archive:
        for entry in archive.infolist():
            assert re.fullmatch(r"[A-Za-z0-9_./-]+", entry.filename)
            assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        names = set(archive.namelist())
        licence = archive.read("documentation/licenses/license.txt").decode()
    assert licence.startswith("BSD 2-Clause")
    expected = {"modelDescription.xml", "documentation/index.html"}
    expected |= (
        {"model.png"}
        if fmi == "2"
        else {
            "sources/buildDescription.xml",
            "terminalsAndIcons/terminalsAndIcons.xml",
            "terminalsAndIcons/icon.png",
            "terminalsAndIcons/icon.svg",
        }
    )
    assert expected <= names


@pytest.mark.parametrize("fmi", VARIANTS)
def test_host_binaries_are_small_export_the_standard_and_need_an_old_libc_only(
    fmi: str, fmu_file: FmuFile
) -> None:
    ((_, data),) = binaries(fmu_file(fmi)).items()
    (library,) = read_binaries(data)
    assert len(data) < 120_000
    assert library.exports == functions_of(int(fmi[0]))
    if library.platform.endswith("linux"):
        assert set(library.libraries) <= {"libc.so.6", "libm.so.6"}
        assert all(glibc(version) <= (2, 17) for version in library.versions)
        memory = {"calloc", "malloc", "free", "memcpy", "memset", "memcmp", "bcmp"}
        text = {"strlen", "strcmp", "strncmp", "snprintf", "vsnprintf"}
        assert {name for name in elf.imported(data) if not name.startswith("_")} <= memory | text


@pytest.mark.slow
@pytest.mark.parametrize("fmi", VARIANTS)
def test_fmus_for_all_platforms_stay_small_and_export_the_standard(fmi: str, tmp_path: Path) -> None:
    path = build_fmu("gcf", fmi=fmi, platforms=list(toolchain.TARGETS), output=tmp_path)
    assert validate_fmu(str(path)) == []
    assert path.stat().st_size < 1_000_000
    version = int(fmi[0])
    found = binaries(path)
    folders = {name.split("/")[1] for name in found}
    if version == 2:
        assert folders == {"linux64", "win64", "darwin64"}
    else:
        assert folders == set(toolchain.TARGETS)
    for name, data in found.items():
        parts = read_binaries(data)
        assert len(parts) == (2 if "darwin64/" in name else 1)
        assert len(data) < 120_000 * len(parts), name
        for part in parts:
            assert part.exports == functions_of(version), name
            if name.endswith(".dll"):
                assert all(re.fullmatch(r"KERNEL32\.dll|api-ms-win-crt-.*", n) for n in part.libraries)
            if name.endswith(".dylib"):
                assert part.libraries == ("/usr/lib/libSystem.B.dylib",)
            assert all(glibc(v) <= (2, 17) for v in part.versions)


def test_sources_have_no_variables_that_can_change(tmp_path: Path) -> None:
    if not toolchain.host_platform().endswith("linux"):
        pytest.skip("reads ELF objects")
    for name, text in (source_files(Variant(GCF, "2")) | source_files(Variant(GCF, "3"))).items():
        (tmp_path / name).write_text(text)
    for source in sorted(tmp_path.glob("*.c")):
        command = [sys.executable, "-m", "ziglang", "cc", "-c", "-O2", "-fPIC", "-fno-sanitize=undefined"]
        command += ["-isystem", str(fmi_headers()), source.name, "-o", "object.o"]
        subprocess.run(command, cwd=tmp_path, check=True, env=toolchain.environment())
        sections = elf.sections((tmp_path / "object.o").read_bytes())
        for section, (_, size) in sections.items():
            changeable = re.match(r"\.(data|bss|tdata|tbss)(?!\.rel\.ro)", section)
            assert not (changeable and size), f"{source.name} has {size} bytes in {section}"


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_fmpy_rebuilds_the_fmu_from_its_sources_with_the_same_outputs(
    fmi: str,
    fmu_file: FmuFile,
    load: Callable[..., Library],
    replay_of: Callable[[Instance], Replay],
    rows: NDArray[np.float64],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for tool in ("cc", "make"):
        if shutil.which(tool) is None:
            pytest.skip(f"rebuilding from sources needs {tool}")
    if importlib.util.find_spec("cmake") is None:
        pytest.skip("rebuilding from sources needs cmake: install the package cmake")
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")
    copy = tmp_path / "GCF.fmu"
    _without_binaries(fmu_file(fmi), copy)
    subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", str(copy)], check=True, capture_output=True, cwd=tmp_path
    )
    k = np.arange(500)
    results = []
    for library in (load(fmi), Library(copy, tmp_path / "unpacked")):
        instance = library.instance().run(gyro=rows[0, :3], accel=rows[0, 3:6], mag=rows[0, 6:])
        results.append(replay_of(instance)(k * 0.01, 0.01, k + 1, rows))
        instance.free()
    np.testing.assert_array_equal(results[0], results[1])


def _without_binaries(fmu: Path, copy: Path) -> None:
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(copy, "w") as target:
        for name in source.namelist():
            if not name.startswith("binaries/"):
                target.writestr(name, source.read(name))


def test_fmi_2_sources_link_statically_under_the_prefix_of_their_model(tmp_path: Path) -> None:
    for name, text in source_files(Variant(GCF, "2")).items():
        (tmp_path / name).write_text(text)
    for header in ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"):
        text = (fmi_headers() / header).read_text()
        # The header as the standard has it; the copy in FMPy adds no prefix.
        text = text.replace(
            "#define fmi2FullName(name) name",
            "#define fmi2Paste(a, b) a##b\n#define fmi2PasteB(a, b) fmi2Paste(a, b)\n"
            "#define fmi2FullName(name) fmi2PasteB(FMI2_FUNCTION_PREFIX, name)",
        )
        (tmp_path / header).write_text(text)
    library = toolchain.compile_library(
        sorted(tmp_path.glob("*.c")), tmp_path / "out" / "x.so", system_include=[tmp_path]
    )
    exported = read_binaries(library.read_bytes())[0].exports
    assert {f"GCF_{name}" for name in functions_of(2)} == exported


@pytest.mark.parametrize("fmi", VARIANTS)
def test_the_model_description_says_what_the_descriptor_says(fmi: str, fmu_file: FmuFile) -> None:
    description = read_model_description(str(fmu_file(fmi)))
    assert description.variableNamingConvention == "structured"
    assert description.coSimulation.modelIdentifier == "GCF"
    assert description.generationDateAndTime is None
    assert {c.name for c in description.logCategories} >= {"logStatusError", "logStatusWarning"}
    found = {v.name: v for v in description.modelVariables}
    assert found["time"].causality == "independent"
    assert found["time"].valueReference == 0
    for variable in GCF.variables:
        names = [variable.name]
        if variable.size > 1 and fmi != "3":
            names = [f"{variable.name}[{i + 1}]" for i in range(variable.size)]
        for i, name in enumerate(names):
            there = found.pop(name)
            assert there.valueReference == variable.vr + i
            assert there.causality == GCF.role(variable)
            assert there.unit == (variable.unit or None)
            assert there.displayUnit == (variable.display_unit or None)
            assert there.description == variable.description
            if variable.type != "real":
                assert there.variability in ("discrete", "fixed", "tunable")
            if there.causality == "parameter":
                assert there.variability == ("tunable" if variable.tunable else "fixed")
    assert set(found) == {"time"}
    for unknown in description.outputs:
        assert unknown.dependencies == []


def test_every_variant_has_a_token_of_its_own_and_keeps_it() -> None:
    tokens = {Variant(GCF, fmi, precision).token for fmi in VARIANTS for precision in ("double", "single")}
    assert len(tokens) == 6
    assert all(re.fullmatch(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", token) for token in tokens)
    assert Variant(GCF, "2").token == Variant(descriptors.read(GCF.folder / "gcf.toml"), "2").token


def test_terminals_name_variables_that_exist(fmu_file: FmuFile) -> None:
    for fmi in ("3", "3-scalar"):
        names = {v.name for v in read_model_description(str(fmu_file(fmi))).modelVariables}
        with zipfile.ZipFile(fmu_file(fmi)) as archive:
            root = ElementTree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        members = [m.attrib["variableName"] for m in root.iter("TerminalMemberVariable")]
        assert members
        assert set(members) <= names


def test_icons_are_pictures() -> None:
    for png in (icon.horizon_png(), icon.bus_png()):
        assert png.startswith(b"\x89PNG\r\n\x1a\n")
    for svg in (icon.horizon_svg(), icon.bus_svg()):
        assert ElementTree.fromstring(svg).tag.endswith("svg")


def test_the_page_is_whole_and_names_every_variable(fmu_file: FmuFile) -> None:
    with zipfile.ZipFile(fmu_file("2")) as archive:
        page = archive.read("documentation/index.html").decode()
    for variable in GCF.variables:
        assert f"<code>{variable.name}</code>" in page
    for limit in GCF.limits:
        assert limit.says.split(":")[0] in page
    assert page.count("<svg") >= 2
    assert not re.search(r"(src|href)=\"(?!#)", page), "the page must not need anything else"


def test_unknown_models_and_platforms_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="no model 'gfc'; there are"):
        build_fmu("gfc", fmi="2", output=tmp_path)
    with pytest.raises(BuildError, match="unknown platform 'amiga'"):
        build_fmu("gcf", fmi="2", platforms=["amiga"], output=tmp_path)
    with pytest.raises(BuildError, match="FMI 2 has no name for aarch64-linux"):
        compile_binaries("GCF", {}, version=2, platforms=["aarch64-linux"])
    assert binary_folder("aarch64-linux", 3) == "aarch64-linux"
