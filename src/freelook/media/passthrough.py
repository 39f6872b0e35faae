"""Can a browser take these coded pictures by WebRTC as they are, or must they be transcoded?"""

from __future__ import annotations

from ..types import AccessUnit, StreamInfo
from .annexb import split_nals
from .bits import BitReader
from .sps import SpsInfo, parse_sps

_NAMES = {"hevc": "H.265", "mjpeg": "Motion JPEG", "rawvideo": "raw video"}
_FIRST_BYTES = 64  # enough of a slice to read its type


def why_transcode(what: StreamInfo | AccessUnit) -> str | None:
    """None when the pictures can go untouched, else a sentence that says why not.

    From a key unit (it carries the SPS) or a stream with `extradata` the answer covers what the
    encoder announces; any unit is also searched for B slices, which some encoders do not
    announce. So ask again with each unit until the answer is a sentence. Damaged parameter sets
    say nothing.
    """
    stream = what.stream if isinstance(what, AccessUnit) else what
    if stream.codec != "h264":
        name = _NAMES.get(stream.codec, stream.codec)
        return f"the camera sends {name}; browsers take H.264 by WebRTC"
    data = what.data if isinstance(what, AccessUnit) else what.extradata or b""
    for nal in split_nals(data):
        kind = nal[0] & 31
        if kind == 7 and (info := parse_sps("h264", nal)) and (why := _why_sps(info)):
            return why
        if kind in (1, 5):
            return _B_FRAMES if kind == 1 and _is_b_slice(nal) else None
    return None


_B_FRAMES = "the H.264 has B-frames, which WebRTC cannot show in order"


def _why_sps(info: SpsInfo) -> str | None:
    if info.chroma != "4:2:0":
        return f"the H.264 is {info.chroma}; browsers take 4:2:0 by WebRTC"
    if info.bit_depth != 8:
        return f"the H.264 has {info.bit_depth} bits per sample; browsers take 8 by WebRTC"
    if info.interlaced:
        return "the H.264 is interlaced; browsers show whole pictures by WebRTC"
    return _B_FRAMES if info.reorder_frames else None


def _is_b_slice(nal: bytes) -> bool:
    """slice_type of the header (clause 7.3.3): 1 or 6 is B."""
    bits = BitReader(nal[:_FIRST_BYTES], header_bytes=1)
    try:
        bits.ue()  # first_mb_in_slice
        return bits.ue() % 5 == 1
    except ValueError:
        return False
