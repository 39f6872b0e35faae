"""MPEG-TS over UDP, as many encoders send it: `udp://HOST:PORT` to listen on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ..clock import Clock
from ..datagrams import DatagramListener, listen
from ..errors import SourceError
from ..media.mpegts import TransportStream
from ..types import AccessUnit, Counters, Source
from . import split_url

KIND = "mpegts"


def recognises(argument: str) -> bool:
    return argument.startswith("udp://")


def open(
    argument: str, *, loop: bool, pace: bool, clock: Clock, options: Mapping[str, str]
) -> Source:
    """Listen; a multicast group is joined. There are no options."""
    host, port, _ = split_url(argument, options, ())
    if port is None:
        raise SourceError(f"{argument}: write the port to listen on, as in udp://0.0.0.0:1234")
    return TransportStreamSource(argument, listen(argument, host, port), clock)


class TransportStreamSource:
    """The first video of the transport stream that comes to one port.

    Silence is no error: it listens until the sender is back. SourceError when the stream holds
    no video that can be decoded here.
    """

    def __init__(self, name: str, listener: DatagramListener, clock: Clock) -> None:
        self.counters = Counters()
        self._name = name
        self._listener = listener
        self._clock = clock

    @property
    def port(self) -> int:
        """The UDP port listened on."""
        return self._listener.port

    def units(self) -> Iterator[AccessUnit]:
        stream = TransportStream(self.counters)
        try:
            while not self._listener.closed:
                datagram = self._listener.receive()
                if datagram is None:
                    continue
                yield from stream.push(datagram, self._clock())
                if stream.problem:
                    raise SourceError(f"{self._name}: {stream.problem}", retry=True)
        finally:
            self.close()

    def close(self) -> None:
        self._listener.close()
