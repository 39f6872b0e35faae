"""The JSON messages between page and station, on the data channel "head"."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..gimbal import BODY, Aim, Base, ZoomLimits, most_focal_px, zoom_limits
from ..head import HeadStatus
from ..ingest import IngestStatus
from ..projections import PROJECTIONS
from ..rotations import FRD_FROM_RDF, RDF_FROM_FRD, to_wxyz
from ..session import camera_from_head
from ..types import Counters
from ..vehicle import VehicleStatus

if TYPE_CHECKING:
    from ..outputs.runner import OutputStatus

LONGEST_MESSAGE = 1000
NS_PER_MS = 1e6


def read_ping(message: object) -> float | None:
    """The time in a ping; None for anything else a page, or somebody else, may send."""
    if not isinstance(message, str) or len(message) > LONGEST_MESSAGE:
        return None
    try:
        data = json.loads(message)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict) or data.get("type") != "ping":
        return None
    time_ms = data.get("t")
    if isinstance(time_ms, bool) or not isinstance(time_ms, (int, float)):
        return None
    return time_ms if abs(time_ms) < 1e15 else None


def pong(time_ms: float, now_ns: int) -> str:
    return text({"type": "pong", "t": time_ms, "ns": now_ns})


def pose(tracker: str, aim: Aim, now_ns: int) -> str:
    """Where a head looks, as head_from_view; (1, 0, 0, 0) is straight ahead.

    A stabilised aim is told in parts, because the page knows better which frame it shows: the view
    is left * base * q, with the base of that frame, and "left" what is left of an earlier aim.
    """
    message = {
        "type": "pose",
        "tracker": tracker,
        "q": to_wxyz(RDF_FROM_FRD * aim.body_from_view),
        "state": aim.state,
        "t": aim.pose_ns,
        "sent": now_ns,
    }
    if aim.stabilised and aim.base.turned:
        message["q"] = to_wxyz(RDF_FROM_FRD * aim.head)
        message["left"] = _in_head_axes(aim.leftover)
        message["based"] = True
    return text(message)


def frame(
    rtp: int, capture_ns: int, base: Base = BODY, world_from_body: Rotation | None = None
) -> str:
    """When a frame came, and the base in which heads turn while it is shown; none in body mode.
    Also the vehicle's attitude then, where that is known: in head axes, north ahead."""
    message: dict[str, Any] = {"type": "frame", "rtp": rtp, "arrival": capture_ns}
    if base.turned:
        message["base"] = _in_head_axes(base.body_from_base)
    if world_from_body is not None:
        message["world"] = _in_head_axes(world_from_body)
    return text(message)


def _in_head_axes(body_rotation: Rotation) -> list[float]:
    """A rotation of the body, in the axes of a head that looks straight ahead."""
    turned = RDF_FROM_FRD * body_rotation * FRD_FROM_RDF
    return [round(value, 7) for value in to_wxyz(turned)]


def status(
    source: dict[str, Any],
    trackers: Iterable[HeadStatus],
    viewers: int,
    vehicle: VehicleStatus | None = None,
    recordings: Iterable[dict[str, Any]] = (),
) -> dict[str, Any]:
    message: dict[str, Any] = {
        "type": "status",
        "source": source,
        "trackers": [_tracker(tracker) for tracker in trackers],
        "viewers": viewers,
        "recordings": list(recordings),
    }
    if vehicle is not None:
        message["vehicle"] = {
            "mode": vehicle.mode,
            "effective": vehicle.effective,
            "state": vehicle.state,
            "message": vehicle.message,
            "received": vehicle.received,
            "counters": vehicle.counters,
            "offset": vehicle.offset,
        }
    return message


def recording(output: OutputStatus) -> dict[str, Any]:
    """A video file that is being written, or was."""
    return {
        "name": output.name,
        "state": output.state,
        "message": output.message,
        "shown": output.counters.get("shown", 0),
    }


def source_status(
    ingest: IngestStatus, why_transcode: str | None, trouble: str | None, counters: dict[str, int]
) -> dict[str, Any]:
    stream = ingest.stream
    return {
        "state": ingest.state,
        "message": ingest.message or trouble,
        "age_ms": milliseconds(ingest.age_ns),
        "codec": stream.codec if stream else None,
        "size": [stream.width, stream.height] if stream and stream.width else None,
        "transcoding": why_transcode,
        "counters": counters,
    }


def camera_table(camera: Camera) -> dict[str, Any]:
    """What the page's shader needs of a camera; rays come in head-neutral axes (RDF)."""
    return {
        "size": list(camera.size),
        "center": list(camera.center),
        "stretch": camera.stretch.tolist(),
        "t_max": camera.table.t_max,
        "g": [float(value) for value in camera.table.g],
        "offsets": _offsets(camera),
        "camera_from_head": camera_from_head(camera).as_matrix().tolist(),
    }


def _offsets(camera: Camera) -> dict[str, Any] | None:
    """The grid of a lens that is not round: rows of x, y pairs, one number after the other."""
    if camera.grid is None:
        return None
    return {
        "p_max": camera.grid.p_max,
        "size": len(camera.grid.offsets),
        "values": [round(float(value), 5) for value in camera.grid.offsets.ravel()],
    }


def zoom(camera: Camera) -> dict[str, Any]:
    """The fields that make sense: between these degrees, and no narrower than that a view's focal
    length, in its own pixels, is this. By projection too."""
    projections = {name: _degrees(zoom_limits(camera, 2, name)) for name in PROJECTIONS}
    return {
        **projections["perspective"],
        "focal_px": most_focal_px(camera),
        "projections": projections,
    }


def _degrees(limits: ZoomLimits) -> dict[str, float]:
    return {"narrowest_deg": limits.narrowest_deg, "widest_deg": limits.widest_deg}


def milliseconds(nanoseconds: int | None) -> float | None:
    return None if nanoseconds is None else round(nanoseconds / NS_PER_MS, 1)


def counts(counters: Counters, prefix: str = "") -> dict[str, int]:
    """A copy of counters that other threads go on counting in."""
    return {prefix + name: value for name, value in list(counters.values.items())}


def _tracker(head: HeadStatus) -> dict[str, Any]:
    return {
        "name": head.name,
        "state": head.state,
        "message": head.message,
        "age_ms": milliseconds(head.age_ns),
        "rate_hz": round(head.rate_hz, 1),
        "counters": head.counters,
    }


def text(message: dict[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
