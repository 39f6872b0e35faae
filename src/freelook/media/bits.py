"""Reading the bits of a NAL unit: fixed lengths and Exp-Golomb codes (H.264, clause 9.1)."""

from __future__ import annotations


class BitReader:
    """Reads from the first bit of `nal`'s payload; ValueError beyond the end.

    Emulation prevention bytes (00 00 03) are taken out first.
    """

    def __init__(self, nal: bytes, *, header_bytes: int) -> None:
        payload = nal[header_bytes:].replace(b"\0\0\3", b"\0\0")
        self._value = int.from_bytes(payload, "big")
        self._left = 8 * len(payload)

    def u(self, bits: int) -> int:
        """An unsigned number of so many bits."""
        if bits > self._left:
            raise ValueError("the bit stream ends too early")
        self._left -= bits
        return self._value >> self._left & (1 << bits) - 1

    def flag(self) -> bool:
        return self.u(1) == 1

    def ue(self) -> int:
        """An unsigned Exp-Golomb number below 2**32."""
        zeros = 0
        while not self.u(1):
            zeros += 1
            if zeros > 31:
                raise ValueError("not an Exp-Golomb number")
        return (1 << zeros) - 1 + self.u(zeros)

    def se(self) -> int:
        """A signed Exp-Golomb number."""
        code = self.ue()
        return (code + 1) // 2 if code & 1 else -(code // 2)
