from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import pytest

from freelook.datagrams import DatagramListener, listen
from freelook.errors import SourceError


@pytest.fixture
def listener() -> Iterator[DatagramListener]:
    opened = DatagramListener("127.0.0.1", 0)
    yield opened
    opened.close()


def send(port: int, *datagrams: bytes) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for datagram in datagrams:
            sender.sendto(datagram, ("127.0.0.1", port))


def test_datagrams_come_whole_and_in_order(listener: DatagramListener) -> None:
    send(listener.port, b"one", b"", b"x" * 60000)
    assert [listener.receive() for _ in range(3)] == [b"one", b"", b"x" * 60000]


def test_silence_ends_with_the_timeout(listener: DatagramListener) -> None:
    assert listener.receive(0.01) is None
    assert not listener.closed


def test_close_wakes_a_waiting_receiver(listener: DatagramListener) -> None:
    got: list[bytes | None] = []
    waiting = threading.Thread(target=lambda: got.append(listener.receive()))
    waiting.start()
    listener.close()
    waiting.join(5)
    assert got == [None]
    assert listener.receive() is None
    assert listener.closed


def test_close_frees_the_port_at_once(listener: DatagramListener) -> None:
    port = listener.port
    listener.close()
    listener.close()
    DatagramListener("127.0.0.1", port).close()


def test_ipv6_where_there_is_any() -> None:
    try:
        listener = DatagramListener("::1", 0)
    except OSError:
        pytest.skip("no IPv6 here")
    listener.close()


@pytest.mark.parametrize("host", ["203.0.113.9", "no.such.host.invalid"])
def test_an_address_that_cannot_be_used(host: str) -> None:
    with pytest.raises(SourceError, match="camera: ") as caught:
        listen("camera", host, 0)
    assert not caught.value.retry
