"""Send a head tracker's poses on: ours as a source for other programs, or for another machine.

  freelook track send csv:/dev/ttyACM0 --to opentrack://192.168.1.20:4242

The other end is anything that reads OpenTrack's "UDP over network" packets: OpenTrack itself (input
"UDP over network"), or freelook with '--tracker opentrack:0.0.0.0:4242'. Behind each packet stand
its number and time; others do not look at them, freelook counts by them what was lost on the way.
"""

from __future__ import annotations

import argparse
import contextlib
import secrets
import socket
from urllib.parse import urlsplit

from ..errors import TrackerError
from ..rotations import head_angles_deg
from ..trackers.opentrack import DEFAULT_PORT, make_packet
from ..types import Pose
from .track import add_tracker_arguments, watch


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_tracker_arguments(parser)
    parser.add_argument(
        "--to", required=True, metavar="opentrack://HOST:PORT", help="where to send (port: 4242)"
    )


def run(args: argparse.Namespace) -> int:
    with contextlib.closing(PacketSender(*destination(args.to))) as sender:
        return watch(args.tracker, args.seconds, sender)


def destination(url: str) -> tuple[str, int]:
    """(host, port) of `opentrack://HOST[:PORT]`, or TrackerError."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if host is None or parts.scheme != "opentrack" or parts.path.strip("/"):
        raise TrackerError(
            f"'{url}' is not a place poses can be sent to; for example opentrack://127.0.0.1:4242"
        )
    return host, DEFAULT_PORT if port is None else port


class PacketSender:
    """Sends each pose as one datagram. That nobody listens is no error; `failed` counts it."""

    def __init__(self, host: str, port: int) -> None:
        try:
            family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
            self._socket.connect(address)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise TrackerError(f"cannot send to {host} port {port}: {reason}") from None
        self._sequence = secrets.randbits(32)
        self.failed = 0

    def __call__(self, pose: Pose) -> None:
        yaw, pitch, roll = head_angles_deg(pose.body_from_view)
        packet = make_packet(yaw, pitch, roll, self._sequence, pose.t_ns)
        self._sequence += 1
        try:
            self._socket.send(packet)
        except OSError:  # nobody listens there at the moment, or the network is down
            self.failed += 1

    def close(self) -> None:
        self._socket.close()
