"""The page that opens from an importer: what the model is, its wiring, parameters, frames and timing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from html import escape
from pathlib import Path

import numpy as np

from ahrs_fmu import descriptors
from ahrs_fmu.demo_flight import demo_flight
from ahrs_fmu.descriptors import Descriptor, Variable
from ahrs_fmu.export import figures, icon
from ahrs_fmu.export.variant import Variant
from ahrs_fmu.metrics import attitude_error
from ahrs_fmu.native import NativeModel
from ahrs_fmu.version import __version__

_STYLE = Path(__file__).with_name("page.css")
_HEAD_INPUT = ("Name", "Reference", "Size", "Type", "Unit", "Meaning")
_HEAD_PARAMETER = ("Name", "Reference", "Default", "Limits", "Unit", "Tunable", "Meaning")


def page(variant: Variant) -> str:
    """The page as one HTML document that needs nothing else."""
    descriptor = variant.descriptor
    is_estimator = descriptor.interface is not None and descriptor.interface.name == "estimator"
    sections = [
        _what(descriptor),
        *([_run(descriptor.name)] if is_estimator else []),
        _wiring(variant),
        *([_frames()] if is_estimator else []),
        _timing(variant),
        _parameters(variant),
        _choices(descriptor),
        _in_use(variant),
    ]
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            '<head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{escape(descriptor.title)}: {escape(descriptor.summary)}</title>",
            f"<style>\n{_STYLE.read_text()}</style></head>",
            "<body>",
            _header(variant),
            "<main>",
            *sections,
            "</main>",
            "</body>",
            "</html>",
            "",
        ]
    )


def _header(variant: Variant) -> str:
    descriptor = variant.descriptor
    arrays = {"2": "scalar variables", "3": "array variables", "3-scalar": "scalar variables"}[variant.fmi]
    chips = [
        f"FMI {variant.version}.0 co-simulation",
        arrays,
        f"{variant.precision} precision",
        f"version {__version__}",
    ]
    return (
        f"<header><div>{icon.horizon_svg()}<div><h1>{escape(descriptor.title)}</h1>"
        f"<p>{escape(descriptor.summary)}</p>"
        f'<div class="chips">{"".join(f"<span>{escape(chip)}</span>" for chip in chips)}</div>'
        "</div></div></header>"
    )


def _section(title: str, *body: str) -> str:
    return "\n".join([f"<section><h2>{escape(title)}</h2>", *body, "</section>"])


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], plain: Sequence[str] = ("Meaning",)) -> str:
    """A table; cells are HTML already."""
    classes = ["" if title in plain else ' class="n"' for title in head]
    lines = ["<table><tr>" + "".join(f"<th>{escape(title)}</th>" for title in head) + "</tr>"]
    for row in rows:
        lines.append(
            "<tr>" + "".join(f"<td{c}>{cell}</td>" for c, cell in zip(classes, row, strict=True)) + "</tr>"
        )
    return "\n".join([*lines, "</table>"])


def _what(descriptor: Descriptor) -> str:
    return _section("What it is", f"<p>{escape(descriptor.description)}</p>")


@cache
def _run(model: str) -> str:
    """A run of the C core itself over the generated flight."""
    descriptor = descriptors.load(model)
    flight = demo_flight()
    native = NativeModel(descriptor)
    dt = np.diff(flight.time, prepend=flight.time[0])
    columns = {"gyro": flight.gyro, "accel": flight.accel, "mag": flight.mag}
    ran = native.run(dt, columns, ["q", "roll", "pitch", "yaw"])
    outputs = {name: np.asarray(values, dtype=np.float64) for name, values in ran.items()}
    truth = flight.q_true
    assert truth is not None
    error = attitude_error(outputs["q"], truth)
    names = ("roll", "pitch", "yaw")
    estimate = {name: np.degrees(np.unwrap(outputs[name])) for name in names}
    # Error angles are wrapped already, so that estimate minus error draws the truth without a jump.
    true = {name: estimate[name] - np.degrees(error.euler[:, i]) for i, name in enumerate(names)}
    errors = {"inclination": np.degrees(error.inclination), "heading": np.degrees(error.heading)}

    def angles(*chosen: str) -> figures.Chart:
        return figures.Chart(
            flight.time, {n: estimate[n] for n in chosen}, {n: true[n] for n in chosen}, "angle in deg"
        )

    rms = error.rms(flight.evaluate).degrees()
    return _section(
        "A run with the default settings",
        "<p>A generated flight of a small multirotor: rocking in roll and pitch, turning in yaw, with sensor "
        "noise, a gyroscope bias of 0.2 to 0.3 deg/s per axis and real side accelerations. Dashed: "
        "the truth.</p>",
        angles("roll", "pitch").svg(190),
        angles("yaw").svg(150),
        figures.Chart(flight.time, errors, {}, "error in deg").svg(160),
        f'<p class="note">RMS after the first seconds at rest: inclination {rms["inclination"]:.2f} '
        f"deg, heading "
        f"{rms['heading']:.2f} deg. Drawn from this model's own C code.</p>",
    )


def _unit(variable: Variable) -> str:
    shown = f" <span class=note>({escape(variable.display_unit)})</span>" if variable.display_unit else ""
    return escape(variable.unit) + shown


def _kind(variable: Variable) -> str:
    return variable.type if not variable.enumeration else f"choice of {escape(variable.enumeration)}"


def _port_rows(variables: Iterable[Variable]) -> list[list[str]]:
    return [
        [
            f"<code>{escape(v.name)}</code>",
            str(v.vr) if v.size == 1 else f"{v.vr} to {v.vr + v.size - 1}",
            str(v.size),
            _kind(v),
            _unit(v),
            escape(v.description),
        ]
        for v in variables
    ]


def _wiring(variant: Variant) -> str:
    naming = {
        True: "An array is one variable under its first reference.",
        False: "Elements of an array are variables of their own: <code>gyro[1]</code>, <code>gyro[2]</code>",
    }[variant.has_arrays]
    descriptor = variant.descriptor
    return _section(
        "Wiring",
        f"<p>{naming} All quantities are in SI units; tools that know display units show the ones in "
        f"parentheses. Every model of this family has the same variables under the same references, "
        f"so that one can replace another.</p>",
        "<h3>Inputs</h3>",
        _table(_HEAD_INPUT, _port_rows(descriptor.inputs)),
        "<h3>Outputs</h3>",
        _table(_HEAD_INPUT, _port_rows(descriptor.outputs)),
    )


def _frames() -> str:
    return _section(
        "Frames",
        "<p>The parameter <code>frame</code> names the navigation frame and with it the body axes in "
        "which the sensors are mounted. The accelerometer gives specific force: what it reads, not "
        "gravity. If level rest reads the opposite sign of the third axis, the axes are those of the "
        "other frame.</p>",
        f'<div class="pair"><div>{figures.frames("ned")}</div><div>{figures.frames("enu")}</div></div>',
        "<p><code>q</code> turns body vectors into navigation vectors: v<sub>n</sub> = q "
        "v<sub>b</sub> q*. Yaw is counted from north, clockwise seen from above, in "
        "<code>ned</code>, and from east, counter-clockwise, in <code>enu</code>.</p>",
    )


def _timing(variant: Variant) -> str:
    period = variant.descriptor.default_sample_time
    return _section(
        "Timing",
        f"<p>The model is a sampled device. Its ticks lie at the start time plus 1, 2, 3 ... times "
        f"<code>sample_time</code> ({period:g} s unless set). A communication step runs the ticks "
        f"inside it, the one at its end included; it may have any length, shorter or longer than a "
        f"tick. A tick uses the inputs set last; outputs hold until the next tick.</p>",
        figures.timing(),
        '<p class="note">Red: inputs that a tick uses. Grey: inputs that are replaced before a tick '
        "comes.</p>",
        "<p>So outputs never depend on inputs of the same instant, and there is no algebraic loop: "
        "an importer that sets inputs at t and steps to t + h sees the answer to them at t + h. To "
        "replay a recording without that delay, set sample k before the step that ends at its time. "
        "The output at the start is the attitude that the inputs present at the end of "
        "initialisation give.</p>",
    )


def _value(variable: Variable) -> str:
    value = variable.default
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return "(" + ", ".join(f"{element:g}" for element in value) + ")"
    return escape(value) if isinstance(value, str) else f"{value:g}"


def _limits(variable: Variable) -> str:
    if variable.type not in ("real", "integer"):
        return ""
    low = "(-∞" if variable.min is None else f"{'(' if variable.min_open else '['}{variable.min:.4g}"
    last = "]" if variable.allow_infinite else ")"
    high = f"∞{last}" if variable.max is None else f"{variable.max:.4g}{')' if variable.max_open else ']'}"
    return f"{low}, {high}"


def _parameters(variant: Variant) -> str:
    descriptor = variant.descriptor
    rows = [
        [
            f"<code>{escape(v.name)}</code>",
            str(v.vr) if v.size == 1 else f"{v.vr} to {v.vr + v.size - 1}",
            _value(v),
            _limits(v),
            _unit(v),
            "yes" if v.tunable else "no",
            escape(v.description),
        ]
        for v in sorted(descriptor.parameters, key=lambda v: (not descriptor.own([v]), v.vr))
    ]
    rules = [
        f"<li><code>{escape(limit.rule)}</code>: {escape(limit.says)}</li>" for limit in descriptor.limits
    ]
    return _section(
        "Parameters",
        "<p>Tunable ones may change at any time; the others are fixed once initialisation has ended.</p>",
        _table(_HEAD_PARAMETER, rows),
        "<h3>Rules between parameters</h3>",
        "<p>They are checked at the end of initialisation, and at the first step after a change, "
        "which then fails and keeps the old values.</p>",
        f"<ul>{''.join(rules)}</ul>",
    )


def _choices(descriptor: Descriptor) -> str:
    parts: list[str] = []
    for name in sorted({v.enumeration for v in descriptor.variables if v.enumeration}):
        enumeration = descriptor.enumerations[name]
        rows = [
            [f"<code>{escape(i.name)}</code>", str(i.value), escape(i.description)] for i in enumeration.items
        ]
        parts += [f"<h3>{escape(name)}</h3>", f"<p class=note>{escape(enumeration.description)}</p>"]
        parts.append(_table(("Name", "Number", "Meaning"), rows))
    return _section("Choices", *parts) if parts else ""


def _in_use(variant: Variant) -> str:
    call = {2: "fmi2SetDebugLogging", 3: "fmi3SetDebugLogging"}[variant.version]
    return _section(
        "In use",
        "<p>A sensor sample that is not a number, infinite or far beyond anything physical counts as no "
        "measurement and is forgotten. A call that makes no sense is refused with an error, changes "
        f"nothing and leaves a line in the log that names the function and the reason; choose the "
        f"categories with <code>{call}</code>. States can be saved, restored and serialised exactly; "
        f"bytes that are not a state of this very model are refused. Any number of instances may run "
        f"at once. The binaries need the C library only.</p>",
        "<p>The folder <code>sources</code> holds everything to build the model anew, on any "
        "platform with a C99 compiler:</p>",
        f"<pre>python -m fmpy compile {escape(variant.descriptor.title)}.fmu</pre>",
        "<p>The licence, BSD-2-Clause, is in <code>documentation/licenses</code>.</p>",
    )
