"""Compiles view.glsl for desktop GL, once for each set of `#define`s; the page does the same."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEADER = "#version 330 core\n"
VERTEX = (
    HEADER
    + """
void main() {  // one triangle over the whole viewport
    gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1);
}
"""
)

Value = float | int | tuple[float, ...] | NDArray[np.float32]
Uniforms = Mapping[str, Value]


@cache
def body() -> str:
    """The text of view.glsl, which the page gets too."""
    return (Path(__file__).parent / "view.glsl").read_text("utf-8")


class Shaders:
    """The programs of one context."""

    def __init__(self, context: Any) -> None:
        self._context = context
        self._programs: dict[frozenset[str], tuple[Any, Any]] = {}

    def draw(self, defines: Iterable[str], uniforms: Uniforms) -> None:
        """Fill the viewport in use. Matrices are arrays (rows, columns), samplers their units.

        A uniform that the program with these defines does not use is left out.
        """
        key = frozenset(defines)
        if key not in self._programs:
            self._programs[key] = self._build(key)
        program, triangle = self._programs[key]
        for name, value in uniforms.items():
            if name in program:
                _set(program[name], value)
        triangle.render(vertices=3)

    def _build(self, defines: frozenset[str]) -> tuple[Any, Any]:
        head = HEADER + "".join(f"#define {name}\n" for name in sorted(defines))
        program = self._context.program(vertex_shader=VERTEX, fragment_shader=head + body())
        return program, self._context.vertex_array(program, [])


def _set(uniform: Any, value: Value) -> None:
    if isinstance(value, np.ndarray):  # GL wants columns
        uniform.write(np.ascontiguousarray(value.T, np.float32).tobytes())
    else:
        uniform.value = value
