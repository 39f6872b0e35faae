"""OpenGL for tests: on whatever this machine has, mostly Mesa's software; else they are skipped."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from freelook.errors import MissingExtra, RenderError
from freelook.renderers.blank import Sampling
from freelook.renderers.gl import GlRenderer
from freelook.renderers.gl_context import open_context


def gl_renderer(sampling: Sampling = "bilinear", *, antialias: bool = True) -> GlRenderer:
    try:
        return GlRenderer(sampling=sampling, antialias=antialias)
    except (MissingExtra, RenderError) as error:
        pytest.skip(f"no OpenGL here: {error}")


@contextmanager
def gl_context() -> Iterator[Any]:
    """One without a window, current inside; released at the end."""
    try:
        context = open_context()
    except (MissingExtra, RenderError) as error:
        pytest.skip(f"no OpenGL here: {error}")
    with context:
        yield context
    context.release()
