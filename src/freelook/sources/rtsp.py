"""An RTSP camera or server, by UDP or TCP: `rtsp://user:password@camera/stream?transport=tcp`."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any
from urllib.parse import parse_qsl, unquote, urlencode, urlsplit

from ..addresses import without_password
from ..clock import NS_PER_S, Clock
from ..errors import SourceError
from ..media.rtp_video import RtpVideo
from ..media.sdp import parse_sdp
from ..types import AccessUnit, Counters, Source
from . import check_options, number

KIND = "rtsp"

_OWN_OPTIONS = ("transport", "timeout")  # the rest of the query is the camera's
_PORTS = {"rtsp": 554, "rtsps": 322}
_GOODBYE_S = 0.5


def recognises(argument: str) -> bool:
    return argument.startswith(("rtsp://", "rtsps://"))


def open(
    argument: str, *, loop: bool, pace: bool, clock: Clock, options: Mapping[str, str]
) -> Source:
    """Options: `transport` (udp or tcp; rtsps is always tcp) and `timeout` in seconds (2), of
    silence or of an answer. Connecting happens in `units`."""
    import aiortsp  # noqa: F401 - so that a missing library is told now

    shown = without_password(argument)
    parts = urlsplit(argument)
    query = parse_qsl(parts.query, keep_blank_values=True)
    own = {**options, **{name: value for name, value in query if name in _OWN_OPTIONS}}
    check_options(shown, own, _OWN_OPTIONS)
    transport = own.get("transport", "tcp" if parts.scheme == "rtsps" else "udp")
    if transport not in ("udp", "tcp"):
        raise SourceError(f"{shown}: transport must be udp or tcp, not {transport!r}")
    rest = urlencode([(name, value) for name, value in query if name not in _OWN_OPTIONS])
    url = parts._replace(query=rest).geturl() if rest != parts.query else argument
    return RtspSource(url, transport, number(shown, own, "timeout", 2.0), clock)


class RtspSource:
    """Connects, plays, and receives in the thread that runs `units`.

    SourceError (retry) when the camera cannot be reached, ends the session, or is silent for
    `timeout_s`; no retry when it refuses the password, the transport, or has no H.264 or H.265.
    """

    def __init__(self, url: str, transport: str, timeout_s: float, clock: Clock) -> None:
        self.counters = Counters()
        parts = _checked(url)
        self._url = url
        self._name = f"{parts.scheme}://{parts.hostname}{parts.path}"  # without the password
        self._tcp = transport == "tcp" or parts.scheme == "rtsps"
        self._timeout_s = timeout_s
        self._clock = clock
        self._ready: deque[AccessUnit] = deque()
        self._video: RtpVideo | None = None
        self._closing = False
        self._loop: asyncio.AbstractEventLoop | None = None

    def units(self) -> Iterator[AccessUnit]:
        loop = self._loop = asyncio.new_event_loop()
        loop.set_exception_handler(lambda *_: None)  # the library leaves failed futures behind
        self._news, self._closed = asyncio.Event(), asyncio.Event()
        stack = contextlib.AsyncExitStack()
        try:
            if self._closing or not loop.run_until_complete(self._connect(stack)):
                return
            self._heard_ns = self._clock()
            while not self._closing:
                loop.run_until_complete(self._wait())
                while self._ready and not self._closing:
                    yield self._ready.popleft()
        finally:
            loop.run_until_complete(_quietly(stack.aclose(), _GOODBYE_S))
            loop.run_until_complete(_cancel_rest())
            self._loop = None
            loop.close()

    def close(self) -> None:
        self._closing = True
        loop = self._loop
        if loop is not None:
            with contextlib.suppress(RuntimeError):  # it has just ended by itself
                loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        self._news.set()
        self._closed.set()

    async def _connect(self, stack: contextlib.AsyncExitStack) -> bool:
        """True when playing, False when closed meanwhile."""
        play = asyncio.ensure_future(self._play(stack))
        closed = asyncio.ensure_future(self._closed.wait())
        await asyncio.wait({play, closed}, return_when=asyncio.FIRST_COMPLETED)
        if not play.done():
            play.cancel()
            return False
        closed.cancel()
        try:
            self._connection = play.result()
        except SourceError:
            raise
        except Exception as error:  # the library answers bad input with exceptions of any kind
            raise _readable(self._name, error) from None
        return True

    async def _play(self, stack: contextlib.AsyncExitStack) -> Any:
        from . import _aiortsp

        parts = urlsplit(self._url)
        secure = ssl.create_default_context() if parts.scheme == "rtsps" else None
        connection = await stack.enter_async_context(
            _aiortsp.Connection(
                parts.hostname,
                parts.port or _PORTS[parts.scheme],
                unquote(parts.username or "") or None,
                unquote(parts.password or "") or None,
                logger=_aiortsp.LOGGER,
                timeout=self._timeout_s,
                ssl=secure,
            )
        )
        connection.on_lost = self._news.set
        kind = _aiortsp.TcpTransport if self._tcp else _aiortsp.UdpTransport
        transport = await stack.enter_async_context(
            kind(connection, logger=_aiortsp.LOGGER, timeout=0)
        )
        transport.on_datagram = self._receive
        session = await stack.enter_async_context(
            _aiortsp.Session(connection, self._url, transport, logger=_aiortsp.LOGGER)
        )
        self._describe(session.description)
        await session.play()
        keep_alive = asyncio.ensure_future(_keep_alive(session))
        stack.callback(keep_alive.cancel)
        return connection

    def _describe(self, text: str) -> None:
        try:
            description = parse_sdp(text)
        except SourceError as error:
            raise SourceError(f"{self._name}: {error}") from None
        self._video = RtpVideo(
            self.counters,
            codec=description.codec,
            payload_type=description.payload_type,
            parameter_sets=description.parameter_sets,
        )

    def _receive(self, datagram: bytes) -> None:
        if self._video is None:  # before the session is described nothing is expected
            return
        self._heard_ns = self._clock()
        units = self._video.push(datagram, self._heard_ns)
        if units:
            self._ready.extend(units)
            self._news.set()

    async def _wait(self) -> None:
        """Return when units are ready or the source is closed; SourceError when it is lost."""
        assert self._video is not None
        while not self._ready and not self._closing:
            if not self._connection.running:
                raise SourceError(f"{self._name}: the camera ended the session", retry=True)
            now_ns = self._clock()
            silent_at_ns = self._heard_ns + round(self._timeout_s * NS_PER_S)
            if now_ns >= silent_at_ns:
                hint = "" if self._tcp or self.counters["packets"] else "; try ?transport=tcp"
                raise SourceError(
                    f"{self._name}: nothing came for {self._timeout_s:g} s{hint}", retry=True
                )
            until_ns = min(silent_at_ns, self._video.deadline_ns or silent_at_ns)
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), max(until_ns - now_ns, 0) / NS_PER_S)
            self._news.clear()
            self._ready.extend(self._video.expire(self._clock()))


def _checked(url: str) -> Any:
    try:
        parts = urlsplit(url)
        if not parts.hostname or parts.port == 0:
            raise ValueError("no host, or port 0")
    except ValueError as error:
        raise SourceError(f"not an RTSP address: {error}") from None
    return parts


def _readable(name: str, error: Exception) -> SourceError:
    """What went wrong while connecting, in words."""
    status = getattr(getattr(error, "response", None), "status", None)
    if status in (401, 403):
        return SourceError(f"{name}: wrong user or password (RTSP {status})")
    if status == 461:
        return SourceError(f"{name}: the camera refuses this transport; try ?transport=tcp or udp")
    if status is not None:
        return SourceError(f"{name}: the camera answers RTSP {status}", retry=True)
    cause = error.__cause__ if error.__cause__ is not None else error
    reason = str(cause) or type(cause).__name__
    return SourceError(f"{name}: {reason}", retry=True)


async def _keep_alive(session: Any) -> None:
    while True:
        await asyncio.sleep(max(session.session_keepalive, 1))
        await _quietly(session.keep_alive(), session.session_keepalive)


async def _quietly(step: Any, timeout_s: float) -> None:
    with contextlib.suppress(Exception, asyncio.CancelledError):
        await asyncio.wait_for(step, timeout_s)


async def _cancel_rest() -> None:
    rest = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
    for task in rest:
        task.cancel()
    await asyncio.gather(*rest, return_exceptions=True)
    await asyncio.sleep(0)  # transports close in the next turn of the loop
