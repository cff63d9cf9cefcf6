"""The command line ``ahrs-fmu``: assembles the commands and turns errors into one line and an exit code."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from ahrs_fmu.commands import (
    benchmark,
    bode,
    build,
    campaign,
    cosim,
    demo,
    design,
    export,
    fmu,
    replay,
    reproduce,
    terminal,
)
from ahrs_fmu.errors import AhrsError
from ahrs_fmu.version import __version__

ERROR = 2
"""Exit code of a command that could not do its work; a check that found something returns 1."""

INTERRUPTED = 130

# Where the base of typer's own errors lives has changed between its versions; a child of it is public.
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]

app = typer.Typer(
    name="ahrs-fmu",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["--help", "-h"], "max_content_width": 100},
)
for command, examples in (
    (build.build, build.EXAMPLES),
    (export.export, export.EXAMPLES),
    (fmu.info, fmu.INFO_EXAMPLES),
    (fmu.validate, fmu.VALIDATE_EXAMPLES),
    (replay.replay, replay.EXAMPLES),
    (bode.bode, bode.EXAMPLES),
    (design.design, design.DESIGN_EXAMPLES),
    (design.allan, design.ALLAN_EXAMPLES),
    (design.explain, design.EXPLAIN_EXAMPLES),
    (cosim.cosim, cosim.EXAMPLES),
    (campaign.campaign, campaign.EXAMPLES),
    (demo.demo, demo.EXAMPLES),
    (reproduce.reproduce, reproduce.EXAMPLES),
    (benchmark.benchmark, benchmark.EXAMPLES),
):
    app.command(epilog=f"\b{examples}")(command)


@app.callback(invoke_without_command=True, epilog="ahrs-fmu COMMAND --help shows examples.")
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    """Attitude estimators as FMI 2.0 and FMI 3.0 co-simulation components."""
    if version:
        terminal.OUT.print(f"ahrs-fmu {__version__}")
    elif context.invoked_subcommand is None:
        terminal.OUT.print(context.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process by default.

    Returns
    -------
    int
        Exit code: 0, 1 when a check found something, 2 after an error, 130 when interrupted.
    """
    try:
        return int(app(arguments, prog_name="ahrs-fmu", standalone_mode=False) or 0)
    except _UsageError as error:
        return _fail(_usage(error))
    except AhrsError as error:
        return _fail(str(error))
    except OSError as error:
        return _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED


def _usage(error: Exception) -> str:
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "ahrs-fmu"
    message = getattr(error, "format_message", lambda: str(error))()
    return f"{message.rstrip('.')}; see {command} --help"


def _fail(message: str) -> int:
    terminal.ERR.print(f"ahrs-fmu: {' '.join(message.split())}")
    return ERROR


if __name__ == "__main__":
    sys.exit(main())
