"""Listening for UDP datagrams: blocks without polling, and can be woken from another thread."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import socket
import struct
import threading
from selectors import EVENT_READ, DefaultSelector

from .errors import SourceError

BUFFER_BYTES = 8 << 20  # asked for; the kernel gives what net.core.rmem_max allows
MAX_DATAGRAM = 65536


class DatagramListener:
    """Receives on `host` and `port`; a multicast group is joined, '' or 0.0.0.0 is every address.

    Port 0 takes a free one. OSError when the address cannot be used.
    """

    def __init__(self, host: str, port: int) -> None:
        family, _, _, _, address = socket.getaddrinfo(
            host or "0.0.0.0", port, type=socket.SOCK_DGRAM, flags=socket.AI_PASSIVE
        )[0]
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._wake, self._waker = socket.socketpair()
        self._lock = threading.Lock()
        self._closed = False
        self._selector = DefaultSelector()
        try:
            self._open(str(address[0]), address)
        except OSError:
            self._release()
            raise
        self._selector.register(self._socket, EVENT_READ)
        self._selector.register(self._wake, EVENT_READ)

    @property
    def port(self) -> int:
        return int(self._socket.getsockname()[1])

    def receive(self, timeout_s: float | None = None) -> bytes | None:
        """The next datagram, None after `timeout_s` or `close`. One thread at a time."""
        with self._lock:
            if self._closed:
                return None
            with contextlib.suppress(BlockingIOError):
                return self._socket.recv(MAX_DATAGRAM)
            ready = self._selector.select(timeout_s)
            if any(key.fileobj is self._wake for key, _ in ready):
                self._release()
            elif ready:
                # even now there may be nothing: a datagram with a bad checksum is thrown away
                with contextlib.suppress(BlockingIOError):
                    return self._socket.recv(MAX_DATAGRAM)
            return None

    @property
    def closed(self) -> bool:
        """True when `close` has taken effect; then `receive` gives None at once."""
        return self._closed

    def close(self) -> None:
        """End `receive`, now or next time; from any thread, more than once."""
        with contextlib.suppress(OSError):
            self._waker.send(b"\0")
        if self._lock.acquire(blocking=False):  # nobody is receiving who would tidy up
            self._release()
            self._lock.release()

    def _open(self, host: str, address: tuple[object, ...]) -> None:
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        group = ipaddress.ip_address(host.split("%")[0])
        if group.is_multicast:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind(address)
        if group.is_multicast:
            self._join(group, address)

    def _join(
        self, group: ipaddress.IPv4Address | ipaddress.IPv6Address, address: tuple[object, ...]
    ) -> None:
        if isinstance(group, ipaddress.IPv4Address):
            member = group.packed + socket.inet_aton("0.0.0.0")
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        else:
            member = group.packed + struct.pack("@I", int(str(address[3])))
            self._socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_JOIN_GROUP, member)

    def _release(self) -> None:
        self._closed = True
        self._selector.close()
        for each in (self._socket, self._wake, self._waker):
            each.close()


def listen(argument: str, host: str, port: int) -> DatagramListener:
    """A listener, or a SourceError that says what to do."""
    try:
        return DatagramListener(host, port)
    except OSError as error:
        reason = error.strerror or str(error)
        if error.errno == errno.EADDRINUSE:
            reason = f"another program already receives on port {port}"
        elif error.errno == errno.EADDRNOTAVAIL:
            reason = f"{host} is not an address of this machine; use 0.0.0.0 for all of them"
        raise SourceError(f"{argument}: {reason}") from None


def free_port() -> int:
    """A UDP port of this machine that nobody listens on at this moment."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
