"""Progress bars of renders and measurements."""

from __future__ import annotations

import functools
import sys
import typing as t

if t.TYPE_CHECKING:
    from ._trisect import LabProgress, Progress


class _Bar:
    """A bar of tqdm, which appears with the first progress."""

    def __init__(self, tqdm: t.Any, unit: str, **options: t.Any) -> None:
        self.make = functools.partial(tqdm, unit=unit, leave=False, **options)
        self.shown: t.Any = None

    def at(self, total: t.Optional[int]) -> t.Any:
        """Return the bar, made on the first call."""
        if self.shown is None:
            self.shown = self.make(total=total)
        return self.shown

    def close(self) -> None:
        """Remove the bar, after the last progress."""
        if self.shown is not None:
            self.shown.close()


class _RenderBar(_Bar):
    def __call__(self, progress: Progress) -> None:
        bar = self.at(progress.total)
        if progress.error is not None:
            bar.set_postfix(error=f"{100 * progress.error:.2f} %")
        bar.update(progress.done - bar.n)


class _RenderLine:
    """A line on standard error."""

    begun = False

    def __call__(self, progress: Progress) -> None:
        parts = []
        if progress.total:
            parts.append(f"{100 * progress.done / progress.total:.0f} %")
        if progress.error is not None:
            parts.append(f"error {100 * progress.error:.2f} %")
        if progress.left is not None:
            parts.append(f"{progress.left:.0f} s left")
        self.begun = True
        print("\r" + ", ".join(parts).ljust(40), end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        """End the line."""
        if self.begun:
            print(file=sys.stderr, flush=True)


def bar() -> t.Union[_RenderBar, _RenderLine]:
    """Return a callable that shows the progress: by tqdm if it is installed, else as a line."""
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return _RenderLine()
    return _RenderBar(tqdm, " samples", unit_scale=True)


class _StagesBar(_Bar):
    def __call__(self, progress: LabProgress) -> None:
        bar = self.at(progress.total)
        if progress.message is not None:
            bar.write(progress.message, file=sys.stderr)
        bar.total = progress.total
        bar.set_postfix_str(progress.stage, refresh=False)
        bar.update(progress.done - bar.n)
        bar.refresh()


class _Messages:
    """Lines on standard error."""

    def __call__(self, progress: LabProgress) -> None:
        if progress.message is not None:
            print(progress.message, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Do nothing: each line is complete."""


def stages() -> t.Union[_StagesBar, _Messages]:
    """Return a callable that prints results, above a bar of the stages if tqdm is installed."""
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return _Messages()
    return _StagesBar(tqdm, " stages")
