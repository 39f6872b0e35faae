"""A camera in front of which somebody holds a chessboard: real H.264 in real RTP."""

from __future__ import annotations

import threading
from types import TracebackType

import numpy as np

from board_pictures import Board, Gray, Held
from freelook.clock import now_ns
from freelook.sinks import open_sink
from freelook.types import Frame, Picture

FPS = 12
STEPS = 3  # pictures on the way from one place to the next
NOISE = 1.5


class BoardCamera:
    """Streams to `address` from a thread of its own; `hold` moves the board."""

    def __init__(self, board: Board, address: str) -> None:
        self.board = board
        self.paused = threading.Event()
        self._sink = open_sink(address, size=board.camera.size, fps=FPS, bitrate=8_000_000)
        self._ways: list[Gray] = [board.picture(None)]
        self._held: Held | None = None
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> BoardCamera:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        self._done.set()
        self._thread.join(10)
        self._sink.close()

    def hold(self, held: Held | None) -> None:
        """Go there, with some pictures on the way, and stay."""
        way = [] if held is None or self._held is None else between(self._held, held)
        pictures = [self.board.picture(one, NOISE, seed) for seed, one in enumerate([*way, held])]
        self._ways, self._held = pictures, held

    def _run(self) -> None:
        while not self._done.wait(1 / FPS):
            if not self.paused.is_set():
                self._sink.write(Frame(self._picture(), now_ns()))

    def _picture(self) -> Picture:
        ways = self._ways
        gray = ways.pop(0) if len(ways) > 1 else ways[0]
        chroma = np.full((gray.shape[0] // 2, gray.shape[1] // 2), 128, np.uint8)
        return Picture("i420", (gray, chroma, chroma))


def between(here: Held, there: Held) -> list[Held]:
    """Places on the way, without the ends."""
    shares = np.linspace(0, 1, STEPS + 2)[1:-1]
    return [
        Held(
            (
                here.at[0] + share * (there.at[0] - here.at[0]),
                here.at[1] + share * (there.at[1] - here.at[1]),
            ),
            here.distance + share * (there.distance - here.distance),
            there.tilt_deg,
            there.roll_deg,
        )
        for share in shares
    ]
