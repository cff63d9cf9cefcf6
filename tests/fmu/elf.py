"""What an ELF file of 64 bits holds: its sections, and the symbols it wants from others."""

from __future__ import annotations

import struct


def sections(data: bytes) -> dict[str, tuple[int, int]]:
    """Offset and size of each section by its name."""
    (table,) = struct.unpack_from("<Q", data, 0x28)
    entry, count, names_index = struct.unpack_from("<HHH", data, 0x3A)
    rows = [struct.unpack_from("<IIQQQQ", data, table + entry * i) for i in range(count)]
    names = rows[names_index][4]
    return {_text(data, names + row[0]): (row[4], row[5]) for row in rows}


def imported(data: bytes) -> set[str]:
    """Names of the symbols that other libraries have to bring."""
    found = sections(data)
    strings, (start, size) = found[".dynstr"][0], found[".dynsym"]
    rows = (struct.unpack_from("<IBBH", data, at) for at in range(start + 24, start + size, 24))
    return {_text(data, strings + name) for name, _, _, section in rows if section == 0}


def _text(data: bytes, at: int) -> str:
    return data[at : data.index(b"\0", at)].decode()
