"""The defaults that docs/vehicle.md explains are those of the descriptors."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ahrs_fmu import descriptors

PAGE = Path(__file__).resolve().parents[2] / "docs" / "vehicle.md"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\d.]*[A-Za-z²³/])|-?\d+(?:\.\d+)?(?:e-?\d+)?(?= )")


def rows(model: str) -> list[tuple[list[str], str]]:
    """Parameter names and the text of their defaults, for the section of a model."""
    section = re.split(r"^## \d\. ", PAGE.read_text(), flags=re.MULTILINE)
    text = next(part for part in section if part.startswith(model))
    cells = [line.split("|")[1:3] for line in text.splitlines() if line.startswith("| `")]
    return [(re.findall(r"`(\w+)`", names), default) for names, default in cells]


@pytest.mark.parametrize("model", ["quadrotor", "attitude_controller", "imu"])
def test_the_page_names_the_defaults_of_the_descriptor(model: str) -> None:
    descriptor = descriptors.load(model)
    assert len(rows(model)) >= 6
    for names, text in rows(model):
        parameters = [descriptor.parameter(name) for name in names]
        defaults = [number for p in parameters for number in descriptor.numbers(p, p.default)]
        assert [float(number) for number in NUMBER.findall(text)] == pytest.approx(defaults), names


@pytest.mark.parametrize("model", ["quadrotor", "attitude_controller"])
def test_the_page_explains_every_parameter_that_is_not_a_start_or_a_copy(model: str) -> None:
    told = {name for names, _ in rows(model) for name in names}
    copies = (
        {p.name for p in descriptors.load("quadrotor").parameters}
        if model == "attitude_controller"
        else set()
    )
    untold = {p.name for p in descriptors.load(model).parameters} - told - copies
    assert untold <= {"ground", "initial_position", "initial_velocity", "initial_q", "initial_rate"}
