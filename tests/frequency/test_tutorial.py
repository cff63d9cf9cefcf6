"""The tutorial is a program: it runs, and prints what the page says it prints."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "frequency.md"


@pytest.mark.slow
def test_the_tutorial_prints_what_it_shows_and_draws_its_pictures(tmp_path: Path) -> None:
    page = tmp_path / "docs" / PAGE.name
    page.parent.mkdir()
    page.write_text(PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-W", "error", DOCS / "run_page.py", page],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    shown = "".join(re.findall(r"^```text\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S))
    assert run.stdout == shown
    for picture in re.findall(r"\]\((pictures/.*?)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / picture).is_file()


def test_every_picture_of_the_tutorial_is_there() -> None:
    pictures = re.findall(r"\]\((pictures/.*?)\)", PAGE.read_text(encoding="utf-8"))
    assert len(pictures) >= 5
    assert [p for p in pictures if not (DOCS / p).is_file()] == []
