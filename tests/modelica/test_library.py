"""The libraries as a whole: complete, described, drawn, and accepted by two compilers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from modelica_libraries import (
    LIBRARIES,
    MODELICA,
    ModelicaClass,
    compiled,
    modelica_files,
    parsed,
    pymoca_ast,
    rumoca,
    session,
    simulated,
)
from pymoca import tree as pymoca_tree
from pymoca.parser import ModelicaSyntaxError, parse

REJECTED = sorted((Path(__file__).parent / "rejected").glob("*.mo"))
# What the compiler has to name.
REASONS = {
    "NotModelica": "unexpected `x`",
    "PartialModel": "instantiates partial block 'AHRS.Filters.ContinuousGCF'",
    "TooFewEquations": "unbalanced model",
    "TooManyEquations": "unbalanced model",
    "UnknownClass": "AHRS.Filters.Madgwick",
    "UnknownParameter": "unknown modifier `kd`",
    "WrongConnection": "unbalanced model",
    "WrongDimension": r"expected `\[3\]`, found `\[2\]`",
}


def classes(*kinds: str) -> list[ModelicaClass]:
    return [c for c in parsed()[1] if c.kind in kinds]


def complete_models() -> list[ModelicaClass]:
    return [c for c in classes("model", "block") if not c.partial]


def self_contained() -> list[ModelicaClass]:
    """Models without a call to C, which rumoca does not follow."""
    return [c for c in complete_models() if c.library != "AHRSExternal"]


def runnable() -> list[str]:
    return [c.name for c in self_contained() if "experiment" in c.annotations]


def resolved(name: str, scope: str) -> ModelicaClass | None:
    """The class that `name` means inside the class `scope`."""
    known = {c.name: c for c in parsed()[1]}
    parts = scope.split(".")
    return next(
        (known[f] for n in range(len(parts), -1, -1) if (f := ".".join([*parts[:n], name])) in known), None
    )


def is_drawn(c: ModelicaClass) -> bool:
    bases = (resolved(base, c.name.rpartition(".")[0]) for base in c.bases)
    return "Icon" in c.annotations or any(base is not None and is_drawn(base) for base in bases)


@pytest.mark.parametrize("library", LIBRARIES)
def test_package_order_lists_every_class_once(library: str) -> None:
    for folder in (p.parent for p in MODELICA.glob(f"{library}/**/package.mo")):
        listed = (folder / "package.order").read_text().split()
        package = ".".join(folder.relative_to(MODELICA).parts)
        there = {c.name.removeprefix(f"{package}.") for c in parsed()[1] if c.name.startswith(f"{package}.")}
        assert sorted(listed) == sorted({name.split(".")[0] for name in there}), package


def test_the_users_guide_comes_first() -> None:
    assert (MODELICA / "AHRS" / "package.order").read_text().split()[0] == "UsersGuide"


def test_every_class_says_what_it_is() -> None:
    assert [c.name for c in parsed()[1] if not c.description] == []


def test_every_class_is_documented_and_drawn() -> None:
    pages = [c for c in parsed()[1] if c.kind not in ("type", "connector")]
    assert [c.name for c in pages if "Documentation" not in c.annotations] == []
    exempt = {"AHRSExternal.Instance", "AHRS.Interfaces.IMUSignals"}
    assert [c.name for c in pages if not is_drawn(c) and c.name not in exempt] == []


@pytest.mark.parametrize("library", LIBRARIES)
def test_libraries_have_a_version(library: str) -> None:
    top = next(c for c in parsed()[1] if c.name == library)
    assert "version" in top.annotations


def test_examples_and_test_models_have_an_experiment() -> None:
    examples = [c for c in classes("model") if c.name.startswith(("AHRS.Examples.", "AHRSTest."))]
    assert len(examples) >= 12
    assert [c.name for c in examples if "experiment" not in c.annotations] == []


def test_nothing_depends_on_the_standard_library() -> None:
    code = {file: re.sub(r'"(?:\\.|[^"\\])*"', '""', file.read_text()) for file in modelica_files()}
    assert [file.name for file, text in code.items() if re.search(r"\bModelica\.", text)] == []


def test_links_in_the_documentation_lead_somewhere() -> None:
    known = {c.name for c in parsed()[1]}
    links = {
        link
        for file in modelica_files()
        for link in re.findall(r"modelica://([\w.]+)\\?\"", file.read_text())
    }
    assert links
    assert links - known == set()


@pytest.mark.parametrize("c", complete_models(), ids=lambda c: c.name)
def test_pymoca_flattens_every_model(c: ModelicaClass) -> None:
    flat = pymoca_tree.flatten(parsed()[0], pymoca_ast.ComponentRef.from_string(c.name))
    assert flat.classes[c.name].equations


@pytest.mark.parametrize("c", self_contained(), ids=lambda c: c.name)
def test_rumoca_compiles_every_model(c: ModelicaClass) -> None:
    assert compiled(c.name).name == c.name


def test_every_function_is_used_by_a_model_that_is_simulated() -> None:
    used = "\n".join(file.read_text() for file in modelica_files())
    functions = [c.name.rpartition(".")[2] for c in classes("function") if c.library == "AHRS"]
    assert len(functions) > 15
    assert [
        name for name in functions if len(re.findall(rf"\b{name}\(", used)) < 1 and name != "Function"
    ] == []


@pytest.mark.parametrize("name", runnable())
def test_rumoca_simulates_every_example(name: str) -> None:
    result = simulated(name)
    assert len(result.time) > 10
    assert all(np.isfinite(column).all() for column in result._columns.values())


@pytest.mark.parametrize("file", REJECTED, ids=lambda file: file.stem)
def test_wrong_models_are_rejected_for_the_right_reason(file: Path) -> None:
    with pytest.raises(rumoca.RumocaError, match=REASONS[file.stem]):
        session().loads(file.read_text(), model=file.stem)


def test_the_example_of_the_page_compiles() -> None:
    page = (MODELICA.parent / "docs" / "modelica.md").read_text()
    block = next(
        code for code in re.findall(r"```modelica\n(.*?)```", page, re.DOTALL) if code.startswith("block")
    )
    assert session().loads(block, model="GyroOnly").states.names == ["q"]


def test_pymoca_rejects_what_is_not_modelica() -> None:
    with pytest.raises(ModelicaSyntaxError):
        parse(next(file for file in REJECTED if file.stem == "NotModelica").read_text())
