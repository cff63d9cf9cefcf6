"""The Python classes of the estimators, written from the descriptors.

``python -m ahrs_fmu.export.classes`` rewrites ``ahrs_fmu/models.py``; a test fails when it is stale.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap

from ahrs_fmu import descriptors
from ahrs_fmu.descriptors import Descriptor, Variable, range_text

_WIDTH = 106
_HEAD = '''"""The estimators by name, with their parameters.

Generated from the descriptors by ``python -m ahrs_fmu.export.classes``: change those, not this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from ahrs_fmu.estimator import Backend, Estimator
from ahrs_fmu.host_library import Precision
'''


def _estimators() -> list[Descriptor]:
    loaded = [descriptors.load(name) for name in descriptors.names()]
    return [d for d in loaded if d.interface is not None and d.interface.name == "estimator"]


def _annotation(descriptor: Descriptor, variable: Variable) -> str:
    if variable.type == "enumeration":
        items = ", ".join(f'"{name}"' for name in descriptor.enumeration_of(variable).names())
        return f"Literal[{items}]"
    base = {"boolean": "bool", "integer": "int"}.get(variable.type, "float")
    return f"Sequence[{base}]" if variable.size > 1 else base


def _default(variable: Variable) -> str:
    if isinstance(variable.default, list):
        return f"({', '.join(repr(element) for element in variable.default)})"
    if isinstance(variable.default, str):
        return f'"{variable.default}"'
    return repr(float(variable.default)) if variable.type == "real" else repr(variable.default)


def _doc(descriptor: Descriptor, variable: Variable) -> list[str]:
    if variable.type == "enumeration":
        kind = "{" + ", ".join(f'"{name}"' for name in descriptor.enumeration_of(variable).names()) + "}"
    else:
        kind = _annotation(descriptor, variable).lower().replace("[", " of ").replace("]", "")
    unit = f" [{variable.unit}]" if variable.unit not in ("", "1") else ""
    limits = (
        f" Must be {range_text(variable)}." if variable.type == "real" and variable.min is not None else ""
    )
    if variable.allow_infinite:
        limits = limits[:-1] + "; infinity is allowed."
    text = f"{variable.description}{unit}.{limits}"
    return [
        f"    {variable.name} : {kind}, default {_default(variable)}",
        *wrap(text, _WIDTH - 8, initial_indent=" " * 8, subsequent_indent=" " * 8),
    ]


def _class(descriptor: Descriptor) -> list[str]:
    own = descriptor.own(descriptor.parameters)
    parameters = [*own, *(p for p in descriptor.parameters if p not in own)]
    lines = ["", "", f"class {descriptor.title}(Estimator):", f'    """{descriptor.summary}.', ""]
    lines += wrap(descriptor.description, _WIDTH, initial_indent="    ", subsequent_indent="    ")
    lines += ["", "    Parameters", "    ----------"]
    for parameter in parameters:
        lines += _doc(descriptor, parameter)
    lines += ['    precision : {"double", "single"}', "        Floating-point type of the computation."]
    lines += ['    backend : {"c", "numpy"}', "        Who computes: the C code, or its twin in numpy.", ""]
    lines += ["    Raises", "    ------", "    ParameterError"]
    lines += ["        If a value is outside its limits, or values contradict each other.", '    """', ""]
    lines += ["    def __init__(", "        self,", "        *,"]
    lines += [f"        {p.name}: {_annotation(descriptor, p)} = {_default(p)}," for p in parameters]
    lines += ['        precision: Precision = "double",', '        backend: Backend = "c",', "    ) -> None:"]
    lines += ["        super().__init__("]
    lines += [f'            "{descriptor.name}",', "            {"]
    lines += [f'                "{p.name}": {p.name},' for p in parameters]
    lines += ["            },", "            precision,", "            backend,", "        )"]
    return lines


def text() -> str:
    """Text that ``models.py`` should have."""
    estimators = _estimators()
    titles = sorted((d.title for d in estimators), key=lambda title: (not title.isupper(), title))
    names = ", ".join(f'"{title}"' for title in titles)
    lines = [_HEAD, f"__all__ = [{names}]"] if len(names) < _WIDTH else [_HEAD, "__all__ = ["]
    if len(names) >= _WIDTH:
        lines += [*(f'    "{title}",' for title in titles), "]"]
    for descriptor in estimators:
        lines += _class(descriptor)
    lines += ["", "", "BY_NAME: dict[str, type[Estimator]] = {"]
    lines += [*(f'    "{d.name}": {d.title},' for d in estimators), "}"]
    lines += ['"""The classes by the name of their descriptor."""', ""]
    return "\n".join(lines)


def path() -> Path:
    """Where the generated classes are."""
    return Path(__file__).resolve().parents[1] / "models.py"


def main() -> None:
    """Write ``models.py`` if it is stale."""
    if not path().is_file() or path().read_text() != text():
        path().write_text(text())
        print(f"wrote {path().name}")


if __name__ == "__main__":
    main()
