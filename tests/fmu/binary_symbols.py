"""What a shared library exports and needs, read from the file itself: ELF, PE and Mach-O, 64-bit little endian."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field


@dataclass
class Symbols:
    """Names without the format's decorations.

    Attributes
    ----------
    exported, imported : set of str
        Symbols offered and wanted.
    libraries : set of str
        Other libraries needed.
    versions : set of str
        Versions of the imported symbols, such as ``GLIBC_2.2.5``.
    """

    exported: set[str] = field(default_factory=set)
    imported: set[str] = field(default_factory=set)
    libraries: set[str] = field(default_factory=set)
    versions: set[str] = field(default_factory=set)


def read(data: bytes) -> Symbols:
    """Symbols of a library of any of the three formats."""
    if data[:4] == b"\x7fELF":
        return _elf(data)
    if data[:2] == b"MZ":
        return _pe(data)
    if data[:4] == b"\xcf\xfa\xed\xfe":
        return _mach_o(data)
    raise ValueError("no library")


def darwin_parts(data: bytes) -> dict[int, bytes]:
    """The libraries inside a universal one by processor type."""
    magic, count = struct.unpack_from(">II", data)
    assert magic == 0xCAFEBABE
    parts = {}
    for i in range(count):
        processor, _, offset, size, align = struct.unpack_from(">IIIII", data, 8 + 20 * i)
        assert offset % (1 << align) == 0
        parts[processor] = data[offset : offset + size]
    return parts


def _text(data: bytes, at: int) -> str:
    return data[at : data.index(b"\0", at)].decode()


def elf_sections(data: bytes) -> dict[str, tuple[int, int, int]]:
    """Type, offset and size of the sections of an ELF file by name."""
    (table,) = struct.unpack_from("<Q", data, 0x28)
    entry, count, names_index = struct.unpack_from("<HHH", data, 0x3A)
    rows = [struct.unpack_from("<IIQQQQ", data, table + entry * i) for i in range(count)]
    names = rows[names_index][4]
    return {_text(data, names + row[0]): (row[1], row[4], row[5]) for row in rows}


def _elf(data: bytes) -> Symbols:
    sections, found = elf_sections(data), Symbols()
    _, strings, _ = sections[".dynstr"]
    _, at, size = sections[".dynsym"]
    for position in range(at + 24, at + size, 24):
        name, info, _, section = struct.unpack_from("<IBBH", data, position)
        if section == 0:
            found.imported.add(_text(data, strings + name))
        elif info >> 4:
            found.exported.add(_text(data, strings + name))
    _, at, size = sections[".dynamic"]
    for position in range(at, at + size, 16):
        tag, value = struct.unpack_from("<QQ", data, position)
        if tag == 1:
            found.libraries.add(_text(data, strings + value))
    if ".gnu.version_r" in sections:
        _, at, _ = sections[".gnu.version_r"]
        while True:
            _, count, _, aux, following = struct.unpack_from("<HHIII", data, at)
            position = at + aux
            for _ in range(count):
                _, _, _, name, skip = struct.unpack_from("<IHHII", data, position)
                found.versions.add(_text(data, strings + name))
                position += skip
            if following == 0:
                break
            at += following
    return found


def _pe(data: bytes) -> Symbols:
    (header,) = struct.unpack_from("<I", data, 0x3C)
    count, optional = struct.unpack_from("<H12xH", data, header + 6)
    directories = header + 24 + 112
    rows = [struct.unpack_from("<8sIIII", data, header + 24 + optional + 40 * i) for i in range(count)]

    def offset(address: int) -> int:
        for _, size, start, raw_size, raw in rows:
            if start <= address < start + max(size, raw_size):
                return raw + address - start
        raise ValueError(address)

    found = Symbols()
    (exports,) = struct.unpack_from("<I", data, directories)
    table = offset(exports)
    (names,) = struct.unpack_from("<I", data, table + 24)
    (names_at,) = struct.unpack_from("<I", data, table + 32)
    for i in range(names):
        (name,) = struct.unpack_from("<I", data, offset(names_at) + 4 * i)
        found.exported.add(_text(data, offset(name)))
    (imports,) = struct.unpack_from("<I", data, directories + 8)
    position = offset(imports)
    while any(row := struct.unpack_from("<IIIII", data, position)):
        found.libraries.add(_text(data, offset(row[3])))
        position += 20
    return found


def _mach_o(data: bytes) -> Symbols:
    (commands,) = struct.unpack_from("<I", data, 16)
    found, position = Symbols(), 32
    for _ in range(commands):
        command, size = struct.unpack_from("<II", data, position)
        if command == 0x2:
            table, count, strings, _ = struct.unpack_from("<IIII", data, position + 8)
            for i in range(count):
                name, kind, _, _, _ = struct.unpack_from("<IBBHQ", data, table + 16 * i)
                if kind & 0x01:
                    target = found.exported if kind & 0x0E else found.imported
                    target.add(_text(data, strings + name).removeprefix("_"))
        elif command == 0xC:
            (name,) = struct.unpack_from("<I", data, position + 8)
            found.libraries.add(_text(data, position + name))
        position += size
    return found
