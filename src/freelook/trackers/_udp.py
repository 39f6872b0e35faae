"""What trackers that listen for UDP datagrams have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from scipy.spatial.transform import Rotation

from ..clock import Clock
from ..datagrams import DatagramListener
from ..errors import TrackerError
from ..types import Counters, Pose

LOOPBACK = "127.0.0.1"
# More than this waiting at once is a flood, not a tracker; look at it in portions.
LARGEST_BURST = 4096

# (datagram, time of arrival) to the pose in it; None when there is none, counted by the parser
Parse = Callable[[bytes, int], Pose | None]


def parse_address(argument: str, default_port: int) -> tuple[str, int]:
    """(host, port) of `PORT`, `HOST:PORT`, `[IPv6]:PORT` or nothing at all."""
    host, _, port_text = argument.rpartition(":")
    port_text = port_text or str(default_port)
    if not (port_text.isascii() and port_text.isdigit() and int(port_text[:6]) <= 65535):
        raise TrackerError(f"'{argument}' is not a port or host:port; for example {default_port}")
    return host.strip("[]") or LOOPBACK, int(port_text)


def listen(host: str, port: int) -> DatagramListener:
    """A listener, or a TrackerError that says why not."""
    try:
        return DatagramListener(host, port)
    except (OSError, ValueError) as error:  # ValueError: text that cannot be a host's name
        reason = getattr(error, "strerror", None) or error
        raise TrackerError(
            f"cannot listen on UDP {host} port {port}: {reason}; "
            "is another program using the port, or is the address not one of this machine?"
        ) from None


class UdpTracker:
    """A `Tracker` that listens for datagrams; of many that wait only the newest valid one counts.

    Counts `received` datagrams, good or bad, and `dropped` poses that a newer one overtook.
    """

    def __init__(
        self, host: str, port: int, what: str, parse: Parse, counters: Counters, clock: Clock
    ) -> None:
        self._what = what
        self._parse = parse
        self._clock = clock
        self._listener = listen(host, port)
        self.counters = counters
        self.address = (host, self._listener.port)

    @property
    def message(self) -> str:
        host, port = self.address
        return f"waiting for {self._what} packets on UDP {host} port {port}"

    def poses(self) -> Iterator[Pose]:
        while not self._listener.closed:
            pose = self._newest()
            if pose is not None:
                yield pose

    def close(self) -> None:
        self._listener.close()

    def _newest(self) -> Pose | None:
        """Waits for a datagram, then empties the socket; None if nothing in it was valid."""
        newest = None
        datagram = self._listener.receive()
        for _ in range(LARGEST_BURST):
            if datagram is None:
                break
            self.counters.add("received")
            pose = self._parse(datagram, self._clock())
            if pose is not None and newest is not None:
                self.counters.add("dropped")
            newest = pose or newest
            datagram = self._listener.receive(timeout_s=0)
        return newest


def posed(
    parse: Callable[[bytes], Rotation | None],
) -> Parse:
    """A parser for datagrams that carry no time: the pose's time is that of its arrival."""

    def at_arrival(datagram: bytes, arrival_ns: int) -> Pose | None:
        rotation = parse(datagram)
        return None if rotation is None else Pose(rotation, arrival_ns)

    return at_arrival
