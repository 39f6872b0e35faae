"""A station for tests of the page: serves it with any camera, sends no video.

Pictures and station messages are put into the page by its hooks, so every test knows exactly
what the page was given.
"""

from __future__ import annotations

import asyncio
import base64
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from aiohttp import web
from numpy.typing import NDArray

from freelook.camera import Camera
from freelook.types import Picture
from freelook.web.messages import camera_table
from freelook.web.server import HEADERS, SHARED

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "freelook"


class PageStation:
    """Runs in a thread of its own; `camera` and `trackers` may be changed between pages."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        self.trackers: list[str] = []
        self.token: str | None = None
        self.zoom = {"narrowest_deg": 10.0, "widest_deg": 150.0, "focal_px": 1e9}
        self.control_answer = 204
        self.controls: list[dict[str, str]] = []
        self.requests: list[tuple[str, str, str]] = []
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._ready = threading.Event()

    def __enter__(self) -> PageStation:
        self._thread.start()
        assert self._ready.wait(10)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        runner = self._loop.run_until_complete(self._start())
        self._ready.set()
        self._loop.run_forever()
        self._loop.run_until_complete(runner.cleanup())
        self._loop.close()

    async def _start(self) -> web.AppRunner:
        app = web.Application(middlewares=[self._noted])
        app.router.add_get("/", self._index)
        for address in SHARED:
            app.router.add_get(address, self._shared)
        app.router.add_get("/api/station", self._about)
        app.router.add_post("/api/control", self._control)
        app.router.add_post("/api/mode", self._control)
        app.router.add_post("/whep", self._whep)
        app.router.add_static("/static/", PACKAGE / "web" / "static")
        runner = web.AppRunner(app, shutdown_timeout=0.1)
        await runner.setup()
        site = web.TCPSite(runner, "127.0.0.1", 0)
        await site.start()
        self.url = f"http://127.0.0.1:{runner.addresses[0][1]}/"
        return runner

    @web.middleware
    async def _noted(self, request: web.Request, handler: Any) -> web.StreamResponse:
        authorization = request.headers.get("Authorization", "")
        self.requests.append((request.method, request.path, authorization))
        response: web.StreamResponse = await handler(request)
        response.headers.update(HEADERS)  # the real station's: scripts from itself only, ...
        return response

    async def _index(self, request: web.Request) -> web.StreamResponse:
        return web.FileResponse(PACKAGE / "web" / "static" / "index.html")

    async def _shared(self, request: web.Request) -> web.StreamResponse:
        return web.Response(text=SHARED[request.path].read_text("utf-8"))

    async def _about(self, request: web.Request) -> web.StreamResponse:
        if self.token and request.headers.get("Authorization") != f"Bearer {self.token}":
            return web.Response(status=401, text="a token is needed\n")
        about = {
            "version": "0",
            "source": "rtp://127.0.0.1:5004",
            "demo": False,
            "camera": camera_table(self.camera),
            "trackers": self.trackers,
            "hold_s": 1.0,
            "ease_s": 2.0,
            "hfov_deg": 90.0,
            "limit": "black",
            "modes": ["body", "horizon", "world", "follow", "point"],
            "rate_deg_s": 240.0,
            "zoom": self.zoom,
        }
        return web.json_response(about)

    async def _control(self, request: web.Request) -> web.StreamResponse:
        self.controls.append(await request.json())
        text = None if self.control_answer == 204 else "no such tracker\n"
        return web.Response(status=self.control_answer, text=text)

    async def _whep(self, request: web.Request) -> web.StreamResponse:
        return web.Response(
            status=503, text="no video in this test\n", headers={"Retry-After": "3600"}
        )


class PageView:
    """The page through its hooks, in the words of the tests."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def js(self, expression: str, argument: Any = None) -> Any:
        return self.page.evaluate(expression, argument)

    def until(self, expression: str, timeout_s: float = 15.0) -> None:
        """Fails unless this becomes true. (Chromium's own waiting needs eval, which the page's
        security policy forbids.)"""
        deadline = time.monotonic() + timeout_s
        while not self.js(expression):
            assert time.monotonic() < deadline, f"never became true: {expression}"
            self.page.wait_for_timeout(10)

    def put(self, picture: Picture) -> None:
        """Show this picture (i420 or nv12) instead of video."""
        width, height = picture.size
        message = {
            "width": width,
            "height": height,
            "planes": [base64.b64encode(p.tobytes()).decode() for p in picture.planes],
            "matrix": picture.color.matrix,
            "fullRange": picture.color.full_range,
        }
        self.js("picture => freelook.putPicture(picture)", message)

    def set_head(self, yaw_deg: float, pitch_deg: float, roll_deg: float = 0.0) -> None:
        self.js("angles => freelook.setHead(...angles)", [yaw_deg, pitch_deg, roll_deg])

    def set_view(
        self, width: int, height: int, hfov_deg: float, projection: str = "perspective"
    ) -> None:
        view = {"width": width, "height": height, "hfovDeg": hfov_deg, "projection": projection}
        self.js("view => freelook.setView(view)", view)

    def coordinates(self) -> NDArray[np.float32]:
        """(height, width, 4): x, y, t, alpha."""
        data = self.js("freelook.readCoordinates()")
        values = np.frombuffer(base64.b64decode(data["values"]), np.float32)
        return values.reshape(data["height"], data["width"], 4)

    def view(self) -> NDArray[np.uint8]:
        """(height, width, 3), RGB."""
        data = self.js("freelook.readView()")
        values = np.frombuffer(base64.b64decode(data["rgba"]), np.uint8)
        return values.reshape(data["height"], data["width"], 4)[..., :3]

    def head(self) -> tuple[float, float, float]:
        angles = self.js("freelook.stats().angles")
        return angles["yaw"], angles["pitch"], angles["roll"]

    def settles(self) -> None:
        """Wait until no change is being eased any more."""
        self.until("!freelook.app.command.ease.active(performance.now())")

    def stats(self) -> Any:
        return self.js("freelook.stats()")

    def message(self, **message: Any) -> None:
        """As if the station had sent it on the data channel just now."""
        self.js("m => freelook.app.link.receive(JSON.stringify(m), performance.now())", message)

    def shows(self, words: str, timeout_s: float = 5.0) -> None:
        """Fails unless these words become visible on the page."""
        self.page.get_by_text(words).first.wait_for(state="visible", timeout=timeout_s * 1000)
