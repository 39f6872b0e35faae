"""Draws a HUD's shapes with OpenGL, into the framebuffer and viewport in use."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from ..hud.definition import Theme, pen_source
from ..hud.ink import LETTER, PIECE, Float32s, Ink, Inker
from ..hud.shapes import Shape
from .gl_shader import HEADER

SHEET_UNIT = 7  # behind those of pictures and lenses
NO_VIEWER = (0.0, 0.0)


class GlPen:
    """One theme at one size, in one context, which must be current in all that is called.

    `ratio` is pixels per point. What rests is made once by `ink`, and drawn with every view.
    """

    def __init__(self, context: Any, theme: Theme, ratio: float) -> None:
        self._context, self._theme = context, theme
        self._inker = Inker(theme, ratio)
        self._texture: Any = None
        self._sheets = 0  # in the texture
        self._lines = _Drawn(context, "LINE", PIECE, "4f 1f 4f/i", ("ends", "half_width", "color"))
        self._letters = _Drawn(context, "LETTER", LETTER, "4f 2f 4f/i", ("cell", "corner", "color"))

    def ink(self, shapes: Iterable[Shape]) -> Ink:
        return self._inker.ink(shapes)

    def draw(
        self,
        inks: Sequence[Ink],
        size: tuple[int, int],
        *,
        viewer_k: tuple[float, float] = NO_VIEWER,
        focal_px: float = 0.0,
        shift_px: float = 0.0,
    ) -> None:
        """One after the other, over a view of `size`, the viewport's.

        `viewer_k` (of a view with `focal_px`) and `shift_px` are those of the view (see
        `freelook.window.eyes`).
        """
        context = self._context
        context.enable(context.BLEND)
        context.blend_func = context.SRC_ALPHA, context.ONE_MINUS_SRC_ALPHA
        lens: tuple[float, ...] = (*viewer_k, focal_px if any(viewer_k) else 0.0, shift_px)
        middle = (size[0] / 2, size[1] / 2)
        uniforms: dict[str, Any] = {"canvas": size, "middle": middle, "viewer": lens}
        if any(len(ink.letters) for ink in inks):
            self._sheet_texture().use(SHEET_UNIT)
        for ink in inks:
            self._lines.draw(ink.pieces, uniforms)
            letters = uniforms | {"sheet": SHEET_UNIT, "rim": self._theme.rim}
            self._letters.draw(ink.letters, *(letters | {"under": one} for one in (True, False)))
        context.disable(context.BLEND)

    def release(self) -> None:
        self._lines.release()
        self._letters.release()
        if self._texture is not None:
            self._texture.release()

    def _sheet_texture(self) -> Any:
        """Made anew when there are more sheets than in it."""
        sheets = self._inker.sheets
        if self._sheets != len(sheets):
            if self._texture is not None:
                self._texture.release()
            covered = sheets.together()
            size = (covered.shape[1], covered.shape[0])
            self._texture = self._context.texture(size, 2, covered.tobytes(), alignment=1)
            self._texture.filter = (self._context.NEAREST, self._context.NEAREST)
            self._sheets = len(sheets)
        return self._texture


class _Drawn:
    """A program that draws a square for each row of numbers; its buffer grows as needed."""

    def __init__(
        self, context: Any, kind: str, count: int, form: str, names: tuple[str, ...]
    ) -> None:
        head = f"{HEADER}#define {kind}\n"
        body = pen_source()
        self._context = context
        self._program = context.program(
            vertex_shader=f"{head}#define VERTEX\n{body}",
            fragment_shader=f"{head}#define FRAGMENT\n{body}",
        )
        self._count, self._form, self._names = count, form, names
        self._buffer: Any = None
        self._array: Any = None
        self._room = 0

    def draw(self, rows: Float32s, *passes: dict[str, Any]) -> None:
        """Once for each set of uniforms."""
        if not len(rows):
            return
        if len(rows) > self._room:
            self._grow(len(rows))
        self._buffer.write(rows.tobytes())
        for uniforms in passes:
            for name, value in uniforms.items():
                if name in self._program:
                    self._program[name].value = value
            self._array.render(self._context.TRIANGLE_STRIP, vertices=4, instances=len(rows))

    def _grow(self, count: int) -> None:
        self.release_buffer()
        self._room = 2 * count
        self._buffer = self._context.buffer(reserve=self._room * self._count * 4, dynamic=True)
        self._array = self._context.vertex_array(
            self._program, [(self._buffer, self._form, *self._names)]
        )

    def release_buffer(self) -> None:
        if self._buffer is not None:
            self._array.release()
            self._buffer.release()

    def release(self) -> None:
        self.release_buffer()
        self._program.release()
