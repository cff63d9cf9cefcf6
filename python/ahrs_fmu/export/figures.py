"""Drawings of the documentation page as SVG text: a run, the frames, the timing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

INK = "#26324a"
FAINT = "#c9d0dc"
COLOURS = ("#c8553d", "#2a7f62", "#2d5fa6")

_WIDTH = 860.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 56.0, 92.0, 14.0, 34.0
_MOST_POINTS = 430


@dataclass(frozen=True, slots=True)
class Chart:
    """Curves over one time axis.

    Attributes
    ----------
    time : ndarray, shape (N,)
        Seconds.
    curves : mapping of str to ndarray, shape (N,)
        What is drawn, with its name at its right end.
    dashed : mapping of str to ndarray, shape (N,)
        What is drawn thin and dashed beneath, without a name of its own.
    label : str
        Quantity and unit of the vertical axis.
    """

    time: FloatArray
    curves: Mapping[str, FloatArray]
    dashed: Mapping[str, FloatArray]
    label: str

    def svg(self, height: float) -> str:
        """The chart as an SVG element `height` units high."""
        step = -(-self.time.size // _MOST_POINTS)
        values = [v for group in (self.curves, self.dashed) for v in group.values()]
        ticks = nice_ticks(min(float(np.nanmin(v)) for v in values), max(float(np.nanmax(v)) for v in values))
        low, high = ticks[0], ticks[-1]
        span = float(self.time[-1] - self.time[0])

        def x(t: FloatArray) -> FloatArray:
            return np.asarray(_LEFT + (t - self.time[0]) / span * (_WIDTH - _LEFT - _RIGHT))

        def y(v: FloatArray | float) -> FloatArray:
            return np.asarray(_TOP + (high - v) / (high - low) * (height - _TOP - _BOTTOM))

        parts = [_open(_WIDTH, height, f"{self.label} over time in seconds")]
        for tick in ticks:
            at = float(y(tick))
            parts.append(_line(_LEFT, at, _WIDTH - _RIGHT, at, FAINT, 0.5 if tick else 1.0))
            parts.append(_text(_LEFT - 8, at + 4, f"{tick:g}", "end"))
        for tick in nice_ticks(float(self.time[0]), float(self.time[-1])):
            if self.time[0] <= tick <= self.time[-1]:
                parts.append(
                    _text(float(x(np.asarray(tick))), height - _BOTTOM + 18, f"{tick:g} s", "middle")
                )
        parts.append(
            f'<text transform="translate(14 {(height - _BOTTOM + _TOP) / 2:.0f}) rotate(-90)" '
            f'text-anchor="middle">{escape(self.label)}</text>'
        )
        time = x(self.time[::step])
        for values_ in self.dashed.values():
            parts.append(_path(time, y(values_[::step]), INK, 1.1, 'stroke-dasharray="4 3"'))
        ends = _apart([float(y(v[-1])) for v in self.curves.values()], 15.0)
        for (name, values_), colour, end in zip(self.curves.items(), COLOURS, ends, strict=False):
            parts.append(_path(time, y(values_[::step]), colour, 1.6))
            parts.append(
                f'<text x="{_WIDTH - _RIGHT + 8:.1f}" y="{end + 4:.1f}" fill="{colour}">{escape(name)}</text>'
            )
        return "\n".join([*parts, "</svg>"])


def nice_ticks(low: float, high: float) -> list[float]:
    """Round numbers, about five, that enclose the range but for a sliver."""
    span = max(high - low, 1e-9)
    decade = 10.0 ** np.floor(np.log10(span / 4))
    step = float(next(m * decade for m in (1, 2, 2.5, 5, 10) if span / (m * decade) <= 6))
    first, last = int(np.floor((low + 0.03 * span) / step)), int(np.ceil((high - 0.03 * span) / step))
    return [round(k * step, 9) for k in range(first, last + 1)]


def _apart(positions: Sequence[float], gap: float) -> list[float]:
    """Move labels from each other, downwards."""
    moved = list(positions)
    order = sorted(range(len(moved)), key=lambda i: moved[i])
    for before, after in pairwise(order):
        moved[after] = max(moved[after], moved[before] + gap)
    return moved


def frames(frame: str) -> str:
    """Body axes of one frame, level, seen from behind and above, with what the sensors read."""
    axes = {
        "ned": (("x forward", 62, -42), ("y right", 84, 26), ("z down", 0, 78)),
        "enu": (("x forward", 62, -42), ("y left", -84, -26), ("z up", 0, -78)),
    }[frame]
    reads = {"ned": "level rest reads accel = (0, 0, -9.81)", "enu": "level rest reads accel = (0, 0, +9.81)"}
    titles = {
        "ned": "ned: north-east-down, body forward-right-down",
        "enu": "enu: east-north-up, body forward-left-up",
    }
    parts = [_open(400, 268, titles[frame])]
    parts.append(_text(200, 18, titles[frame], "middle", "font-weight:600"))
    cx, cy = 200.0, 130.0
    board = [(-46, -6), (-8, -32), (46, 6), (8, 32)]
    outline = " ".join(f"{cx + dx:.0f},{cy + dy:.0f}" for dx, dy in board)
    parts.append(f'<polygon points="{outline}" fill="#e6ebf3" stroke="{INK}"/>')
    for (name, dx, dy), colour in zip(axes, COLOURS, strict=True):
        parts.append(_arrow(cx, cy, cx + dx, cy + dy, colour))
        anchor = "middle" if dx == 0 else ("start" if dx > 0 else "end")
        parts.append(
            f'<text x="{cx + 1.08 * dx:.0f}" y="{cy + 1.08 * dy + (14 if dx == 0 and dy > 0 else 0):.0f}" '
            f'text-anchor="{anchor}" fill="{colour}">{name}</text>'
        )
    parts.append(_text(200, 258, reads[frame], "middle"))
    return "\n".join([*parts, "</svg>"])


def timing() -> str:
    """Ticks and communication points, and which inputs meet which output."""
    width, height, x0, tick = _WIDTH, 188.0, 150.0, 150.0
    steps = (0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 3.5, 4.0)
    parts = [_open(width, height, "Ticks of the estimator and communication points of the importer")]
    rows = {"importer": 34.0, "inputs used": 78.0, "ticks": 118.0, "outputs": 158.0}
    for name, y in rows.items():
        parts.append(_text(12, y + 4, name, "start", "font-weight:600"))
        parts.append(_line(x0 - 20, y, x0 + 4.25 * tick, y, FAINT, 1.0))
    for k, at in enumerate(steps):
        x = x0 + at * tick
        if k:
            used = any(steps[k - 1] < n <= at for n in range(1, 5))
            colour = COLOURS[0] if used else FAINT
            start = x0 + steps[k - 1] * tick
            parts.append(
                f'<rect x="{start + 2:.1f}" y="{rows["inputs used"] - 8:.0f}" width="{x - start - 4:.1f}" '
                f'height="16" rx="3" fill="{colour}" fill-opacity="0.75"/>'
            )
    for n in range(5):
        x = x0 + n * tick
        parts.append(
            _line(x, rows["importer"] - 14, x, rows["outputs"] + 12, FAINT, 0.8, 'stroke-dasharray="3 3"')
        )
        label = "start: first attitude" if n == 0 else f"tick {n}"
        parts.append(
            f'<rect x="{x - 3:.1f}" y="{rows["ticks"] - 9:.0f}" width="6" height="18" fill="{COLOURS[2]}"/>'
        )
        parts.append(_text(x + 7, rows["ticks"] - 5, label, "start"))
        if n < 4:
            level = rows["outputs"] + (5, -4, 3, -6)[n]
            parts.append(_line(x, level, x + tick, level, COLOURS[1], 3.0))
    parts += [
        f'<circle cx="{x0 + at * tick:.1f}" cy="{rows["importer"]:.0f}" r="4" fill="{INK}"/>' for at in steps
    ]
    return "\n".join([*parts, "</svg>"])


def _open(width: float, height: float, label: str) -> str:
    return f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(label, quote=True)}">'


def _line(x1: float, y1: float, x2: float, y2: float, colour: str, width: float, extra: str = "") -> str:
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" '
        f'stroke-width="{width:g}" {extra}/>'
    )


def _arrow(x1: float, y1: float, x2: float, y2: float, colour: str) -> str:
    length = float(np.hypot(x2 - x1, y2 - y1))
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    left, right = (
        (x2 - 10 * ux + 4 * uy, y2 - 10 * uy - 4 * ux),
        (x2 - 10 * ux - 4 * uy, y2 - 10 * uy + 4 * ux),
    )
    head = f"{x2:.1f},{y2:.1f} {left[0]:.1f},{left[1]:.1f} {right[0]:.1f},{right[1]:.1f}"
    return (
        _line(x1, y1, x2 - 8 * ux, y2 - 8 * uy, colour, 2.4) + f'<polygon points="{head}" fill="{colour}"/>'
    )


def _text(x: float, y: float, text: str, anchor: str, style: str = "") -> str:
    styled = f' style="{style}"' if style else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{INK}"{styled}>{escape(text)}</text>'


def _path(x: FloatArray, y: FloatArray, colour: str, width: float, extra: str = "") -> str:
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width:g}" {extra}/>'
