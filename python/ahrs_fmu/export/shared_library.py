"""What a shared library needs and offers: just enough of ELF, PE and Mach-O to judge an FMU's binaries."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from ahrs_fmu.errors import BuildError

_ELF_MACHINES = {62: "x86_64-linux", 183: "aarch64-linux"}
_PE_MACHINES = {0x8664: "x86_64-windows"}
_MACH_MACHINES = {0x01000007: "x86_64-darwin", 0x0100000C: "aarch64-darwin"}
# Names that the linker puts into every library for macOS.
_MACH_OWN = {"__dso_handle", "_mh_dylib_header"}


@dataclass(frozen=True, slots=True)
class Binary:
    """One architecture of a shared library.

    Attributes
    ----------
    platform : str
        Platform by its FMI 3 name, such as x86_64-linux.
    libraries : tuple of str
        Libraries it loads.
    exports : frozenset of str
        Functions and data it defines for others.
    versions : frozenset of str
        Versioned symbols it asks for, such as GLIBC_2.17.
    """

    platform: str
    libraries: tuple[str, ...]
    exports: frozenset[str]
    versions: frozenset[str]


def read_binaries(data: bytes) -> list[Binary]:
    """Read a shared library of 64 bits; a universal file of macOS gives one entry per architecture.

    Raises
    ------
    BuildError
        It is none, or it is damaged.
    """
    try:
        if data.startswith(b"\x7fELF\x02\x01"):
            return [_read_elf(data)]
        if data.startswith(b"MZ"):
            return [_read_pe(data)]
        if data.startswith(b"\xca\xfe\xba\xbe"):
            return [_read_mach(part) for part in _universal_parts(data)]
        if data.startswith(b"\xcf\xfa\xed\xfe"):
            return [_read_mach(data)]
    except (struct.error, IndexError, KeyError, ValueError) as error:
        raise BuildError(f"is damaged, or built for a platform that FMI does not name ({error})") from None
    raise BuildError("is no shared library of 64 bits for Linux, Windows or macOS")


def _text(data: bytes, offset: int) -> str:
    return data[offset : data.index(b"\0", offset)].decode("ascii", errors="replace")


def _read_elf(data: bytes) -> Binary:
    (machine,) = struct.unpack_from("<H", data, 18)
    (table,) = struct.unpack_from("<Q", data, 40)
    size, count = struct.unpack_from("<HH", data, 58)
    # (name, type, flags, address, offset, size, link, info, alignment, entry size)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, table + k * size) for k in range(count)]
    libraries: list[str] = []
    exports: list[str] = []
    versions: list[str] = []
    for _, kind, _, _, offset, length, link, info, _, _ in sections:
        strings = sections[link][4]
        if kind == 6:  # SHT_DYNAMIC
            for at in range(offset, offset + length, 16):
                tag, value = struct.unpack_from("<QQ", data, at)
                if tag == 1:  # DT_NEEDED
                    libraries.append(_text(data, strings + value))
        elif kind == 11:  # SHT_DYNSYM
            for at in range(offset, offset + length, 24):
                name, _, _, section = struct.unpack_from("<IBBH", data, at)
                if section and name:
                    exports.append(_text(data, strings + name))
        elif kind == 0x6FFFFFFE:  # SHT_GNU_verneed
            versions += _needed_versions(data, offset, info, strings)
    return Binary(_ELF_MACHINES[machine], tuple(libraries), frozenset(exports), frozenset(versions))


def _needed_versions(data: bytes, offset: int, count: int, strings: int) -> Iterator[str]:
    for _ in range(count):
        _, entries, _, first, following = struct.unpack_from("<HHIII", data, offset)
        at = offset + first
        for _ in range(entries):
            _, _, _, name, step = struct.unpack_from("<IHHII", data, at)
            yield _text(data, strings + name)
            at += step
        offset += following


def _read_pe(data: bytes) -> Binary:
    (header,) = struct.unpack_from("<I", data, 0x3C)
    machine, n_sections = struct.unpack_from("<HH", data, header + 4)
    (optional_size,) = struct.unpack_from("<H", data, header + 20)
    directories = header + 24 + 112
    first = header + 24 + optional_size
    # (size in memory, address, size in file, offset in file)
    sections = [struct.unpack_from("<IIII", data, first + 40 * k + 8) for k in range(n_sections)]

    def offset_of(address: int) -> int:
        for size, start, _, offset in sections:
            if start <= address < start + size:
                return int(offset + address - start)
        raise ValueError(f"no section at {address:#x}")

    exports_at, _, imports_at = struct.unpack_from("<III", data, directories)
    libraries = []
    if imports_at:
        at = offset_of(imports_at)
        while name := struct.unpack_from("<I", data, at + 12)[0]:
            libraries.append(_text(data, offset_of(name)))
            at += 20
    exports = []
    if exports_at:
        at = offset_of(exports_at)
        count, _, names = struct.unpack_from("<III", data, at + 24)
        for k in range(count):
            (name,) = struct.unpack_from("<I", data, offset_of(names) + 4 * k)
            exports.append(_text(data, offset_of(name)))
    return Binary(_PE_MACHINES[machine], tuple(libraries), frozenset(exports), frozenset())


def _universal_parts(data: bytes) -> Iterator[bytes]:
    (count,) = struct.unpack_from(">I", data, 4)
    for k in range(count):
        _, _, offset, size, _ = struct.unpack_from(">IIIII", data, 8 + 20 * k)
        yield data[offset : offset + size]


def _read_mach(data: bytes) -> Binary:
    _, machine, _, _, n_commands = struct.unpack_from("<IIIII", data, 0)
    libraries = []
    exports = []
    at = 32
    for _ in range(n_commands):
        command, size = struct.unpack_from("<II", data, at)
        if command == 0xC:  # LC_LOAD_DYLIB
            (name,) = struct.unpack_from("<I", data, at + 8)
            libraries.append(_text(data, at + name))
        elif command == 0x2:  # LC_SYMTAB
            symbols, count, strings, _ = struct.unpack_from("<IIII", data, at + 8)
            for k in range(count):
                name, kind = struct.unpack_from("<IB", data, symbols + 16 * k)
                if kind & 0x1 and kind & 0xE == 0xE:  # external and defined in a section
                    exports.append(_text(data, strings + name).removeprefix("_"))
        at += size
    return Binary(_MACH_MACHINES[machine], tuple(libraries), frozenset(exports) - _MACH_OWN, frozenset())
