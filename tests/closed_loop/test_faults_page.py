"""What docs/faults.md shows runs, and it names everything there is."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec

from ahrs_fmu import cli
from ahrs_fmu.cosim import running
from ahrs_fmu.cosim.faults import KINDS, Fault

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
COMMON = set(Fault.__struct_fields__)


def example() -> str:
    """The scenario of the page."""
    return re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[0]


def row_of(kind: str) -> list[str]:
    """Cells of a kind in the table."""
    (line,) = re.findall(rf"^\| `{kind}` \|(.*)\|$", PAGE, re.MULTILINE)
    return [cell.strip() for cell in str(line).split("|")]


def test_the_scenario_of_the_page_holds(tmp_path: Path) -> None:
    (tmp_path / "magnet.cosim.toml").write_text(example())
    (outcome,) = running.run_file(tmp_path / "magnet.cosim.toml")
    assert [verdict.value for verdict in outcome.verdicts if not verdict.passed] == []


def test_half_the_severity_is_half_the_magnet(tmp_path: Path) -> None:
    (tmp_path / "magnet.cosim.toml").write_text(example())
    (outcome,) = running.run_file(tmp_path / "magnet.cosim.toml", {"faults.magnet.severity": 0.5})
    # atan(2.5/22.7) = 6.29 deg, of which a first-order filter shows all but a little in eight seconds.
    heading = outcome.recording["attitude_error.heading"]
    assert 6.1 < max(abs(heading)) * 57.29578 < 6.3


def test_the_commands_of_the_page_run(tmp_path: Path) -> None:
    (tmp_path / "magnet.cosim.toml").write_text(example())
    for line in re.findall(r"^ahrs-fmu (.*)$", PAGE, re.MULTILINE):
        words = [str(tmp_path / word) if word.endswith(".toml") else word for word in line.split()]
        # With half the magnet the first expectation fails, and the command says so.
        assert cli.main([*words, "--output", str(tmp_path)]) == ("severity" in line)


def test_every_kind_and_key_is_on_the_page_with_its_default() -> None:
    for kind, cls in KINDS.items():
        keys = row_of(kind)[0]
        fields = [field for field in msgspec.structs.fields(cls) if field.name not in COMMON]
        assert set(re.findall(r"`(\w+)`", keys)) == {field.name for field in fields}
        for field in fields:
            if isinstance(field.default, float):
                assert f"`{field.name}` ({field.default:g})" in keys
    for name in COMMON:
        assert f"| `{name}` |" in PAGE


def test_every_scenario_with_a_fault_is_on_the_page() -> None:
    files = {
        file.name.removesuffix(".cosim.toml"): file.read_text(encoding="utf-8")
        for file in (ROOT / "tests/closed_loop/scenarios").iterdir()
    }
    named = set(re.findall(r"`([\w-]+)`", PAGE.partition("## The weaknesses")[2]))
    assert named <= set(files)
    assert {name for name, text in files.items() if "[faults." in text} <= named
