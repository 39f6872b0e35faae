"""H.264 and H.265 byte streams (Annex B): NAL units, key pictures, parameter sets."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

START_CODE = b"\0\0\0\1"
MAX_PARAMETER_SET = 4096

_START = re.compile(b"\0\0\1")
_PARAMETER_TYPES = {"h264": (7, 8), "hevc": (32, 33, 34)}  # in the order they must be sent


def split_nals(data: bytes) -> Iterator[bytes]:
    """The NAL units of a byte stream, without start codes; empty ones are left out."""
    starts = [match.end() for match in _START.finditer(data)]
    ends = [start - 3 for start in starts[1:]] + [len(data)]
    for start, end in zip(starts, ends, strict=False):
        # zeros before a start code are padding: a NAL unit ends in a 1 bit
        nal = data[start:end].rstrip(b"\0")
        if nal:
            yield nal


def join_nals(nals: Iterable[bytes]) -> bytes:
    """A byte stream with four-byte start codes."""
    return b"".join(part for nal in nals for part in (START_CODE, nal))


def nal_type(codec: str, nal: bytes) -> int:
    """nal_unit_type of a non-empty NAL unit of codec h264 or hevc."""
    return nal[0] & 31 if codec == "h264" else nal[0] >> 1 & 63


def is_picture(codec: str, kind: int) -> bool:
    """Whether NAL units of this type carry part of a picture (VCL)."""
    return 1 <= kind <= 5 if codec == "h264" else kind < 32


def is_key(codec: str, nals: Sequence[bytes]) -> bool:
    """Whether decoding can start here: IDR or a recovery point (H.264), IRAP (H.265)."""
    if codec == "h264":
        return any(n[0] & 31 == 5 or (n[0] & 31 == 6 and _recovery_point(n)) for n in nals)
    return any(16 <= n[0] >> 1 & 63 <= 21 for n in nals)


def _recovery_point(sei: bytes) -> bool:
    """Whether the first or a later message of an SEI is a recovery point (type 6)."""
    at = 1
    while at + 2 < len(sei):
        kind, at = _sei_number(sei, at)
        size, at = _sei_number(sei, at)
        if kind == 6:
            return True
        at += size
    return False


def _sei_number(sei: bytes, at: int) -> tuple[int, int]:
    value = 0
    while at < len(sei) and sei[at] == 255:
        value, at = value + 255, at + 1
    return (value + sei[at], at + 1) if at < len(sei) else (value, at)


class ParameterSets:
    """The newest parameter sets of a stream, put in front of key pictures that lack them.

    Sets of one type that come together belong together and replace the earlier ones of that
    type.
    """

    def __init__(self, codec: str, nals: Iterable[bytes] = ()) -> None:
        self._codec = codec
        self._types = _PARAMETER_TYPES[codec]
        self._sets: dict[int, list[bytes]] = {}
        self.update(list(nals))

    def update(self, nals: Sequence[bytes]) -> bool:
        """Remember the parameter sets among these NAL units; True if anything changed."""
        found: dict[int, list[bytes]] = {}
        for nal in nals:
            kind = nal_type(self._codec, nal)
            if kind in self._types and len(nal) <= MAX_PARAMETER_SET:
                found.setdefault(kind, []).append(nal)
        changed = any(self._sets.get(kind) != sets for kind, sets in found.items())
        self._sets.update(found)
        return changed

    def complete(self, nals: Sequence[bytes]) -> list[bytes]:
        """These NAL units with the types of parameter sets they lack in front."""
        there = {nal_type(self._codec, nal) for nal in nals}
        lacking = [n for k in self._types if k not in there for n in self._sets.get(k, ())]
        return [*lacking, *nals]

    @property
    def nals(self) -> list[bytes]:
        """All sets known, in the order they must be sent."""
        return [nal for kind in self._types for nal in self._sets.get(kind, ())]

    @property
    def sps(self) -> bytes | None:
        """The first sequence parameter set, if one is known."""
        return next(iter(self._sets.get(7 if self._codec == "h264" else 33, ())), None)
