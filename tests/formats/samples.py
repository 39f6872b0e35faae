"""Sample texts of every lens profile format, made by ourselves, for the suite that runs over all.

Each text is complete, holds one camera, and is what the other program would write. A format that
does not say the picture's size is read with `SIZE`. The suite (test_formats_conformance.py) fails
for a format in `FORMATS` that has no sample here.
"""

from __future__ import annotations

SIZE = (640, 480)

FREELOOK = """{
  "freelook_lens": 1,
  "size": [640, 480],
  "model": "kannala_brandt",
  "parameters": {"f": 280.0, "k1": -0.0137, "k2": 0.0207, "k3": -0.0128, "k4": 0.0025},
  "center": [318.25, 243.5],
  "field_deg": 180,
  "stretch": [[1.0, 0.005], [0.0, 0.98]],
  "mount_deg": {"yaw": 5, "pitch": -10, "roll": 0}
}
"""

OPENCV_SMALL = """{
  "K": [[280.0, 1.4, 318.0], [0.0, 276.0, 243.0], [0.0, 0.0, 1.0]],
  "D": [-0.0137, 0.0207, -0.0128, 0.0025],
  "image_size_wh": [640, 480],
  "model": "OpenCV fisheye"
}
"""

SAMPLES: dict[str, list[str]] = {
    "freelook": [FREELOOK],
    "opencv": [OPENCV_SMALL],
}
