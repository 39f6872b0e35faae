"""The HTTP side of the station: page, WHEP, status and control."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path

from aiohttp import web

from ..errors import TrackerError
from .security import Guard
from .station import ACTIONS, Station, UnknownName
from .whep import Refused

STATIC = Path(__file__).parent / "static"
PACKAGE = Path(__file__).parent.parent
SHARED = {  # what the page and this side read alike, by address
    "/view.glsl": PACKAGE / "renderers" / "view.glsl",
    "/pen.glsl": PACKAGE / "hud" / "pen.glsl",
    "/hud.json": PACKAGE / "hud" / "hud.json",
}
LARGEST_BODY = 64 * 1024
LONGEST_BODY_S = 10.0
RETRY_AFTER_S = "5"

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; media-src 'self' blob:; connect-src 'self'; "
    "manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]
STATION = web.AppKey("station", Station)
GUARD = web.AppKey("guard", Guard)
PAGE = web.AppKey("page", str)


def make_app(station: Station, guard: Guard) -> web.Application:
    """The whole application; starting and closing it starts and closes the station."""
    app = guarded_app(guard, "index.html")
    app[STATION] = station
    app.cleanup_ctx.append(_running_station)
    app.router.add_get("/api/station", _about)
    app.router.add_post("/api/control", _control)
    app.router.add_post("/api/mode", _mode)
    app.router.add_post("/whep", _whep_post)
    app.router.add_options("/whep", _whep_options)
    app.router.add_delete("/whep/{session}", _whep_delete)
    return app


def guarded_app(guard: Guard, page: str) -> web.Application:
    """What all stations share: a page, its files, the headers, and who may come in."""
    app = web.Application(middlewares=[_with_headers, _guarded], client_max_size=LARGEST_BODY)
    app[GUARD] = guard
    app[PAGE] = page
    app.router.add_get("/", _index)
    for address in SHARED:
        app.router.add_get(address, _shared)
    if STATIC.is_dir():
        app.router.add_static("/static/", STATIC)
    return app


async def _running_station(app: web.Application):  # type: ignore[no-untyped-def]
    await app[STATION].start()
    yield
    await app[STATION].close()


@web.middleware
async def _with_headers(request: web.Request, handler: Handler) -> web.StreamResponse:
    try:
        response = await handler(request)
    except web.HTTPException as answer:
        answer.headers.update(HEADERS)
        if isinstance(answer, web.HTTPMethodNotAllowed):
            answer.text = _wrong_method(request, answer)
        raise
    response.headers.update(HEADERS)
    response.headers.setdefault("Cache-Control", "no-cache")
    return response


def _wrong_method(request: web.Request, answer: web.HTTPMethodNotAllowed) -> str:
    allowed = ", ".join(sorted(answer.allowed_methods))
    if request.method == "PATCH":
        return f"trickle ICE is not supported: put all candidates into the offer; use {allowed}\n"
    return f"{request.method} is not possible here; use {allowed}\n"


@web.middleware
async def _guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
    guard = request.app[GUARD]
    if why := guard.foreign(request.host, request.headers.get("Origin")):
        raise web.HTTPForbidden(text=why + "\n")
    if guard.token and not _is_public(request.path):
        given = _bearer(request) if request.path != "/" else request.query.get("token", "")
        if not guard.accepts(given):
            raise web.HTTPUnauthorized(
                text="a token is needed: open the whole address that freelook printed, "
                "or send 'Authorization: Bearer TOKEN'\n",
                headers={"WWW-Authenticate": "Bearer"},
            )
    return await handler(request)


def _is_public(path: str) -> bool:
    """Files of the package: no secret, and browsers load them without our headers."""
    return path.startswith("/static/") or path in SHARED


def _bearer(request: web.Request) -> str:
    kind, _, token = request.headers.get("Authorization", "").partition(" ")
    return token.strip() if kind.lower() == "bearer" else ""


async def _index(request: web.Request) -> web.StreamResponse:
    page = STATIC / request.app[PAGE]
    if not page.is_file():
        raise web.HTTPNotFound(text="the page is missing from this installation of freelook\n")
    return web.Response(
        text=page.read_text("utf-8"),
        content_type="text/html",
        headers={"Cache-Control": "no-store"},
    )


async def _shared(request: web.Request) -> web.StreamResponse:
    return web.Response(text=SHARED[request.path].read_text("utf-8"))


async def _about(request: web.Request) -> web.StreamResponse:
    return web.json_response(request.app[STATION].describe())


async def _control(request: web.Request) -> web.StreamResponse:
    tracker, action = await read_strings(request, "tracker", "action")
    try:
        request.app[STATION].control(tracker, action)
    except UnknownName as error:
        unknown = web.HTTPNotFound if action in ACTIONS else web.HTTPBadRequest
        raise unknown(text=f"{error}\n") from None
    return web.Response(status=204)


async def _mode(request: web.Request) -> web.StreamResponse:
    (mode,) = await read_strings(request, "mode")
    try:
        request.app[STATION].set_mode(mode)
    except UnknownName as error:
        raise web.HTTPBadRequest(text=f"{error}\n") from None
    except TrackerError as error:
        raise web.HTTPConflict(text=f"{error}\n") from None
    return web.Response(status=204)


async def read_strings(request: web.Request, *keys: str) -> list[str]:
    """The texts under these keys of a JSON object; the answer says what is wrong otherwise."""
    _expect_type(request, "application/json")
    try:
        data = json.loads(await _body(request))
    except (ValueError, RecursionError) as error:
        raise web.HTTPBadRequest(text=f"this is not JSON: {error}\n") from None
    values = [data.get(key) if isinstance(data, dict) else None for key in keys]
    if not all(isinstance(value, str) for value in values):
        texts = "texts" if len(keys) > 1 else "text"
        wanted = " and ".join(f'"{key}"' for key in keys)
        raise web.HTTPBadRequest(text=f"expected a JSON object with the {texts} {wanted}\n")
    return [str(value) for value in values]


async def _whep_post(request: web.Request) -> web.StreamResponse:
    _expect_type(request, "application/sdp")
    offer = await _body(request)
    try:
        session, answer = await request.app[STATION].viewers.add(offer)
    except Refused as refused:
        headers = {"Retry-After": RETRY_AFTER_S} if refused.status == 503 else None
        return web.Response(status=refused.status, text=f"{refused}\n", headers=headers)
    return web.Response(
        status=201,
        body=answer.encode(),
        content_type="application/sdp",
        headers={"Location": f"/whep/{session}", "Cache-Control": "no-store"},
    )


async def _whep_options(request: web.Request) -> web.StreamResponse:
    return web.Response(
        status=204, headers={"Accept-Post": "application/sdp", "Allow": "OPTIONS, POST"}
    )


async def _whep_delete(request: web.Request) -> web.StreamResponse:
    if not await request.app[STATION].viewers.remove(request.match_info["session"]):
        raise web.HTTPNotFound(text="there is no such session; it may have ended already\n")
    return web.Response(text="ended\n")


def _expect_type(request: web.Request, wanted: str) -> None:
    if request.content_type != wanted:
        raise web.HTTPUnsupportedMediaType(
            text=f"the Content-Type must be {wanted}, not {request.content_type}\n"
        )


async def _body(request: web.Request) -> str:
    try:
        async with asyncio.timeout(LONGEST_BODY_S):
            return (await request.read()).decode("utf-8")
    except TimeoutError:
        raise web.HTTPRequestTimeout(text="the body did not arrive in time\n") from None
    except UnicodeDecodeError:
        raise web.HTTPBadRequest(text="the body is not UTF-8 text\n") from None
    except web.HTTPRequestEntityTooLarge as error:
        error.text = f"the body must not be larger than {LARGEST_BODY} bytes\n"
        raise
