"""Three letters for the axes of a sensor: where its x, y and z point on a level head.

f forward, b back, r right, l left, u up, d down: frd, flu, rdf, ...
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..errors import TrackerError

_IN_RDF = {
    "r": (1, 0, 0),
    "l": (-1, 0, 0),
    "d": (0, 1, 0),
    "u": (0, -1, 0),
    "f": (0, 0, 1),
    "b": (0, 0, -1),
}


def rdf_from_axes(letters: str, option: str) -> Rotation:
    """From a sensor's coordinates to ours (x right, y down, z forward). TrackerError for letters
    that are no axes, and for a left-handed set."""
    example = f"{option}=frd: x forward, y right, z down"
    if len(letters) != 3 or any(letter not in _IN_RDF for letter in letters):
        raise TrackerError(
            f"{option}={letters} is not three of {', '.join(_IN_RDF)}; for example {example}"
        )
    matrix = np.array([_IN_RDF[letter] for letter in letters], float).T
    handedness = round(float(np.linalg.det(matrix)))
    if handedness == 0:
        raise TrackerError(f"{option}={letters} has two axes along one line; for example {example}")
    if handedness < 0:
        raise TrackerError(f"{option}={letters} is left-handed; turn one axis round")
    return Rotation.from_matrix(matrix)
