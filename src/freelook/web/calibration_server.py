"""The HTTP side of the calibration station: page, newest look, actions, result."""

from __future__ import annotations

import json

from aiohttp import web

from .calibration_station import CalibrationStation
from .security import Guard
from .server import guarded_app, read_strings
from .station import UnknownName

STATION = web.AppKey("calibration station", CalibrationStation)
NEVER_STORED = {"Cache-Control": "no-store"}


def make_calibration_app(station: CalibrationStation, guard: Guard) -> web.Application:
    """The whole application; starting and closing it starts and closes the station."""
    app = guarded_app(guard, "calibrate.html")
    app[STATION] = station
    app.cleanup_ctx.append(_running_station)
    app.router.add_get("/api/calibration", _about)
    app.router.add_get("/api/calibration/newest", _newest)
    app.router.add_get("/api/calibration/result", _result)
    app.router.add_post("/api/calibration/action", _action)
    return app


async def _running_station(app: web.Application):  # type: ignore[no-untyped-def]
    await app[STATION].start()
    yield
    await app[STATION].close()


async def _about(request: web.Request) -> web.StreamResponse:
    return web.json_response(request.app[STATION].describe())


async def _newest(request: web.Request) -> web.StreamResponse:
    """The length of the JSON (4 bytes, big-endian), the JSON, and a JPEG if there is a new one."""
    text = request.query.get("after", "0")
    if not (text.isascii() and text.isdigit()) or len(text) > 15:
        raise web.HTTPBadRequest(text=f"'after' must be the number of a look, not {text[:40]!r}\n")
    after = int(text)
    look = await request.app[STATION].newest(after)
    data = json.dumps(look.data, separators=(",", ":"), allow_nan=False).encode()
    picture = look.picture if look.pictured > after else b""
    return web.Response(
        body=len(data).to_bytes(4, "big") + data + picture,
        content_type="application/octet-stream",
        headers=NEVER_STORED,
    )


async def _result(request: web.Request) -> web.StreamResponse:
    result = request.app[STATION].result
    if result is None:
        raise web.HTTPNotFound(text="the calibration is not finished\n")
    return web.json_response(result, headers=NEVER_STORED)


async def _action(request: web.Request) -> web.StreamResponse:
    (action,) = await read_strings(request, "action")
    try:
        request.app[STATION].act(action)
    except UnknownName as error:
        raise web.HTTPBadRequest(text=f"{error}\n") from None
    return web.Response(status=204)
