"""Reframing as one writes it with OpenCV: a program of its own, `python -m ... JOB.json`.

PyAV decodes to BGR, `initUndistortRectifyMap` makes the map anew for every pose (once for a view
that stands still), `remap` samples, PyAV converts and encodes. Nothing of freelook is in it.
"""

from __future__ import annotations

import json
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from av.video.reformatter import ColorRange, Colorspace


def run(job: dict[str, Any]) -> None:
    """Of the job: `clip`, `out`, `size`, the matrices `k`, `d` and `p` as OpenCV has them,
    `view_from_camera` (a 3 x 3 matrix for each frame, or only one), and for the encoder
    `options`, `key_interval`, `fps`, `bt601`, `full_range`."""
    width, height = job["size"]
    k, d, p = (np.array(job[name]) for name in ("k", "d", "p"))
    turns = np.array(job["view_from_camera"])
    matrix = Colorspace.ITU601 if job["bt601"] else Colorspace.ITU709
    range_ = ColorRange.JPEG if job["full_range"] else ColorRange.MPEG
    maps: tuple[Any, ...] = ()
    with av.open(job["clip"]) as source, av.open(job["out"], "w") as target:
        video = source.streams.video[0]
        video.thread_type = "AUTO"
        coded: Any = target.add_stream("libx264", rate=Fraction(job["fps"]).limit_denominator(1001))
        coded.width, coded.height, coded.pix_fmt = width, height, "yuv420p"
        coded.codec_context.gop_size = job["key_interval"]
        coded.codec_context.thread_type = "AUTO"
        coded.codec_context.color_range = range_
        coded.options = job["options"]
        for index, frame in enumerate(source.decode(video)):
            bgr = frame.reformat(
                format="bgr24",
                src_colorspace=matrix,
                src_color_range=range_,
                dst_color_range=ColorRange.JPEG,
            ).to_ndarray()
            if index < len(turns):
                maps = cv2.fisheye.initUndistortRectifyMap(
                    k, d, turns[index], p, (width, height), cv2.CV_16SC2
                )
            x, y = maps
            view = cv2.remap(bgr, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
            picture = av.VideoFrame.from_ndarray(view, "bgr24").reformat(
                format="yuv420p",
                src_color_range=ColorRange.JPEG,
                dst_colorspace=matrix,
                dst_color_range=range_,
            )
            picture.pts = index
            target.mux(coded.encode(picture))
        target.mux(coded.encode(None))


if __name__ == "__main__":
    run(json.loads(Path(sys.argv[1]).read_text("utf-8")))
