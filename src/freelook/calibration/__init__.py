"""Cameras from pictures: of a calibration board, or of anything that lets the image circle show."""
