"""A running calibration station whose video and whose target the test makes."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Any

import numpy as np
from aiohttp import web
from whep_peer import ScriptedSource

from board_pictures import Board, Gray, Held
from freelook.calibration.views import View
from freelook.camera import Camera, make_camera
from freelook.clock import now_ns
from freelook.ingest import Ingest
from freelook.lens import KannalaBrandt
from freelook.media.encoder import Encoder
from freelook.types import Frame, Picture
from freelook.web.calibration_plan import Plan, Result, Saved
from freelook.web.calibration_server import make_calibration_app
from freelook.web.calibration_station import CalibrationStation
from freelook.web.security import Guard

FPS = 20
NOISE_PX = 0.05
SIZE = (480, 360)
CAMERA = make_camera(
    SIZE, KannalaBrandt(139.0, -0.01, 0.002, -0.001, 0.0001), center=(241.0, 178.0), field_deg=190
)
BOARD = Board(CAMERA)
MIDDLE = Held((240.0, 180.0), 0.22)
# straight and tilted, in the middle and around: what a calibration needs
PLACES = [
    MIDDLE,
    replace(MIDDLE, tilt_deg=(0.0, -38.0)),
    replace(MIDDLE, tilt_deg=(38.0, 0.0)),
    *(
        Held((float(240 + 110 * np.cos(a)), float(180 + 90 * np.sin(a))), 0.2)
        for a in np.arange(8) * np.pi / 4
    ),
]


@dataclass
class Script:
    """A target that is seen where the test says."""

    view: View | None = None
    fails: bool = False

    def find(self, gray: Gray, name: str) -> View | None:
        if self.fails:
            raise ValueError("the detector broke")
        return self.view and replace(self.view, name=name)


def everywhere_sharp(size: tuple[int, int] = SIZE) -> Gray:
    """An edge near every corner, wherever the script puts it."""
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    return np.where((x // 5 + y // 5) % 2 == 0, 30, 220).astype(np.uint8)


@dataclass
class Desk:
    """Where results are saved."""

    results: list[Result] = field(default_factory=list)
    why_not: str = ""

    def save(self, result: Result) -> Saved:
        self.results.append(result)
        return Saved('{"a": "profile"}\n', self.why_not or "saved on the desk", not self.why_not)


class CalibrationBench:
    """Runs in threads of its own; `with` it."""

    def __init__(self, guard: Guard | None = None, **plan: Any) -> None:
        self.target, self.desk = Script(), Desk()
        self.sources: list[ScriptedSource] = []
        self.gray = everywhere_sharp()
        self.silent = threading.Event()
        self._rng = np.random.default_rng(4)
        self.url = ""
        choices = {"model": "kannala_brandt", "keep_pictures": True, **plan}
        self.station = CalibrationStation(
            Ingest(self._open, retry_s=(0.05, 0.1)),
            Plan("scripted camera", self.target, self.desk.save, **choices),
        )
        self._guard = guard or Guard()
        self._loop = asyncio.new_event_loop()
        self._done, self._ready = threading.Event(), threading.Event()
        self._threads = [
            threading.Thread(target=work, daemon=True) for work in (self._serve, self._film)
        ]

    def __enter__(self) -> CalibrationBench:
        for thread in self._threads:
            thread.start()
        assert self._ready.wait(10)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        self._done.set()
        self.stop()
        for thread in self._threads:
            thread.join(10)

    def stop(self) -> None:
        """The station goes away."""
        if self._loop.is_running():
            self._loop.call_soon_threadsafe(self._loop.stop)

    def see(self, held: Held | None) -> None:
        """What the detector finds from now on, with the same errors every time."""
        self.target.view = None
        if held is not None:
            view = BOARD.view(held)
            errors = self._rng.normal(0, NOISE_PX, view.pixels.shape)
            self.target.view = replace(view, pixels=view.pixels + errors)

    def _open(self) -> ScriptedSource:
        self.sources.append(ScriptedSource())
        return self.sources[-1]

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        runner = self._loop.run_until_complete(self._start())
        self._ready.set()
        self._loop.run_forever()
        self._loop.run_until_complete(runner.cleanup())
        self._loop.close()

    async def _start(self) -> web.AppRunner:
        app = make_calibration_app(self.station, self._guard)
        runner = web.AppRunner(app, shutdown_timeout=0.1)
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        self.url = f"http://127.0.0.1:{runner.addresses[0][1]}/"
        return runner

    def _film(self) -> None:
        """Real coded pictures of `gray`; a new stream whenever its size changes."""
        encoder, source = Encoder(SIZE), None
        while not self._done.wait(1 / FPS):
            if self.silent.is_set() or not self.sources:
                continue
            size = (self.gray.shape[1], self.gray.shape[0])
            new = source is not self.sources[-1] or encoder.size != size
            encoder = Encoder(size, bitrate=4_000_000) if new else encoder
            source = self.sources[-1]
            chroma = np.full((size[1] // 2, size[0] // 2), 128, np.uint8)
            picture = Picture("i420", (self.gray, chroma, chroma))
            for unit in encoder.encode(Frame(picture, now_ns())):
                source.arrive(unit)


def apart_px(found: Camera, truth: Camera) -> float:
    """95th percentile, over the pixels both know, of how far the projections are apart when the
    camera may turn."""
    width, height = truth.size
    y, x = np.mgrid[10:height:20, 10:width:20]
    pixels = np.stack([x.ravel(), y.ravel()], axis=-1).astype(float)
    a, b = truth.ray(pixels), found.ray(pixels)
    both = np.isfinite(a[:, 2]) & np.isfinite(b[:, 2])
    assert both.mean() > 0.6
    u, _, vt = np.linalg.svd(a[both].T @ b[both])
    turned = b[both] @ (u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt).T
    return float(np.nanpercentile(np.linalg.norm(truth.project(turned) - pixels[both], axis=1), 95))
