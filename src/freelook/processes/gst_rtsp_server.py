"""Run by the system's Python, whose `gi` has GStreamer: serves one coded stream by RTSP.

    python3 gst_rtsp_server.py HOST PORT PATH h264|hevc      (pictures: see sinks/_child.py)

With FREELOOK_RTSP_USER and FREELOOK_RTSP_PASSWORD in the environment only who knows them may see
anything. Needs nothing of freelook.
"""

from __future__ import annotations

import os
import struct
import sys
import threading
from typing import Any, BinaryIO

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstApp", "1.0")
gi.require_version("GstRtsp", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstApp, GstRtsp, GstRtspServer  # noqa: E402

HEADER = struct.Struct(">QBI")
LARGEST = 64 << 20
KINDS = {"h264": ("video/x-h264", "rtph264pay"), "hevc": ("video/x-h265", "rtph265pay")}
LAUNCH = (
    "( appsrc name=pictures is-live=true format=time do-timestamp=true block=false max-bytes=0 "
    "caps={caps},stream-format=byte-stream,alignment=au "
    "! {payloader} name=pay0 pt=96 config-interval=-1 )"
)
MOST_CLIENTS = 32  # connections at a time: a pipeline for each is not for nothing
ROLE = "viewer"
MOST_WAITING_BYTES = 1_000_000  # for one viewer; what he does not take in time is thrown away


class Served:
    """Every viewer has a pipeline of his own: one who stalls holds up nobody else. His pictures
    begin with a key picture, also after some were thrown away."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._need_key: dict[Any, bool] = {}
        self._begun: set[Any] = set()
        self._clients = 0

    def configured(self, _factory: Any, media: Any) -> None:
        source = media.get_element().get_child_by_name("pictures")
        media.connect("unprepared", lambda _media: self._forget(source))
        with self._lock:
            self._need_key[source] = True
        tell("key")

    def connected(self, _server: Any, client: Any) -> None:
        if self._clients >= MOST_CLIENTS:
            tell("refused")
            client.close()
            return
        self._count(1)
        client.connect("play-request", lambda *_: tell("key"))
        client.connect("closed", lambda _client: self._count(-1))

    def push(self, data: bytes, key: bool) -> None:
        with self._lock:
            sources = list(self._need_key.items())
        for source, need_key in sources:
            late = source.get_property("current-level-bytes") > MOST_WAITING_BYTES
            taken = not late and (key or not need_key)
            if taken:  # unless the viewer's pipeline does not run yet
                flow = source.emit("push-buffer", Gst.Buffer.new_wrapped(data))
                taken = flow == Gst.FlowReturn.OK
            with self._lock:
                if source in self._need_key:
                    self._need_key[source] = not taken
                    if taken:
                        self._begun.add(source)
                    elif source in self._begun:
                        tell("unread")

    def _forget(self, source: Any) -> None:
        with self._lock:
            self._need_key.pop(source, None)
            self._begun.discard(source)

    def _count(self, change: int) -> None:
        self._clients += change
        tell(f"clients {self._clients}")


def protect(server: Any, factory: Any, user: str, password: str) -> None:
    """By digest: the password itself does not cross the network."""
    token = GstRtspServer.RTSPToken()
    token.set_string(GstRtspServer.RTSP_TOKEN_MEDIA_FACTORY_ROLE, ROLE)
    auth = GstRtspServer.RTSPAuth()
    auth.set_supported_methods(GstRtsp.RTSPAuthMethod.DIGEST)
    auth.add_digest(user, password, token)
    server.set_auth(auth)
    may = GstRtspServer.RTSPPermissions()
    may.add_permission_for_role(ROLE, GstRtspServer.RTSP_PERM_MEDIA_FACTORY_ACCESS, True)
    may.add_permission_for_role(ROLE, GstRtspServer.RTSP_PERM_MEDIA_FACTORY_CONSTRUCT, True)
    factory.set_permissions(may)


def tell(words: str) -> None:
    os.write(1, f"{words}\n".encode())


def feed(served: Served, pipe: BinaryIO, end: Any) -> None:
    while len(header := pipe.read(HEADER.size)) == HEADER.size:
        _, key, length = HEADER.unpack(header)
        if length > LARGEST:
            break
        served.push(pipe.read(length), bool(key))
    end()


def main(host: str, port: str, path: str, codec: str) -> int:
    Gst.init(None)
    caps, payloader = KINDS[codec]
    server, served = GstRtspServer.RTSPServer(), Served()
    server.set_address(host)
    server.set_service(port)
    server.set_backlog(MOST_CLIENTS)
    factory = GstRtspServer.RTSPMediaFactory()
    factory.set_launch(LAUNCH.format(caps=caps, payloader=payloader))
    factory.set_shared(False)
    factory.set_latency(0)
    if user := os.environ.get("FREELOOK_RTSP_USER"):
        protect(server, factory, user, os.environ["FREELOOK_RTSP_PASSWORD"])
    factory.connect("media-configure", served.configured)
    server.connect("client-connected", served.connected)
    server.get_mount_points().add_factory(path, factory)
    if not server.attach(None):
        print(f"cannot listen at {host}, port {port}: another program may be", file=sys.stderr)
        return 1
    loop = GLib.MainLoop()
    threading.Thread(target=feed, args=(served, sys.stdin.buffer, loop.quit), daemon=True).start()
    # those that vanished without a word are forgotten
    GLib.timeout_add_seconds(5, lambda: server.get_session_pool().cleanup() >= 0)
    tell("ready")
    loop.run()
    return 0


assert GstApp  # makes appsrc's signals known

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
