"""Fixtures of the closed-loop tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from loop_fmus import LoopFmus


@pytest.fixture(scope="session")
def loop_fmu(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopFmus]:
    """The FMUs of the loop."""
    fmus = LoopFmus(tmp_path_factory.mktemp("loop"))
    yield fmus
    fmus.close()
