"""The icons of an FMU, as SVG and as PNG: an artificial horizon, and a mark for a bus."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

_SKY = "#4f8fc0"
_GROUND = "#9c6b3c"
_FRAME = "#26324a"
_LINE = "#ffffff"
_MARK = "#f2b632"
_BANK = 18.0
_PIXELS = 128
_FINE = 4

_Image = NDArray[np.float64]
_Mask = NDArray[np.bool_]


def horizon_svg() -> str:
    """An artificial horizon in a bank, in a square of 200."""
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="-100 -100 200 200">\n'
        f'<rect x="-98" y="-98" width="196" height="196" rx="24" fill="{_FRAME}"/>\n'
        '<clipPath id="dial"><circle r="80"/></clipPath>\n'
        f'<g clip-path="url(#dial)"><g transform="rotate({_BANK:g})">\n'
        f'<rect x="-130" y="-130" width="260" height="140" fill="{_SKY}"/>\n'
        f'<rect x="-130" y="10" width="260" height="140" fill="{_GROUND}"/>\n'
        f'<rect x="-130" y="8" width="260" height="4" fill="{_LINE}"/>\n'
        + "".join(
            f'<rect x="{-w}" y="{y - 1.5:g}" width="{2 * w}" height="3" fill="{_LINE}"/>\n'
            for y, w in _LADDER
        )
        + "</g></g>\n"
        + "".join(
            f'<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="{_MARK}"/>\n' for x, y, w, h in _AIRCRAFT
        )
        + "</svg>\n"
    )


_LADDER = ((-40, 22), (-15, 12), (35, 12), (60, 22))
_AIRCRAFT = ((-62, -4, 42, 8), (20, -4, 42, 8), (-5, -5, 10, 10))


def horizon_png() -> bytes:
    """The horizon as a square of 128 pixels."""
    x, y = _grid()
    image = _canvas()
    angle = np.deg2rad(_BANK)
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    inner = x**2 + y**2 <= 80.0**2
    corner = np.maximum(np.abs(x) - 74.0, 0.0) ** 2 + np.maximum(np.abs(y) - 74.0, 0.0) ** 2
    _paint(image, corner <= 24.0**2, _FRAME)
    _paint(image, inner & (across < 10.0), _SKY)
    _paint(image, inner & (across >= 10.0), _GROUND)
    _paint(image, inner & (np.abs(across - 10.0) <= 2.0), _LINE)
    for centre, half in _LADDER:
        _paint(image, inner & (np.abs(across - centre) <= 1.5) & (np.abs(along) <= half), _LINE)
    for left, top, width, height in _AIRCRAFT:
        _paint(image, (x >= left) & (x < left + width) & (y >= top) & (y < top + height), _MARK)
    return _png(image)


def bus_svg() -> str:
    """A diamond."""
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="-100 -100 200 200">\n'
        f'<path d="M-90 0 0 -90 90 0 0 90z" fill="{_FRAME}"/>\n</svg>\n'
    )


def bus_png() -> bytes:
    """The diamond as a square of 128 pixels."""
    x, y = _grid()
    image = _canvas()
    _paint(image, np.abs(x) + np.abs(y) <= 90.0, _FRAME)
    return _png(image)


def _grid() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coordinates of finer pixels, x to the right and y down, in a square from -100 to 100."""
    count = _PIXELS * _FINE
    axis = (np.arange(count) + 0.5) * 200.0 / count - 100.0
    return np.broadcast_to(axis, (count, count)), np.broadcast_to(axis[:, None], (count, count))


def _canvas() -> _Image:
    return np.zeros((_PIXELS * _FINE, _PIXELS * _FINE, 4))


def _paint(image: _Image, where: _Mask, colour: str) -> None:
    image[where] = [int(colour[i : i + 2], 16) for i in (1, 3, 5)] + [255]


def _png(image: _Image) -> bytes:
    """Average the finer pixels, colours weighted by their opacity, and encode."""
    blocks = image.reshape(_PIXELS, _FINE, _PIXELS, _FINE, 4)
    alpha = blocks[..., 3:].sum(axis=(1, 3))
    colour = (blocks[..., :3] * blocks[..., 3:]).sum(axis=(1, 3)) / np.maximum(alpha, 1.0)
    pixels = np.concatenate([colour, alpha / _FINE**2], axis=2).round().astype(np.uint8)
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", _PIXELS, _PIXELS, 8, 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + _chunk(b"IDAT", zlib.compress(rows, 9))
        + _chunk(b"IEND", b"")
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
