"""Figures. Everything here needs the extra `plot`; nothing here opens a window."""
