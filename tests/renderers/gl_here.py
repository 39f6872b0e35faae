"""OpenGL for tests: on whatever this machine has, mostly Mesa's software; else they are skipped."""

from __future__ import annotations

import pytest

from freelook.errors import MissingExtra, RenderError
from freelook.renderers.blank import Sampling
from freelook.renderers.gl import GlRenderer


def gl_renderer(sampling: Sampling = "bilinear", *, antialias: bool = True) -> GlRenderer:
    try:
        return GlRenderer(sampling=sampling, antialias=antialias)
    except (MissingExtra, RenderError) as error:
        pytest.skip(f"no OpenGL here: {error}")
