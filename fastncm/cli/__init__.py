"""The command line: `fastncm scenes`, `solve`, `sweep`, `status`, `compact`, `plot`,
`warmup`.

Heavy imports happen inside the commands, so that --help is quick.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from fastncm.cli import commands
from fastncm.cli.codes import BAD_INPUT, INTERRUPTED
from fastncm.errors import FastNcmError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.command(options))
    except (FastNcmError, OSError) as error:
        print(f"fastncm: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt as stop:
        print(f"fastncm: interrupted; {stop}".removesuffix("; "), file=sys.stderr)
        return INTERRUPTED


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line, as for every other bad input."""
        self.exit(BAD_INPUT, f"fastncm: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="fastncm",
        description="Contact forces of compliant fingers, fast enough for design sweeps.",
        epilog="Exit codes: 0 done; 1 done, but some rows failed; 2 bad input, nothing written; "
        "3 a sweep broke off, its finished parts stay readable; 130 interrupted, likewise.",
    )
    group = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def add(name: str, command: Callable[[argparse.Namespace], int]) -> argparse.ArgumentParser:
        text = command.__doc__
        added = group.add_parser(name, help=text, description=text)
        added.set_defaults(command=command)
        return added

    add("scenes", commands.scenes)
    one = add("solve", commands.solve)
    one.add_argument("scene", metavar="SCENE", help="a shipped scene, or a scene's TOML file")
    one.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change a value, e.g. finger.thickness=0.0042 (repeatable)",
    )
    one.add_argument("--out", type=Path, metavar="FILE", help="write the curve (.csv or .parquet)")
    one.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the curve and the finger")
    many = add("sweep", commands.sweep)
    many.add_argument("study", type=Path, metavar="STUDY.toml")
    many.add_argument("--out", required=True, metavar="DIR", help="folder or URI of the table")
    many.add_argument("--jobs", type=int, metavar="N", help="workers (default: all cores)")
    many.add_argument(
        "--backend", default="loky", metavar="NAME", help="loky (default), threading or dask"
    )
    many.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask cluster, e.g. tcp://10.0.0.1:8786"
    )
    for name in ("status", "compact", "plot"):
        add(name, getattr(commands, name)).add_argument(
            "folder", metavar="DIR", help="a sweep's folder or URI"
        )
    add("warmup", commands.warmup)
    return parser
