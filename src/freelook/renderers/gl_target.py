"""What off-screen views are drawn into and read back from."""

from __future__ import annotations

from typing import Any

import numpy as np

KINDS = {"f1": np.uint8, "f4": np.float32}


class Target:
    """A framebuffer of its own; `kind` f1 is bytes for 0 to 1, f4 float32."""

    def __init__(self, context: Any, size: tuple[int, int], count: int, kind: str) -> None:
        self._size, self._count, self._kind = size, count, kind
        self._texture = context.texture(size, count, dtype=kind)
        self._frame = context.framebuffer([self._texture])

    def use(self) -> None:
        """Draw into it from now on."""
        self._frame.use()

    def read(self) -> Any:
        """What was drawn, (height, width) or (height, width, count); the first row is that of
        gl_FragCoord.y = 0.5. Waits until it is there."""
        width, height = self._size
        shape = (height, width, self._count) if self._count > 1 else (height, width)
        values = np.empty(shape, KINDS[self._kind])
        self._frame.read_into(values, components=self._count, alignment=1, dtype=self._kind)
        return values

    def release(self) -> None:
        self._frame.release()
        self._texture.release()


class Targets:
    """Those for views of one size, kept from view to view."""

    def __init__(self, context: Any) -> None:
        self._context = context
        self._view_size = (0, 0)
        self._targets: dict[tuple[int, int, int, str], Target] = {}

    def used(
        self,
        view_size: tuple[int, int],
        *,
        number: int = 0,
        scale: int = 1,
        count: int = 1,
        kind: str = "f1",
    ) -> Target:
        """For plane `number` of a view, `scale` times smaller than it; drawn into from now on."""
        if view_size != self._view_size:
            self.release()
            self._view_size = view_size
        key = (number, scale, count, kind)
        if key not in self._targets:
            size = (-(-view_size[0] // scale), -(-view_size[1] // scale))
            self._targets[key] = Target(self._context, size, count, kind)
        self._targets[key].use()
        return self._targets[key]

    def release(self) -> None:
        for target in self._targets.values():
            target.release()
        self._targets = {}
