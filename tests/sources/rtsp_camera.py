"""A small RTSP camera for tests: one client, H.264 or H.265 over UDP or TCP, scripted faults."""

from __future__ import annotations

import base64
import contextlib
import socket
import threading

from freelook.media.annexb import ParameterSets, split_nals
from freelook.media.rtp_video import RtpVideo
from freelook.types import Counters
from video_streams import rtp_datagrams, sequence_of, with_sequence

INTERVAL_S = 0.002


class RtspCamera:
    """Serves on `port` until `close`. Sends the same pictures over and over, numbered on.

    Faults: `status` answers DESCRIBE with that code; `go_silent_after` packets nothing more is
    sent; `hang_up_after` packets the connection is closed; `refuse_tcp`; `answer` is sent instead
    of any reply; `password` ("user:password") must be given.
    """

    def __init__(
        self,
        codec: str = "h264",
        *,
        status: int = 200,
        go_silent_after: int | None = None,
        hang_up_after: int | None = None,
        refuse_tcp: bool = False,
        answer: bytes | None = None,
        password: str | None = None,
        sdp: str | None = None,
    ) -> None:
        self._codec = codec
        self._status = status
        self._silent = go_silent_after
        self._hang_up = hang_up_after
        self._refuse_tcp = refuse_tcp
        self._answer = answer
        self._password = password
        self._sdp = sdp
        self.methods: list[str] = []
        self._stop = threading.Event()
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def url(self, query: str = "") -> str:
        return f"rtsp://127.0.0.1:{self.port}/cam{query}"

    def close(self) -> None:
        self._stop.set()
        with contextlib.suppress(OSError):
            self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        self._thread.join(5)

    def _serve(self) -> None:
        while not self._stop.is_set():
            try:
                client, _ = self._server.accept()
            except OSError:
                return
            with client, contextlib.suppress(OSError):
                client.settimeout(0.05)
                self._client = client
                self._talk()

    def _talk(self) -> None:
        received = b""
        self._playing = threading.Event()
        self._sender: threading.Thread | None = None
        self._gone = threading.Event()
        try:
            while not self._stop.is_set() and not self._gone.is_set():
                try:
                    piece = self._client.recv(4096)
                except TimeoutError:
                    continue
                if not piece:
                    return
                received += piece
                while b"\r\n\r\n" in received:
                    request, _, received = received.partition(b"\r\n\r\n")
                    self._reply(_without_rtcp(request).decode("latin-1"))
        finally:
            self._gone.set()
            if self._sender is not None:
                self._sender.join(5)

    def _reply(self, request: str) -> None:
        lines = request.splitlines()
        method = lines[0].split()[0]
        headers = {k.lower(): v.strip() for k, _, v in (line.partition(":") for line in lines[1:])}
        self.methods.append(method)
        if self._answer is not None:
            self._client.sendall(self._answer)
            return
        status, extra, body = self._decide(method, headers)
        head = [f"RTSP/1.0 {status} whatever", f"CSeq: {headers['cseq']}", *extra]
        if body:
            head.append(f"Content-Length: {len(body)}")
        self._client.sendall(("\r\n".join(head) + "\r\n\r\n" + body).encode())
        if method == "PLAY" and status == 200:
            self._sender = threading.Thread(target=self._send)
            self._sender.start()

    def _decide(self, method: str, headers: dict[str, str]) -> tuple[int, list[str], str]:
        if self._password is not None:
            wanted = "Basic " + base64.b64encode(self._password.encode()).decode()
            if headers.get("authorization") != wanted:
                return 401, ['WWW-Authenticate: Basic realm="camera"'], ""
        if method == "OPTIONS":
            return 200, ["Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN, GET_PARAMETER"], ""
        if method == "DESCRIBE":
            return self._status, ["Content-Type: application/sdp"], self._describe()
        if method == "SETUP":
            return self._set_up(headers["transport"])
        return 200, ["Session: 4711"], ""

    def _describe(self) -> str:
        if self._sdp is not None:
            return self._sdp
        video = RtpVideo(Counters(), codec=self._codec)
        first = next(u for d in rtp_datagrams(self._codec) for u in video.push(d, 0))
        nals = ParameterSets(self._codec, split_nals(first.data)).nals
        sets = [base64.b64encode(nal).decode() for nal in nals]
        if self._codec == "h264":
            name, parameters = (
                "H264",
                f"packetization-mode=1; sprop-parameter-sets={','.join(sets)}",
            )
        else:
            name = "H265"
            parameters = "; ".join(
                f"sprop-{kind}={text}"
                for kind, text in zip(("vps", "sps", "pps"), sets, strict=True)
            )
        return (
            "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=test\r\nt=0 0\r\na=control:*\r\n"
            f"m=video 0 RTP/AVP 96\r\na=rtpmap:96 {name}/90000\r\na=fmtp:96 {parameters}\r\n"
            "a=control:track1\r\n"
        )

    def _set_up(self, transport: str) -> tuple[int, list[str], str]:
        self._tcp = "TCP" in transport
        if self._tcp and self._refuse_tcp:
            return 461, [], ""
        if not self._tcp:
            ports = transport.partition("client_port=")[2]
            self._target = ("127.0.0.1", int(ports.partition("-")[0]))
        return 200, [f"Transport: {transport}", "Session: 4711;timeout=60"], ""

    def _send(self) -> None:
        datagrams = rtp_datagrams(self._codec)
        first = sequence_of(datagrams[0])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp, contextlib.suppress(OSError):
            sent = 0
            while not self._gone.wait(INTERVAL_S):
                if self._silent is not None and sent >= self._silent:
                    continue
                if self._hang_up is not None and sent >= self._hang_up:
                    self._gone.set()
                    return
                datagram = with_sequence(datagrams[sent % len(datagrams)], first + sent)
                round_ = sent // len(datagrams)
                stamp = int.from_bytes(datagram[4:8], "big") + round_ * 1_000_000
                datagram = datagram[:4] + (stamp & 0xFFFFFFFF).to_bytes(4, "big") + datagram[8:]
                if self._tcp:
                    self._client.sendall(b"$\0" + len(datagram).to_bytes(2, "big") + datagram)
                else:
                    udp.sendto(datagram, self._target)
                sent += 1


def _without_rtcp(request: bytes) -> bytes:
    """A request with the interleaved reports before it taken off."""
    while request[:1] == b"$":
        request = request[4 + int.from_bytes(request[2:4], "big") :]
    return request
