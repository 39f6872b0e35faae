"""aiortsp's classes with the few holes closed that freelook needs: raw packets, raw SDP."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

from aiortsp.rtsp.connection import RTSPConnection
from aiortsp.rtsp.errors import RTSPConnectionError
from aiortsp.rtsp.session import RTSPMediaSession
from aiortsp.transport import TCPTransport, UDPTransport

LOGGER = logging.getLogger("freelook.rtsp")
LOGGER.addHandler(logging.NullHandler())
LOGGER.propagate = False  # what matters is raised; the library logs the rest as errors


def _nothing(*_: object) -> None:
    pass


class Connection(RTSPConnection):
    """Ends the connection on data that is not RTSP, and says when it is lost."""

    on_lost: Callable[[], None] = _nothing

    def data_received(self, data: bytes) -> None:
        try:
            for message in self.parser.parse(data):
                self._dispatch(message)
        except Exception as error:
            self._fail(error)

    def _dispatch(self, message: Any) -> None:
        if message.type == "binary":
            self.on_binary(message)
        elif message.type == "request":
            self.on_request(message)
        else:
            pending = self.active_requests.get(message.cseq)
            if pending is not None and not pending.done():
                pending.set_result(message)

    def _fail(self, error: Exception) -> None:
        if not self.result.done():
            reason = RTSPConnectionError("the camera sent something that is not RTSP")
            reason.__context__ = error
            self.result.set_exception(reason)
        if self._transport:
            self._transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self.on_lost()


class _RawPackets:
    """Hands each RTP datagram on as it came; the library keeps its statistics for RTCP."""

    on_datagram: Callable[[bytes], None] = _nothing

    def handle_rtp_data(self, data: bytes) -> None:
        self.on_datagram(bytes(data))
        try:
            super().handle_rtp_data(data)  # type: ignore[misc]
        except Exception:
            LOGGER.debug("not RTP: %d bytes", len(data))

    def handle_rtcp_data(self, data: bytes) -> None:
        try:
            super().handle_rtcp_data(data)  # type: ignore[misc]
        except Exception:
            LOGGER.debug("not RTCP: %d bytes", len(data))


class TcpTransport(_RawPackets, TCPTransport):
    pass


class UdpTransport(_RawPackets, UDPTransport):
    pass


class Session(RTSPMediaSession):
    """Keeps the text of the session description."""

    description = ""

    async def _send(
        self, method: str, url: str | None = None, headers: dict[str, Any] | None = None
    ) -> Any:
        response = await super()._send(method, url, headers)
        if method == "DESCRIBE":
            self.description = response.content
        return response
