"""The exceptions a caller of fastncm may catch.

What does not converge is no exception but a row with a `status`.
"""


class FastNcmError(Exception):
    """Base of every error that fastncm raises on purpose."""


class SceneError(FastNcmError):
    """A scene, study or case that cannot be used.

    `name` is the dotted name at fault, empty where there is none; a file reader finds its line.
    """

    def __init__(self, message: str, *, name: str = "") -> None:
        super().__init__(message)
        self.name = name


class SweepError(FastNcmError):
    """The run itself failed: a full disk, a foreign output folder, a dead worker."""
