"""`--renderer` and `--sampling`: which renderer, asked for or chosen by itself."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from ..renderers.blank import SAMPLINGS
from ._progress import say

if TYPE_CHECKING:
    from ..renderers import Renderer

RENDERERS = ("auto", "cpu", "gl")


def add_renderer_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--renderer",
        choices=RENDERERS,
        default="auto",
        help="cpu, or gl (OpenGL); auto takes gl where there is a real GPU for it",
    )
    add_sampling_argument(parser)


def add_sampling_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--sampling",
        choices=SAMPLINGS,
        default="bilinear",
        help="between pixels; bicubic is sharper where the view enlarges, and slower",
    )


def opened_renderer(args: argparse.Namespace) -> Renderer:
    """Says which and why, where there was anything to choose from."""
    return renderer_maker(args)()


def renderer_maker(args: argparse.Namespace) -> Callable[[], Renderer]:
    """What makes one more of the chosen kind.

    The drivers are asked only where their answer could matter: that takes a moment.
    """
    from ..egl import best_device, may_have_gpu
    from ..renderers.choice import choose, has_moderngl, open_renderer

    ask = args.renderer == "gl" or (args.renderer == "auto" and may_have_gpu())
    choice = choose(args.renderer, best_device() if ask else None, has_moderngl())
    if ask:
        say(f"renderer: {choice}")
    return partial(open_renderer, choice, args.sampling)
