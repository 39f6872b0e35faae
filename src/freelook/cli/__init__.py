"""The command line: `freelook COMMAND`. One file per command.

A command module has a one-line docstring (its help), `add_arguments(parser)` and
`run(args) -> int`, the exit status. Only this layer prints or exits.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module

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
    parser = argparse.ArgumentParser(
        prog="freelook",
        description="A gimbal with no moving parts: look around in a live fisheye video.",
        epilog="Try 'freelook demo' first, or 'freelook COMMAND --help'.",
    )
    parser.add_argument("--version", action="version", version=f"freelook {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in names:
        module = import_module(f".{name.replace(' ', '_')}", __name__)
        assert module.__doc__
        summary = module.__doc__.strip().splitlines()[0]
        command = commands.add_parser(
            name,
            help=summary,
            description=module.__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """The arguments, understood; commands of two words are joined to the one name they have."""
    two = " ".join(arguments[:2])
    joined = [two, *arguments[2:]] if two in COMMANDS else arguments
    named = [name for name in joined[:1] if name in COMMANDS]
    return make_parser(named or COMMANDS).parse_args(joined)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; errors made on purpose become one line and exit status 2."""
    args = parse(sys.argv[1:] if arguments is None else arguments)
    try:
        return int(args.run(args))
    except ModuleNotFoundError as error:
        if error.name not in EXTRA_OF:
            raise
        return _fail(args.command, MissingExtra(error.name, EXTRA_OF[error.name]))
    except FreelookError as error:
        return _fail(args.command, error)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # `freelook lens list | head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


def _fail(command: str, error: FreelookError) -> int:
    print(f"freelook {command}: {error}", file=sys.stderr)
    return 2
