"""Exceptions and warnings of Trisect.

All exceptions but :class:`RenderInterrupted` and :class:`MeasurementInterrupted` derive from
:class:`TrisectError`.
"""

from __future__ import annotations

import typing as t

if t.TYPE_CHECKING:
    from ._trisect import Convergence, Frame, Tradeoff


class TrisectError(Exception):
    """Any error of Trisect.

    ``file``, ``line``, ``column`` and ``place`` name where the fault is, ``remedy`` says what to
    do; each is ``None`` if it does not apply. ``kind`` names the variant of the error.
    """

    kind: str
    file: t.Optional[str]
    line: t.Optional[int]
    column: t.Optional[int]
    place: t.Optional[str]
    remedy: t.Optional[str]

    def __init__(self, message: str, **facts: t.Any) -> None:
        super().__init__(message)
        self.kind = facts.get("kind") or ""
        for name in ("file", "line", "column", "place", "remedy"):
            setattr(self, name, facts.get(name))

    def __reduce__(self) -> t.Any:
        return _restored, (type(self), str(self), dict(self.__dict__))


def _restored(kind: t.Type[TrisectError], message: str, facts: t.Dict[str, t.Any]) -> TrisectError:
    error = kind(message)
    error.__dict__.update(facts)
    return error


class SceneError(TrisectError):
    """A scene could not be read, or is invalid."""


class SettingsError(TrisectError, ValueError):
    """A setting is out of range, or cannot be combined with another."""


class BackendError(TrisectError, RuntimeError):
    """A device is too small, or failed."""


class UnavailableError(BackendError):
    """The backend, device or library does not exist here."""


class DenoiseError(TrisectError, ValueError):
    """An image cannot be denoised."""


class ImageError(TrisectError):
    """An image file cannot be read or written."""


class MetricsError(TrisectError, ValueError):
    """Images cannot be compared."""


class FilmError(TrisectError, ValueError):
    """Films do not belong together."""


class LabError(TrisectError, ValueError):
    """Images cannot be evaluated, or a measurement cannot use its files."""


class CheckpointError(TrisectError):
    """A checkpoint cannot be read, written or used.

    ``frame`` has the finished render whose last checkpoint could not be written, else is ``None``.
    """

    frame: t.Optional[Frame] = None


class RankError(TrisectError, RuntimeError):
    """Another rank of a render failed, or renders another image. ``place`` names the rank."""


class BusyError(TrisectError, RuntimeError):
    """A renderer was used from its own progress callback, or too many calls are nested."""


class ForkError(TrisectError, RuntimeError):
    """The process was forked from one that had used the library."""


class CancelledError(TrisectError):
    """:meth:`Renderer.cancel`, or the interpreter's end, ended a render or measurement.

    ``frame`` has the samples so far, ``result`` what was measured; each may be ``None``.
    """

    frame: t.Optional[Frame] = None
    result: t.Union[None, Tradeoff, Convergence] = None


class RenderInterrupted(KeyboardInterrupt):
    """Ctrl-C ended a render. ``frame`` has the samples so far, or is ``None``."""

    frame: t.Optional[Frame] = None


class MeasurementInterrupted(KeyboardInterrupt):
    """Ctrl-C ended a measurement. ``result`` has what was measured, or is ``None``."""

    result: t.Union[None, Tradeoff, Convergence] = None


class SceneWarning(UserWarning):
    """A scene has something that was left out or changed, or a probable mistake."""
