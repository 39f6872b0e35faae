"""Lens profiles: look at them, compare, convert, make them from what you have.

  freelook lens list                              what is built in, which models and formats
  freelook lens show cam.json                     parameters, field of view, plots
  freelook lens compare old.yaml new.json         how far apart, in pixels and degrees
  freelook lens convert cam.yaml cam.json         from any format to any other
  freelook lens fit points.csv                    from measured angles and pixels
  freelook lens from-circle flight.mp4 --fov 188  from the edge of the image: no board needed

'freelook lens WHAT --help' tells more.
"""

# One file per subcommand; each has a docstring (its help), `add_arguments(parser)` and
# `run(args) -> int`, as commands have.

from __future__ import annotations

import argparse
from importlib import import_module

SUBCOMMANDS = ("list", "show", "compare", "convert", "fit", "focal", "from-circle")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    what = parser.add_subparsers(dest="what", metavar="WHAT", required=True)
    for name in SUBCOMMANDS:
        module = import_module(f".{name.replace('-', '_')}", __name__)
        assert module.__doc__
        command = what.add_parser(
            name,
            help=module.__doc__.strip().splitlines()[0],
            description=module.__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(command)
        command.set_defaults(run_lens=module.run)


def run(args: argparse.Namespace) -> int:
    return int(args.run_lens(args))
