"""Coded video: depacketising, decoding, encoding. Knows codecs, not networks."""
