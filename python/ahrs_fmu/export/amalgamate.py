"""One header with everything: for tools that compile C but take a single file.

File-scope names of a model are prefixed with the model's name, functions become static, so that the
models live side by side in one translation unit and the header may be included in several.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from ahrs_fmu.errors import BuildError
from ahrs_fmu.host_library import INCLUDE_FOLDERS
from ahrs_fmu.sources import fmu_src

_INCLUDE = re.compile(r'^#include "([^"]+)"\n', re.MULTILINE)
_NOT_CODE = re.compile(r'(/\*.*?\*/|"(?:\\.|[^"\\\n])*")', re.DOTALL)
_STATIC = re.compile(r"^(?:static|AHRS_INLINE)\b[^;={(]*?\b(\w+)\s*(?:\(|\[|=)", re.MULTILINE)
_STATIC_STRUCT = re.compile(r"^static const struct \{.*?^\} (\w+)\[", re.MULTILINE | re.DOTALL)
_TYPE = re.compile(r"^\} (\w+);", re.MULTILINE)
_STRUCT = re.compile(r"^(?:typedef|static const) struct (?:\w+ )?\{.*?^\}", re.MULTILINE | re.DOTALL)
_ENUM = re.compile(r"^enum (?:\w+ )?\{(.*?)\}", re.MULTILINE | re.DOTALL)
_MACRO = re.compile(r"^#define (\w+)", re.MULTILINE)
_PUBLIC_FUNCTION = re.compile(r"^void (ahrs_\w+)\(", re.MULTILINE)
_TABLE_EXTERN = re.compile(r"^extern const fmu_model \w+;\n", re.MULTILINE)
_TABLE = re.compile(r"^const fmu_model (ahrs_\w+) =", re.MULTILINE)


def _find(name: str, beside: Path) -> Path:
    root = fmu_src()
    for folder in (beside, *(root / folder for folder in INCLUDE_FOLDERS)):
        if (folder / name).is_file():
            return folder / name
    raise BuildError(f"{name} is included but is in none of {', '.join(INCLUDE_FOLDERS)}")


def inline(path: Path, done: set[Path], outside: Iterable[str] = ()) -> str:
    """Text of a C file with its own headers in place of their `#include`, each one once.

    Parameters
    ----------
    path : Path
        The file.
    done : set of Path
        The files that are in the text already; grows.
    outside : iterable of str
        Headers that stay included.
    """
    kept = set(outside)

    def body(match: re.Match[str]) -> str:
        if match[1] in kept:
            return match[0]
        header = _find(match[1], path.parent)
        return "" if header in done else inline(header, done, kept)

    done.add(path)
    return _INCLUDE.sub(body, path.read_text())


def _constants(body: str) -> list[str]:
    code = "".join(_NOT_CODE.split(body)[::2])
    return [item.split("=")[0].strip() for item in code.split(",") if item.strip()]


def _local_names(text: str) -> set[str]:
    code = "".join(_NOT_CODE.split(text)[::2])
    names = {
        *_STATIC.findall(code),
        *_STATIC_STRUCT.findall(code),
        *_TYPE.findall(code),
        *_MACRO.findall(code),
    }
    for body in _ENUM.findall(code):
        names.update(_constants(body))
    return names


def _spans(pattern: re.Pattern[str], text: str) -> list[range]:
    return [range(*match.span()) for match in pattern.finditer(text)]


def _prefixed(text: str, prefix: str, names: set[str]) -> str:
    if not names:
        return text
    not_code, structs = _spans(_NOT_CODE, text), _spans(_STRUCT, text)

    # Members keep their names, where they are used and where they are declared.
    def renamed(match: re.Match[str]) -> str:
        at, after = match.start(), text[match.end()]
        declares_member = after in ";,[" and any(at in struct for struct in structs)
        skipped = declares_member or any(at in span for span in not_code)
        return match[0] if skipped else f"{prefix}_{match[0]}"

    return re.sub(rf"(?<![\w.])(?<!->)(?:{'|'.join(sorted(names))})\b", renamed, text)


def _model(name: str, done: set[Path]) -> str:
    folder = fmu_src() / "models" / name
    pieces = []
    for path in (folder / f"{name}.c", folder / f"{name}_table.c"):
        headers = "".join(
            inline(_find(header, folder), done)
            for header in _INCLUDE.findall(path.read_text())
            if _find(header, folder) not in done
        )
        own = _INCLUDE.sub("", path.read_text())
        own = _prefixed(own, name, _local_names(own))
        own = _TABLE.sub(r"static const fmu_model \1 =", _TABLE_EXTERN.sub("", own))
        pieces.append(headers + own)
    return "\n".join(pieces)


def amalgamated(models: Sequence[str], first: str, last: Path, outside: Iterable[str] = ()) -> str:
    """Text of one header.

    Parameters
    ----------
    models : sequence of str
        The models it holds.
    first : str
        What stands at its head.
    last : Path
        A C file that uses the models.
    outside : iterable of str
        Headers that `last` may include from outside.
    """
    done: set[Path] = set()
    pieces = [_model(name, done) for name in models]
    rows = "".join(f"    &ahrs_{name}_model,\n" for name in models)
    listed = f"static const fmu_model *const ahrs_models[] = {{\n{rows}}};\n"
    text = "\n".join([first, *pieces, listed, inline(last, done, outside)])
    return _PUBLIC_FUNCTION.sub(r"static inline void \1(", text)
