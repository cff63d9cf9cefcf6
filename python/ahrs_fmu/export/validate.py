"""Judge an FMU before an importer does: FMPy's validation, and rules that importers are known to enforce."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree

import fmpy.validation
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from ahrs_fmu.errors import BuildError
from ahrs_fmu.export.shared_library import Binary, read_binaries

_FOLDERS = {
    2: {
        "linux64": {"x86_64-linux"},
        "win64": {"x86_64-windows"},
        "darwin64": {"x86_64-darwin", "aarch64-darwin"},
    },
    3: {
        platform: {platform}
        for platform in ("x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin")
    },
}
"""By FMI version: the folders of binaries, and the platforms that may be in each."""

_SUFFIX = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}
_FUNCTIONS = {
    version: frozenset(name for name in dir(slave) if name.startswith(f"fmi{version}"))
    for version, slave in ((2, FMU2Slave), (3, FMU3Slave))
}
"""Every function that FMPy, one of the stricter importers, looks up when it loads a library."""

_SYSTEM_LIBRARY = re.compile(
    r"libc\.so\.6|libm\.so\.6|ld-linux-(x86-64|aarch64)\.so\.\d"
    r"|kernel32\.dll|api-ms-win-crt-[a-z]+-l1-1-0\.dll|ucrtbase\.dll"
    r"|/usr/lib/libSystem\.B\.dylib",
    re.IGNORECASE,
)
_MAX_GLIBC = (2, 17)
_BROKEN_ATTRIBUTE = re.compile(r'\b(\w+)\s*=\s*"[^"<]*[\n\r\t][^"<]*"')


def validate_fmu(path: Path) -> list[str]:
    """List every problem of an FMU.

    Parameters
    ----------
    path : Path
        The .fmu file.

    Returns
    -------
    list of str
        One line per problem; empty when there is none.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    path.open("rb").close()
    try:
        with zipfile.ZipFile(path) as archive:
            problems = list(chain(_archive_problems(archive), _content_problems(archive)))
    except zipfile.BadZipFile as error:
        return [f"is not a ZIP file: {error}"]
    known = fmpy.validation.validate_fmu(str(path))
    return list(dict.fromkeys(problem.partition("\n")[0].strip() for problem in [*known, *problems]))


def _archive_problems(archive: zipfile.ZipFile) -> Iterator[str]:
    names = [entry.orig_filename for entry in archive.infolist()]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield f"the file {name} is in the archive twice"
    for entry in archive.infolist():
        name = entry.orig_filename
        if "\\" in name:
            yield f"the file path {name} contains a backslash"
        if name.startswith("/") or ".." in PurePosixPath(name).parts:
            yield f"the file path {name} leads out of the archive"
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            yield f"the file {name} is compressed by a method that importers need not know"
    broken = archive.testzip()
    if broken:
        yield f"the file {broken} is damaged"


def _content_problems(archive: zipfile.ZipFile) -> Iterator[str]:
    try:
        text = archive.read("modelDescription.xml").decode("utf-8")
        root = ElementTree.fromstring(text)
    except KeyError:
        yield "modelDescription.xml is missing"
        return
    except (UnicodeDecodeError, ElementTree.ParseError) as error:
        yield f"modelDescription.xml is not well-formed: {error}"
        return
    for match in _BROKEN_ATTRIBUTE.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        yield f"the attribute {match[1]} (line {line}) contains a line break or a tab"
    yield from _description_problems(root)
    version = 3 if root.get("fmiVersion", "").startswith("3") else 2
    component = root.find("CoSimulation")
    if component is None:
        yield "it offers no co-simulation"
        return
    yield from _binary_problems(archive, version, component.get("modelIdentifier", ""))


def _description_problems(root: ElementTree.Element) -> Iterator[str]:
    for element in root.iter():
        for attribute, value in element.attrib.items():
            if any(c in value for c in "\n\r\t"):
                yield f"the attribute {attribute} of {element.tag} contains a line break or a tab"
    variables = root.find("ModelVariables")
    for variable in variables if variables is not None else ():
        name, causality = variable.get("name"), variable.get("causality")
        if variable.get("initial") and causality in ("input", "independent"):
            yield f'the {causality} variable "{name}" must not have the attribute initial'
        # FMI 2 keeps type, start and limits in a child element.
        yield from _limit_problems(name, variable if variable.tag != "ScalarVariable" else variable[0])


def _limit_problems(name: str | None, typed: ElementTree.Element) -> Iterator[str]:
    try:
        starts = [float(start) for start in typed.get("start", "").split()]
        low, high = float(typed.get("min", "-inf")), float(typed.get("max", "inf"))
    except ValueError:
        return  # Booleans and strings have no limits; numbers that are none are the schema's to find.
    for start in starts:
        if not low <= start <= high:
            yield f'the start value {start:g} of "{name}" is outside its limits {low:g} to {high:g}'


def _binary_problems(archive: zipfile.ZipFile, version: int, identifier: str) -> Iterator[str]:
    files = [
        PurePosixPath(n) for n in archive.namelist() if n.startswith("binaries/") and not n.endswith("/")
    ]
    if not files:
        yield "it has no binaries, so that only importers which compile its sources can use it"
    for file in files:
        folder = file.parts[1]
        allowed = _FOLDERS[version].get(folder)
        if allowed is None:
            known = ", ".join(_FOLDERS[version])
            yield f"the folder binaries/{folder} is none of FMI {version}: {known}"
            continue
        expected = identifier + _SUFFIX[next(iter(allowed)).partition("-")[2]]
        if file.name != expected:
            yield f"the file {file} is not the binary {expected} and is loaded by no importer"
            continue
        try:
            binaries = read_binaries(archive.read(str(file)))
        except BuildError as error:
            yield f"the binary {file} {error}"
            continue
        for binary in binaries:
            yield from (f"the binary {file} {p}" for p in _library_problems(binary, allowed, version))


def _library_problems(binary: Binary, allowed: set[str], version: int) -> Iterator[str]:
    if binary.platform not in allowed:
        yield f"is built for {binary.platform}"
    for library in binary.libraries:
        if not _SYSTEM_LIBRARY.fullmatch(library):
            yield f"depends on {library}, which is no part of the system"
    for needed in sorted(binary.versions):
        number = re.fullmatch(r"GLIBC_(\d+)\.(\d+)(\.\d+)?", needed)
        if number and (int(number[1]), int(number[2])) > _MAX_GLIBC:
            yield f"needs {needed}; older systems have up to GLIBC_{_MAX_GLIBC[0]}.{_MAX_GLIBC[1]}"
    yield from _listed("lacks the functions", sorted(_FUNCTIONS[version] - binary.exports))
    foreign = sorted(name for name in binary.exports if not name.startswith(f"fmi{version}"))
    yield from _listed("exports symbols besides FMI's", foreign)


def _listed(what: str, names: Sequence[str]) -> Iterator[str]:
    if names:
        yield f"{what} {', '.join(names)}"
