"""The directions of imports, checked on the syntax trees (docs/architecture.md)."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "python" / "ahrs_fmu"
MODULES = {
    ".".join(p.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): p
    for p in PACKAGE.rglob("*.py")
}

# A third-party package, and the only places that may import it.
RESTRICTED = {
    "fmpy": ("ahrs_fmu.cosim.fmu", "ahrs_fmu.export"),
    "control": ("ahrs_fmu.analysis",),
    "matplotlib": (
        "ahrs_fmu.benchmark_plots",
        "ahrs_fmu.plots",
        "ahrs_fmu.analysis.plots",
        "ahrs_fmu.cosim.plots",
    ),
    "ctypes": ("ahrs_fmu.native", "ahrs_fmu.cosim.fmu"),
    "distributed": ("ahrs_fmu.campaign.cluster",),
    "plotly": ("ahrs_fmu.campaign.report",),
    "pyarrow": ("ahrs_fmu.campaign.store", "ahrs_fmu.cosim.recording", "ahrs_fmu.records.parquet_file"),
    "typer": ("ahrs_fmu.cli", "ahrs_fmu.commands"),
    "rich": ("ahrs_fmu.cli", "ahrs_fmu.commands"),
}
# What lies inside may not know what lies outside.
OUTSIDE = (
    "ahrs_fmu.cli",
    "ahrs_fmu.commands",
    "ahrs_fmu.export",
    "ahrs_fmu.campaign",
    "ahrs_fmu.cosim",
    "ahrs_fmu.analysis",
    "ahrs_fmu.plots",
)
INSIDE = (
    "descriptors",
    "rules",
    "quaternion",
    "frames",
    "native",
    "estimator",
    "estimate",
    "records",
    "metrics",
    "toolchain",
    "sources",
    "errors",
    "host_library",
    "models",
)


def imports(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            submodules = names & MODULES.keys()
            found |= submodules if submodules == names else {node.module, *submodules}
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "require":
            # An optional dependency, imported by its name.
            found |= {name.value for name in node.args[:1] if isinstance(name, ast.Constant)}
    return found


def is_within(module: str, places: tuple[str, ...]) -> bool:
    return any(module == place or module.startswith(place + ".") for place in places)


def internal(name: str) -> set[str]:
    return {found for found in imports(MODULES[name]) if found in MODULES and found != "ahrs_fmu"}


@pytest.mark.parametrize("library", sorted(RESTRICTED))
def test_a_heavy_library_is_imported_only_where_it_belongs(library: str) -> None:
    users = {
        name for name, path in MODULES.items() if any(is_within(found, (library,)) for found in imports(path))
    }
    assert {name for name in users if not is_within(name, RESTRICTED[library])} == set()


@pytest.mark.parametrize("name", sorted(MODULES))
def test_what_lies_inside_does_not_import_what_lies_outside(name: str) -> None:
    if is_within(name, tuple(f"ahrs_fmu.{inside}" for inside in INSIDE)):
        assert {found for found in internal(name) if is_within(found, OUTSIDE)} == set()


def test_there_is_no_import_cycle() -> None:
    graph = {name: internal(name) - {name} for name in MODULES if name != "ahrs_fmu"}
    while graph:
        free = {name for name, needs in graph.items() if not needs & graph.keys()}
        assert free, f"a cycle among {', '.join(sorted(graph))}"
        graph = {name: needs for name, needs in graph.items() if name not in free}
