"""Run the Python blocks of a page as one program: ``python docs/run_page.py docs/frequency.md``."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def program(page: Path) -> str:
    """Join the Python blocks of a page."""
    return "\n".join(_BLOCK.findall(page.read_text(encoding="utf-8")))


def main() -> None:
    """Run the page named on the command line from its own folder, where its pictures belong."""
    page = Path(sys.argv[1]).resolve()
    os.chdir(page.parent)
    exec(compile(program(page), str(page), "exec"), {"__name__": "page"})


if __name__ == "__main__":
    main()
