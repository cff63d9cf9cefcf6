"""Pages with Python are programs: they run, and print what they say they print."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = {"frequency.md": 5, "vehicle.md": 1}
"""How many pictures each draws, at least."""


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_a_page_prints_what_it_shows_and_draws_its_pictures(name: str, tmp_path: Path) -> None:
    page = tmp_path / "docs" / name
    page.parent.mkdir()
    (tmp_path / "tests").symlink_to(DOCS.parent / "tests")
    page.write_text((DOCS / name).read_text(encoding="utf-8"), encoding="utf-8")
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


@pytest.mark.parametrize(("name", "least"), PAGES.items())
def test_every_picture_of_a_page_is_there(name: str, least: int) -> None:
    pictures = re.findall(r"\]\((pictures/.*?)\)", (DOCS / name).read_text(encoding="utf-8"))
    assert len(pictures) >= least
    assert [p for p in pictures if not (DOCS / p).is_file()] == []
