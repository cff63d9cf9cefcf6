"""What the commands share: consoles, tables, progress, warnings, and options of the form NAME=VALUE."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import fill

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

OUT = Console(highlight=False, markup=False, soft_wrap=True)
ERR = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)

_WORDS = {"true": True, "false": False}


def table(left: Iterable[str], right: Iterable[str] = ()) -> Table:
    """Make a table with columns aligned to the left, then columns aligned to the right."""
    made = Table(box=SIMPLE_HEAD, pad_edge=False)
    for column in left:
        made.add_column(column, overflow="fold")
    for column in right:
        made.add_column(column, justify="right", no_wrap=True)
    return made


def prose(text: str, indent: int = 0, hanging: int = 0) -> None:
    """Print sentences; a terminal gets lines broken between words, those after the first set in further."""
    first = " " * indent
    if OUT.is_terminal:
        text = fill(text, OUT.width, initial_indent=first, subsequent_indent=first + " " * hanging)
    else:
        text = first + text
    OUT.print(text)


def progress() -> Progress:
    """Make a progress display on the error stream, where it does not mix with results."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=ERR,
        transient=True,
        disable=not ERR.is_terminal,
    )


def warn(message: str) -> None:
    """Print a warning on the error stream."""
    ERR.print(f"warning: {message}", style="yellow")


def assignments(texts: Iterable[str], option: str) -> dict[str, object]:
    """Read options of the form NAME=VALUE; true and false become Booleans, the rest stays text.

    Raises
    ------
    typer.BadParameter
        One of them has no name or no value.
    """
    found: dict[str, object] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise typer.BadParameter(f"{text!r} is not of the form NAME=VALUE", param_hint=option)
        found[name] = _WORDS.get(value.lower(), value)
    return found
