"""What the Modelica libraries take from the descriptors and from the C sources.

``python -m ahrs_fmu.export.modelica`` rewrites ``modelica/AHRS/Parameters.mo`` (the defaults) and
``modelica/AHRSExternal/Resources/Include/ahrs.h`` (the C reference in one header); a test fails when
one of them is stale.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

from ahrs_fmu import descriptors
from ahrs_fmu.descriptors import Descriptor, Variable
from ahrs_fmu.export.amalgamate import amalgamated
from ahrs_fmu.sources import fmu_src

LIBRARY_MODELS = ("attitude_controller", "gcf", "imu", "mahony", "quadrotor")
"""Models that have a twin in the library AHRS."""

_TYPES = {"real": "Real", "integer": "Integer", "boolean": "Boolean"}


def modelica_folder() -> Path:
    """Folder of the Modelica libraries, which are in a checkout only."""
    return fmu_src().parent / "modelica"


def _literal(variable: Variable, number: float) -> str:
    if variable.type == "boolean":
        return "true" if number else "false"
    return str(int(number)) if variable.type == "integer" else repr(number)


def _constant(descriptor: Descriptor, variable: Variable) -> str:
    numbers = [_literal(variable, n) for n in descriptor.numbers(variable, variable.default)]
    size = f"[{variable.size}]" if variable.size > 1 else ""
    value = f"{{{', '.join(numbers)}}}" if variable.size > 1 else numbers[0]
    # The classes that use a constant declare its unit; here it would only be said twice.
    unit = f" [{variable.unit}]" if variable.unit not in ("", "1") else ""
    kind, text = _TYPES[variable.type], f"{variable.description}{unit}"
    return f'    constant {kind} {variable.name}{size} = {value} "{text}";'


def _package(descriptor: Descriptor) -> list[str]:
    page = f"<html><p>Defaults of the model <code>{descriptor.name}</code>.</p></html>"
    return [
        f'  package {descriptor.title} "{descriptor.summary}"',
        "    extends Icons.Package;",
        *(_constant(descriptor, p) for p in descriptor.parameters if p.type in _TYPES),
        f'    annotation(Documentation(info = "{page}"));',
        f"  end {descriptor.title};",
        "",
    ]


def parameters_package() -> str:
    """Text of ``Parameters.mo``."""
    known = [name for name in LIBRARY_MODELS if name in descriptors.names()]
    head = """\
        within AHRS;
        package Parameters "Defaults of the models, generated from their descriptors"
          extends Icons.Package;
    """
    foot = """\
          annotation(Icon(graphics = {
              Line(points = {{-60, 40}, {60, 40}}, color = {80, 80, 80}, thickness = 1.0),
              Line(points = {{-60, -40}, {60, -40}}, color = {80, 80, 80}, thickness = 1.0),
              Ellipse(extent = {{-35, 55}, {-5, 25}}, lineColor = {0, 85, 150}, thickness = 1.0),
              Ellipse(extent = {{15, -25}, {45, -55}}, lineColor = {0, 85, 150}, thickness = 1.0)}),
            Documentation(info = "<html><p>Written by <code>python -m ahrs_fmu.export.modelica</code> from the
        files that the FMUs are built from: change those, not this one.</p></html>"));
        end Parameters;
    """
    packages = [line for name in known for line in _package(descriptors.load(name))]
    return dedent(head) + "\n".join(packages) + "\n" + dedent(foot)


def external_header() -> str:
    """Text of ``ahrs.h``: every estimator in C, and the functions a Modelica tool calls."""
    loaded = [descriptors.load(name) for name in descriptors.names()]
    estimators = [d.name for d in loaded if d.interface is not None and d.interface.name == "estimator"]
    head = """\
        /* The attitude estimators in C, generated from fmu_src by `python -m ahrs_fmu.export.modelica`. */
        #if defined(__clang__)
        #pragma STDC FP_CONTRACT OFF
        #elif defined(__GNUC__)
        #pragma GCC optimize("fp-contract=off")
        #endif
    """
    glue = fmu_src() / "modelica" / "external.h"
    return amalgamated(estimators, dedent(head), glue, outside=["ModelicaUtilities.h"])


def generated() -> dict[Path, str]:
    """Every generated file of the Modelica libraries with the text it should have."""
    root = modelica_folder()
    return {
        root / "AHRS" / "Parameters.mo": parameters_package(),
        root / "AHRSExternal" / "Resources" / "Include" / "ahrs.h": external_header(),
    }


def main() -> None:
    """Write every generated file that is stale."""
    for path, text in generated().items():
        if not path.is_file() or path.read_text() != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            print(f"wrote {path.relative_to(modelica_folder())}")


if __name__ == "__main__":
    main()
