"""Everything freelook raises on purpose.

    FreelookError
    ├── ProfileError      a lens profile that is wrong; says where
    ├── FitError          measurements that no such lens can be fitted to
    ├── CalibrationError  views of a target that no camera can be calibrated from
    ├── SourceError       video that cannot be opened or read
    ├── TrackerError      a head tracker that cannot be opened
    ├── AttitudeError     a vehicle's attitude that cannot be read, or not be matched to its video
    ├── RenderError       a picture or a view that cannot be rendered
    ├── SinkError         an output that cannot be written
    └── MissingExtra      an optional library is not installed; names the extra

A message says what was wrong, where, and what to do next. Catch `FreelookError` to
report any of them to a person.
"""


class FreelookError(Exception):
    """Root of all deliberate errors."""


class ProfileError(FreelookError):
    """A lens profile that cannot be used as it is."""


class FitError(FreelookError):
    """Measurements, or a camera, that the asked lens model cannot be fitted to."""


class CalibrationError(FreelookError):
    """Views of a target that no camera can be calibrated from; says what to do about it."""


class SourceError(FreelookError):
    """Video that cannot be opened or read.

    `retry` is true when trying again later may help (camera unplugged, no packets yet) and
    false when it cannot (no such file, not a video).
    """

    def __init__(self, message: str, *, retry: bool = False) -> None:
        super().__init__(message)
        self.retry = retry


class TrackerError(FreelookError):
    """A head tracker that cannot be opened or understood."""


class AttitudeError(FreelookError):
    """A vehicle's attitude that cannot be read, or not be matched to the video."""


class RenderError(FreelookError):
    """A picture or a view that cannot be rendered."""


class SinkError(FreelookError):
    """An output that cannot be written."""


class MissingExtra(FreelookError):  # noqa: N818 - reads as what it is
    """An optional library is missing."""

    def __init__(self, library: str, extra: str) -> None:
        super().__init__(
            f"this needs the library '{library}', which is not installed; "
            f"install it with: pip install 'freelook[{extra}]'"
        )
