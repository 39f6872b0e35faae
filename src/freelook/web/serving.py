"""Listening, running until stopped, and what to print about it."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import signal
import socket
import ssl
import sys
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path

from aiohttp import web

from ..errors import FreelookError
from . import security

REPORT_S = 0.5
SHUTDOWN_S = 2.0
ANY_ADDRESS = ("0.0.0.0", "::", "")

Report = Callable[[], None]
Ending = Callable[[], Coroutine[None, None, None]]


@dataclass(frozen=True)
class Door:
    """An open listening socket and who may come in."""

    socket: socket.socket
    guard: security.Guard
    tls: ssl.SSLContext | None
    urls: list[str]


def open_door(
    host: str,
    port: int,
    *,
    token: str | None = None,
    tls: bool = False,
    certificate: Path | None = None,
    key: Path | None = None,
) -> Door:
    """Listen on `host`; anything wider than this machine gets a token and TLS in any case.

    FreelookError says what is in the way: a port in use, an address that is not ours, a
    certificate that cannot be used.
    """
    private = security.is_loopback(host)
    if token is None and not private:
        token = security.make_token()
    listening = _listen(host, port)
    try:
        addresses = _addresses(host)
        context = _tls(tls or not private, addresses, certificate, key)
    except BaseException:
        listening.close()
        raise
    bound_port = listening.getsockname()[1]
    names = frozenset({host.lower(), socket.gethostname().lower()})
    urls = [_url(address, bound_port, context is not None, token) for address in addresses]
    return Door(listening, security.Guard(token, names), context, urls)


async def serve(
    app: web.Application,
    door: Door,
    *,
    ready: Callable[[], None],
    report: Report,
    until: Ending,
) -> None:
    """Run a station's application until `until` is done, or this process is asked to stop.

    `ready` is called once the page can be opened, `report` twice a second from then on.
    """
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=SHUTDOWN_S)
    try:
        await runner.setup()
        await web.SockSite(runner, door.socket, ssl_context=door.tls).start()
        ready()
        await _reporting(report, until)
    finally:
        await runner.cleanup()


async def _reporting(report: Report, until: Ending) -> None:
    ending, asked = ends = (
        asyncio.ensure_future(until()),
        asyncio.ensure_future(_asked_to_stop()),
    )
    try:
        while not any(end.done() for end in ends):
            report()
            await asyncio.wait(ends, timeout=REPORT_S, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for end in ends:
            end.cancel()
        await asyncio.gather(*ends, return_exceptions=True)
    if asked.cancelled():
        ending.result()


async def _asked_to_stop() -> None:
    """Returns at SIGINT or SIGTERM."""
    asked = asyncio.Event()
    loop = asyncio.get_running_loop()
    with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C raises KeyboardInterrupt
        for name in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(name, asked.set)
    await asked.wait()


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(128)
    except (OSError, OverflowError) as error:
        listening.close()
        raise FreelookError(_why_not_listening(host, port, error)) from None
    listening.setblocking(False)
    return listening


def _why_not_listening(host: str, port: int, error: OSError | OverflowError) -> str:
    if isinstance(error, OverflowError):
        return f"there is no port {port}; give one from 0 to 65535 (0: any free one)"
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} on {host} is in use by another program (or another freelook); "
            "choose another with --port, or --port 0 for any free one"
        )
    if error.errno == errno.EACCES:
        return f"port {port} needs special rights; choose one above 1023 with --port"
    return f"cannot listen on {host} port {port}: {error.strerror or error}"


def _addresses(host: str) -> list[str]:
    """Where a browser finds us, the most useful first."""
    if host not in ANY_ADDRESS:
        return [host]
    found = [a for a in security.local_addresses() if host == "::" or ":" not in a]
    return [*found, "127.0.0.1"]


def _tls(
    needed: bool, addresses: list[str], certificate: Path | None, key: Path | None
) -> ssl.SSLContext | None:
    if certificate is not None:
        return security.tls_context(certificate, key)
    if key is not None:
        raise FreelookError("--key needs --cert too")
    if not needed:
        return None
    numbers = [a for a in addresses if security.is_address(a)]
    return security.tls_context(*security.own_certificate(security.state_folder(), numbers))


def _url(address: str, port: int, tls: bool, token: str | None) -> str:
    host = f"[{address}]" if ":" in address else address
    query = f"?token={token}" if token else ""
    return f"{'https' if tls else 'http'}://{host}:{port}/{query}"


def can_open_browser() -> bool:
    """Whether there is a screen to open a browser on."""
    if sys.platform in ("darwin", "win32"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
