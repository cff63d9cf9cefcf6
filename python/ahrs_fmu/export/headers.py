"""C headers and variable tables, written from the descriptors.

``python -m ahrs_fmu.export.headers`` rewrites every generated C file of the tree; a test fails
when one of them is stale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap

from ahrs_fmu import descriptors
from ahrs_fmu.descriptors import Descriptor, Enumeration, Interface, State, Variable
from ahrs_fmu.rules import Rule
from ahrs_fmu.sources import fmu_src

_NOTICE = (
    "/* Generated from {source} by `python -m ahrs_fmu.export.headers`: change that file, not this one. */"
)
_MEMBERS = ("params", "inputs", "outputs", "state")


@dataclass(frozen=True)
class _Field:
    """A member of a generated struct."""

    name: str
    size: int
    is_real: bool
    comment: str


def _variable_field(variable: Variable) -> _Field:
    unit = f" [{variable.unit}]" if variable.unit else ""
    choices = f" (enumeration {variable.enumeration})" if variable.enumeration else ""
    return _Field(
        variable.name, variable.size, variable.type == "real", f"{variable.description}{unit}{choices}"
    )


def _state_field(state: State) -> _Field:
    unit = f" [{state.unit}]" if state.unit else ""
    return _Field(state.name, state.size, state.type == "real", f"{state.description}{unit}")


def _struct(type_name: str, common: str, fields: Sequence[_Field]) -> list[str]:
    """A struct with its reals first, so that there is no padding between members."""
    lines = ["typedef struct {"]
    if common:
        lines.append(f"    {common} common;")
    for field in sorted(fields, key=lambda field: not field.is_real):
        c_type = "ahrs_real" if field.is_real else "int32_t"
        declaration = f"{c_type} {field.name}{f'[{field.size}]' if field.size > 1 else ''};"
        lines.append(f"    {declaration} /* {_plain(field.comment)} */")
    if len(lines) == 1:
        lines.append("    int32_t unused; /* a struct needs a member */")
    return [*lines, f"}} {type_name};", ""]


def constant(prefix: str, enumeration: str, item: str) -> str:
    """Name of the C constant of an enumeration's item."""
    return f"{prefix}_{enumeration}_{item}".upper()


def _enum(prefix: str, name: str, enumeration: Enumeration) -> list[str]:
    lines = [f"/* {_plain(enumeration.description)} */", "enum {"]
    for item in enumeration.items:
        lines.append(
            f"    {constant(prefix, name, item.name)} = {item.value}, /* {_plain(item.description)} */"
        )
    return [*lines, "};", ""]


def _plain(text: str) -> str:
    """Text that neither ends nor begins a comment."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def _comment(text: str) -> list[str]:
    body = wrap(_plain(text), 106)
    return [f"/* {body[0]}", *(f" * {line}" for line in body[1:])] if body else ["/*"]


def interface_header(shared: Interface) -> str:
    """Text of ``include/ahrs_NAME.h`` for what a family of models shares."""
    guard = f"AHRS_{shared.name}_H".upper()
    prefix = f"ahrs_{shared.name}"
    lines = [
        _NOTICE.format(source=f"{shared.name}/{shared.name}.toml"),
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
    ]
    lines += ['#include "ahrs_real.h"', ""]
    for name, enumeration in shared.enumerations.items():
        lines += _enum("ahrs", name, enumeration)
    outputs = [output for output in shared.outputs if not output.optional]
    lines += _struct(f"{prefix}_params", "", [_variable_field(v) for v in shared.parameters])
    lines += _struct(f"{prefix}_inputs", "", [_variable_field(v) for v in shared.inputs])
    lines += _struct(f"{prefix}_outputs_t", "", [_variable_field(v) for v in outputs])
    lines += _struct(f"{prefix}_state", "", [_state_field(s) for s in shared.states])
    return "\n".join([*lines, "#endif", ""])


def model_header(descriptor: Descriptor) -> str:
    """Text of ``include/ahrs_NAME.h``: the public face of a model in C."""
    prefix = f"ahrs_{descriptor.name}"
    shared = descriptor.interface
    base = f"ahrs_{shared.name}" if shared else ""

    def common(part: str) -> str:
        return f"{base}_{part}" if base else ""

    guard = f"{prefix}_H".upper()
    lines = [_NOTICE.format(source=f"models/{descriptor.name}/{descriptor.name}.toml")]
    lines += [f"#ifndef {guard}", f"#define {guard}", ""]
    lines += [f'#include "ahrs_{shared.name}.h"' if shared else '#include "ahrs_real.h"', ""]
    lines += [*_comment(f"{descriptor.summary}. {descriptor.description}"), " */", ""]
    own_enumerations = {
        name: e
        for name, e in descriptor.enumerations.items()
        if shared is None or name not in shared.enumerations
    }
    for name, enumeration in own_enumerations.items():
        lines += _enum(prefix, name, enumeration)
    own = descriptor.own
    optional = [o for o in descriptor.outputs if o.optional]
    outputs = [*optional, *own(descriptor.outputs)]
    lines += _struct(
        f"{prefix}_params", common("params"), [_variable_field(v) for v in own(descriptor.parameters)]
    )
    if shared and not own(descriptor.inputs):
        lines += [f"typedef {base}_inputs {prefix}_inputs;", ""]
    else:
        lines += _struct(
            f"{prefix}_inputs", common("inputs"), [_variable_field(v) for v in own(descriptor.inputs)]
        )
    lines += _struct(f"{prefix}_outputs_t", common("outputs_t"), [_variable_field(v) for v in outputs])
    lines += _struct(f"{prefix}_state", common("state"), [_state_field(s) for s in descriptor.states])
    args = f"{prefix}_state *s, const {prefix}_params *p"
    lines += [
        "/* Parameters and inputs to their defaults. */",
        f"void {prefix}_defaults({prefix}_params *p, {prefix}_inputs *u);",
        "",
        "/* State as before the first sample. */",
        f"void {prefix}_init({args});",
        "",
        "/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */"
        if shared
        else "/* One sample, dt seconds after the one before; dt = 0 takes in the inputs at the start. */",
        f"void {prefix}_update({args}, const {prefix}_inputs *u, ahrs_real dt);",
        "",
        f"void {prefix}_outputs(const {prefix}_state *s, const {prefix}_params *p, {prefix}_outputs_t *y);",
        "",
        "#endif",
        "",
    ]
    return "\n".join(lines)


def _is_common(descriptor: Descriptor, variable: Variable) -> bool:
    return variable not in descriptor.own([variable]) and not variable.optional


def _member(descriptor: Descriptor, variable: Variable) -> str:
    """Path of a variable inside the instance, such as ``params.common.gravity``."""
    part = {"parameter": "params", "input": "inputs", "output": "outputs"}[descriptor.role(variable)]
    flat_inputs = part == "inputs" and not descriptor.own(descriptor.inputs)
    common = "common." if _is_common(descriptor, variable) and not flat_inputs else ""
    return f"{part}.{common}{variable.name}"


def _c_text(text: str) -> str:
    """A string literal; what is not ASCII is written byte by byte."""
    escaped = "".join(
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in text.encode()
    )
    return f'"{escaped}"'


def _c_number(value: float | None, otherwise: str) -> str:
    return otherwise if value is None else repr(float(value))


def _table_row(descriptor: Descriptor, variable: Variable) -> str:
    role = descriptor.role(variable)
    c_role = {"input": "FMU_INPUT", "output": "FMU_OUTPUT"}.get(
        role, "FMU_TUNABLE" if variable.tunable else "FMU_FIXED"
    )
    flags = [
        name
        for name, on in (
            ("FMU_MIN_OPEN", variable.min_open),
            ("FMU_MAX_OPEN", variable.max_open),
            ("FMU_INFINITY_ALLOWED", variable.allow_infinite),
        )
        if on
    ]
    low, high = variable.min, variable.max
    if variable.type == "enumeration":
        values = [item.value for item in descriptor.enumeration_of(variable).items]
        low, high = min(values), max(values)
    elif variable.type == "boolean":
        low, high = 0.0, 1.0
    return (
        f'    {{"{variable.name}", {variable.vr}, {variable.size}, '
        f"offsetof(instance, {_member(descriptor, variable)}), FMU_{variable.type.upper()}, {c_role}, "
        f"{' | '.join(flags) or '0'}, {_c_number(low, '-DBL_MAX')}, {_c_number(high, 'DBL_MAX')}}},"
    )


def _default_lines(descriptor: Descriptor, variable: Variable) -> list[str]:
    target = _member(descriptor, variable).replace("params.", "p->", 1).replace("inputs.", "u->", 1)
    numbers = descriptor.numbers(variable, variable.default)
    literal = [f"AHRS_C({n!r})" if variable.type == "real" else str(int(n)) for n in numbers]
    if variable.size == 1:
        return [f"    {target} = {literal[0]};"]
    return [f"    {target}[{i}] = {text};" for i, text in enumerate(literal)]


def _item_constants(descriptor: Descriptor) -> dict[str, str]:
    shared = descriptor.interface.enumerations if descriptor.interface else {}
    return {
        item.name: constant("ahrs" if name in shared else f"ahrs_{descriptor.name}", name, item.name)
        for name, enumeration in descriptor.enumerations.items()
        for item in enumeration.items
    }


def _limit_lines(descriptor: Descriptor) -> list[str]:
    items = _item_constants(descriptor)
    lines: list[str] = []
    rows: list[str] = []
    for index, limit in enumerate(descriptor.limits):
        rule = Rule(limit.rule)
        parameters = [name for name in rule.names if name not in items]
        vrs = ", ".join(str(descriptor.parameter(name).vr) for name in parameters)
        expression = rule.to_c(
            lambda name: _member(descriptor, descriptor.parameter(name)).replace("params.", "p->"), items
        )
        lines += [
            f"static bool limit_{index}(const void *data) {{",
            f"    const ahrs_{descriptor.name}_params *p = &((const instance *)data)->params;",
            f"    return {expression};",
            "}",
            "",
            f"static const uint32_t limit_{index}_vrs[] = {{{vrs}}};",
            "",
        ]
        rows.append(
            f"    {{{_c_text(limit.rule)}, {_c_text(limit.says)}, {str(limit.warning).lower()}, "
            f"limit_{index}_vrs, {len(parameters)}, limit_{index}}},"
        )
    if rows:
        lines += ["static const fmu_limit limits[] = {", *rows, "};", ""]
    return lines


def model_table(descriptor: Descriptor, *, is_compiled: bool = True) -> str:
    """Text of ``models/NAME/NAME_table.c``: what the FMI layer and the host library need to know.

    Unless `is_compiled` it names no functions of the model, which is computed elsewhere.
    """
    name, prefix = descriptor.name, f"ahrs_{descriptor.name}"
    parts = ", ".join(f"{{offsetof(instance, {m}), sizeof(((instance *)0)->{m})}}" for m in _MEMBERS)
    sample_time = _member(descriptor, descriptor.parameter("sample_time"))
    lines = [
        _NOTICE.format(source=f"models/{name}/{name}.toml"),
        f'#include "{prefix}.h"',
        '#include "model.h"',
        "",
        "#include <string.h>",
        "",
        "typedef struct {",
        *(f"    {prefix}_{member}{'_t' if member == 'outputs' else ''} {member};" for member in _MEMBERS),
        "} instance;",
        "",
        "static const fmu_variable variables[] = {",
        *(_table_row(descriptor, variable) for variable in descriptor.variables),
        "};",
        "",
        *_limit_lines(descriptor),
        f"void {prefix}_defaults({prefix}_params *p, {prefix}_inputs *u) {{",
        "    memset(p, 0, sizeof *p);",
        "    memset(u, 0, sizeof *u);",
        *(
            line
            for v in (*descriptor.parameters, *descriptor.inputs)
            for line in _default_lines(descriptor, v)
        ),
        "}",
        "",
        "static void defaults(void *data) {",
        "    instance *i = data;",
        "    memset(i, 0, sizeof *i);",
        f"    {prefix}_defaults(&i->params, &i->inputs);",
        "}",
        "",
        *(_calls(prefix) if is_compiled else []),
        f"extern const fmu_model {prefix}_model;",
        f"const fmu_model {prefix}_model = {{",
        f'    "{name}", "{descriptor.title}", sizeof(instance), {parts},',
        f"    offsetof(instance, {sample_time}), {descriptor.default_sample_time!r},",
        "    variables, sizeof variables / sizeof variables[0],",
        "    limits, sizeof limits / sizeof limits[0]," if descriptor.limits else "    NULL, 0,",
        f"    defaults, {'init, update, compute_outputs' if is_compiled else 'NULL, NULL, NULL'}}};",
        "",
    ]
    return "\n".join(lines)


def _calls(prefix: str) -> list[str]:
    return [
        "static void init(void *data) {",
        "    instance *i = data;",
        f"    {prefix}_init(&i->state, &i->params);",
        "}",
        "",
        "static void update(void *data, ahrs_real dt) {",
        "    instance *i = data;",
        f"    {prefix}_update(&i->state, &i->params, &i->inputs, dt);",
        "}",
        "",
        "static void compute_outputs(void *data) {",
        "    instance *i = data;",
        f"    {prefix}_outputs(&i->state, &i->params, &i->outputs);",
        "}",
        "",
    ]


def generated() -> dict[Path, str]:
    """Every generated C file of the tree with the text it should have."""
    root = fmu_src()
    files: dict[Path, str] = {}
    for name in descriptors.names():
        descriptor = descriptors.load(name)
        if descriptor.interface is not None:
            shared = descriptor.interface
            files[root / "include" / f"ahrs_{shared.name}.h"] = interface_header(shared)
        files[root / "include" / f"ahrs_{name}.h"] = model_header(descriptor)
        files[root / "models" / name / f"{name}_table.c"] = model_table(descriptor)
    return files


def main() -> None:
    """Write every generated file that is stale."""
    for path, text in generated().items():
        if not path.is_file() or path.read_text() != text:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
            print(f"wrote {path.relative_to(fmu_src())}")


if __name__ == "__main__":
    main()
