"""The command line: `freelook COMMAND`. One file per command.

A command module has a one-line docstring (its help), `add_arguments(parser)` and
`run(args) -> int`, the exit status. Only this layer prints or exits.
"""

from __future__ import annotations

import argparse
import ast
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from .. import __version__
from ..errors import FreelookError, MissingExtra

COMMANDS = (
    *("demo", "fly", "snapshot", "render", "simulate", "lens"),
    *("calibrate", "calibrate board", "calibrate lines", "calibrate mount", "calibrate stereo"),
    *("track", "track send"),
    *("duel", "paper", "bench", "doctor"),
)

EXTRA_OF = {
    "aiohttp": "web",
    "aiortc": "web",
    "aiortsp": "rtsp",
    "av": "video",
    "cryptography": "web",
    "evdev": "evdev",
    "ifaddr": "web",
    "imufusion": "imu",
    "cv2": "render",
    "matplotlib": "plot",
    "numba": "render",
    "playwright": "bench",
    "reportlab": "print",
    "rich": "cli",
    "serial": "serial",
}


def make_parser(names: Sequence[str] = COMMANDS) -> argparse.ArgumentParser:
    """For these commands; what they import takes time, all of them half a second."""
    parser, commands = _top()
    for name in names:
        module = import_module(f".{_module_of(name)}", __name__)
        command = commands.add_parser(
            name,
            help=_first_line(module.__doc__),
            description=module.__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


def _overview() -> argparse.ArgumentParser:
    """Which commands there are. They are read, not imported: what one of them needs may be missing
    here."""
    parser, commands = _top()
    for name in COMMANDS:
        spec = find_spec(f".{_module_of(name)}", __name__)
        assert spec
        assert spec.origin
        source = Path(spec.origin).read_text("utf-8")
        commands.add_parser(name, help=_first_line(ast.get_docstring(ast.parse(source))))
    return parser


def _top() -> tuple[argparse.ArgumentParser, argparse._SubParsersAction[argparse.ArgumentParser]]:
    parser = argparse.ArgumentParser(
        prog="freelook",
        description="A gimbal with no moving parts: look around in a live fisheye video.",
        epilog="Try 'freelook demo' first, or 'freelook COMMAND --help'.",
    )
    parser.add_argument("--version", action="version", version=f"freelook {__version__}")
    return parser, parser.add_subparsers(dest="command", metavar="COMMAND", required=True)


def _module_of(name: str) -> str:
    return name.replace(" ", "_")


def _first_line(doc: str | None) -> str:
    assert doc
    return doc.strip().splitlines()[0]


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """The arguments, understood; commands of two words are joined to the one name they have."""
    joined = _joined(arguments)
    if joined and joined[0] in COMMANDS:
        return make_parser(joined[:1]).parse_args(joined)
    return _overview().parse_args(joined)  # help, version, or no command: it ends here


def _joined(arguments: Sequence[str]) -> Sequence[str]:
    two = " ".join(arguments[:2])
    return [two, *arguments[2:]] if two in COMMANDS else arguments


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; errors made on purpose become one line and exit status 2."""
    given = sys.argv[1:] if arguments is None else arguments
    name = next(iter(_joined(given)), "")
    try:
        args = parse(given)
        return int(args.run(args))
    except ModuleNotFoundError as error:
        if error.name not in EXTRA_OF:
            raise
        return _fail(name, MissingExtra(error.name, EXTRA_OF[error.name]))
    except FreelookError as error:
        return _fail(name, error)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # `freelook lens list | head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


def _fail(command: str, error: FreelookError) -> int:
    print(f"freelook {command}: {error}", file=sys.stderr)
    return 2
