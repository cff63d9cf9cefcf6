"""The Modelica libraries as two independent compilers see them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

rumoca = pytest.importorskip("rumoca", reason="rumoca is not installed: pip install --group modelica")
pymoca_ast = pytest.importorskip("pymoca.ast", reason="pymoca is not installed: pip install --group modelica")
pymoca_parser = pytest.importorskip("pymoca.parser")

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
MODELICA = ROOT / "modelica"
LIBRARIES = ("AHRS", "AHRSExternal", "AHRSTest")


@dataclass(frozen=True)
class ModelicaClass:
    """One class of a library."""

    name: str
    kind: str
    partial: bool
    description: str
    annotations: frozenset[str]
    bases: tuple[str, ...]
    file: Path

    @property
    def library(self) -> str:
        return self.name.split(".")[0]


@dataclass(frozen=True)
class Simulation:
    """What a simulation gave: time, and the value after any event at that time, for any variable."""

    time: Array
    _columns: dict[str, Array] = field(repr=False)

    def __getitem__(self, name: str) -> Array:
        """A scalar as (N,), or an array as (N, size)."""
        if name in self._columns:
            return self._columns[name]
        size = sum(
            1
            for column in self._columns
            if column.startswith(f"{name}[") and column.count("[") == name.count("[") + 1
        )
        return np.column_stack([self._columns[f"{name}[{i + 1}]"] for i in range(size)])


def _annotation_names(annotation: Any) -> frozenset[str]:
    arguments = getattr(annotation, "arguments", None) or []
    return frozenset(str(argument.value.component.name) for argument in arguments)


def _walk(node: Any, prefix: str, file: Path) -> Iterator[ModelicaClass]:
    name = f"{prefix}.{node.name}" if prefix else node.name
    is_shell = (
        not (node.comment or node.symbols or node.extends or node.equations or node.functions)
        and node.type == "package"
    )
    if not is_shell:
        yield ModelicaClass(
            name, node.type, bool(node.partial), node.comment or "", _annotation_names(node.annotation),
            tuple(str(base.component) for base in node.extends), file,
        )  # fmt: skip
    for child in node.classes.values():
        yield from _walk(child, name, file)


def modelica_files() -> list[Path]:
    return sorted(MODELICA.rglob("*.mo"), key=lambda path: (len(path.parts), path.name != "package.mo", path))


@cache
def parsed() -> tuple[Any, tuple[ModelicaClass, ...]]:
    """Every file through pymoca: one tree, and the classes in it."""
    tree: Any = None
    classes: list[ModelicaClass] = []
    for file in modelica_files():
        part = pymoca_parser.parse(file.read_text())
        assert part is not None, f"pymoca cannot parse {file.relative_to(ROOT)}"
        for library in LIBRARIES:
            if library in part.classes:
                classes += _walk(part.classes[library], "", file)
        if tree is None:
            tree = part
        else:
            tree.extend(part)
    # A class of the language that pymoca parses but does not bring.
    tree.extend(pymoca_parser.parse("partial class ExternalObject end ExternalObject;"))
    return tree, tuple(classes)


@cache
def session() -> Any:
    return rumoca.Session(roots=[str(MODELICA)])


@cache
def compiled(name: str) -> Any:
    """A model through rumoca."""
    return session().load(str(MODELICA / name.split(".")[0] / "package.mo"), model=name)


def experiment(name: str) -> tuple[float, float]:
    """Stop time and interval that a model asks for."""
    file = next(c.file for c in parsed()[1] if c.name == name)
    found = re.search(r"experiment\(StopTime = ([\d.]+), Interval = ([\d.]+)", file.read_text())
    assert found, f"{name} has no experiment"
    return float(found[1]), float(found[2])


@cache
def simulated(name: str) -> Simulation:
    """A model simulated as its experiment says, to high accuracy."""
    stop, interval = experiment(name)
    config = rumoca.SimConfig(solver="rk-like", rtol=1e-10, atol=1e-12, dt=interval)
    result = compiled(name).simulate(t=(0.0, stop), config=config)
    time = np.asarray(result.time)
    last = np.append(np.diff(time) > 1e-9, True)
    return Simulation(time[last], {column: np.asarray(result[column])[last] for column in result.names})
