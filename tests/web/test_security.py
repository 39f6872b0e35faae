"""Host, Origin, token, certificates."""

from __future__ import annotations

import ssl
import stat
from pathlib import Path

import aiohttp
import pytest
from aiohttp import web
from cryptography import x509
from whep_peer import run

from freelook.errors import FreelookError
from freelook.web import security, serving
from freelook.web.security import Guard
from freelook.web.serving import Door, open_door


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path / "freelook"


@pytest.mark.parametrize(
    ("host", "origin", "welcome"),
    [
        ("localhost:8042", None, True),
        ("127.0.0.1:8042", "http://127.0.0.1:8042", True),
        ("[::1]:8042", "http://[::1]:8042", True),
        ("192.0.2.7", None, True),
        ("station:8042", "http://station:8042", True),
        ("evil.example", None, False),
        ("localhost.evil.example", None, False),
        ("", None, False),
        ("[::1", None, False),
        ("127.0.0.1:8042", "http://127.0.0.1:8043", False),
        ("127.0.0.1:8042", "http://evil.example", False),
        ("127.0.0.1:8042", "null", False),
        ("127.0.0.1:8042", "", False),
    ],
)
def test_hosts_and_origins(host: str, origin: str | None, welcome: bool) -> None:
    why = Guard(None, frozenset({"station"})).foreign(host, origin)
    assert (why is None) == welcome


def test_with_a_token_any_name_will_do_but_other_pages_will_not() -> None:
    guard = Guard("secret")
    assert guard.foreign("camera.example", None) is None
    assert guard.foreign("camera.example", "https://evil.example") is not None


@pytest.mark.parametrize(("token", "right"), [("secret", True), ("", False), ("sécret", False)])
def test_tokens(token: str, right: bool) -> None:
    assert Guard("secret").accepts(token) == right


@pytest.mark.parametrize(
    ("host", "private"),
    [("localhost", True), ("127.0.0.1", True), ("::1", True), ("0.0.0.0", False), ("me", False)],
)
def test_what_only_this_machine_reaches(host: str, private: bool) -> None:
    assert security.is_loopback(host) == private


def test_a_private_door_needs_neither_token_nor_tls() -> None:
    door = open_door("127.0.0.1", 0)
    with door.socket:
        port = door.socket.getsockname()[1]
        assert door.urls == [f"http://127.0.0.1:{port}/"]
        assert (door.tls, door.guard.token) == (None, None)


def test_a_public_door_has_a_token_and_tls(state: Path) -> None:
    door = open_door("0.0.0.0", 0)
    with door.socket:
        assert door.tls is not None
        token = door.guard.token
        assert token is not None
        assert len(token) > 15
        assert all(u.startswith("https://") and u.endswith(f"?token={token}") for u in door.urls)


def test_the_certificate_is_made_once_and_its_key_is_private(state: Path) -> None:
    certificate, key = security.own_certificate(state, ["192.0.2.7"])
    made = certificate.read_bytes()
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert security.own_certificate(state, ["192.0.2.7"]) == (certificate, key)
    assert certificate.read_bytes() == made
    names = x509.load_pem_x509_certificate(made).extensions.get_extension_for_class(
        x509.SubjectAlternativeName
    )
    assert "192.0.2.7" in map(str, names.value.get_values_for_type(x509.IPAddress))


def test_a_certificate_that_no_longer_fits_is_made_anew(state: Path) -> None:
    certificate, key = security.own_certificate(state, ["192.0.2.7"])
    made = certificate.read_bytes()
    security.own_certificate(state, ["198.51.100.1"])
    assert certificate.read_bytes() != made
    key.write_text("damaged")
    security.own_certificate(state, ["198.51.100.1"])
    security.tls_context(certificate, key)


def test_certificates_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    with pytest.raises(FreelookError, match=r"missing\.pem"):
        open_door("127.0.0.1", 0, certificate=tmp_path / "missing.pem")
    with pytest.raises(FreelookError, match="--key needs --cert"):
        open_door("127.0.0.1", 0, key=tmp_path / "key.pem")


def test_a_certificate_that_cannot_be_kept(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(FreelookError, match="--cert and --key"):
        security.own_certificate(tmp_path / "file", [])


def test_a_port_in_use_is_named() -> None:
    door = open_door("127.0.0.1", 0)
    with door.socket:
        port = door.socket.getsockname()[1]
        with pytest.raises(FreelookError, match=f"port {port} .* in use .*--port"):
            open_door("127.0.0.1", port)


@pytest.mark.parametrize(
    ("host", "port", "why"),
    [("127.0.0.1", 70000, "0 to 65535"), ("203.0.113.9", 0, "cannot listen on 203.0.113.9")],
)
def test_places_where_nobody_can_listen(host: str, port: int, why: str, state: Path) -> None:
    with pytest.raises(FreelookError, match=why):
        open_door(host, port)


def test_a_browser_that_knows_the_certificate_gets_in(state: Path) -> None:
    async def visit(door: Door) -> tuple[int, int]:
        async def inside(request: web.Request) -> web.Response:
            return web.Response(text="in")

        app = web.Application()
        app.router.add_get("/", inside)
        runner = web.AppRunner(app)
        await runner.setup()
        await web.SockSite(runner, door.socket, ssl_context=door.tls).start()
        trust = ssl.create_default_context(cafile=str(state / "certificate.pem"))
        port = door.socket.getsockname()[1]
        async with (
            aiohttp.ClientSession(connector=aiohttp.TCPConnector(ssl=trust)) as http,
            http.get(f"https://127.0.0.1:{port}/") as by_address,
            http.get(f"https://localhost:{port}/") as by_name,
        ):
            result = by_address.status, by_name.status
        await runner.cleanup()
        return result

    assert run(visit(open_door("127.0.0.1", 0, tls=True))) == (200, 200)


def test_a_browser_is_opened_only_where_there_is_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    assert not serving.can_open_browser()
    monkeypatch.setenv("DISPLAY", ":0")
    assert serving.can_open_browser()
