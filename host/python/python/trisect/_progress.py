"""Progress bars of renders and measurements."""

from __future__ import annotations

import sys
import typing as t

if t.TYPE_CHECKING:
    from ._trisect import LabProgress, Progress


def bar() -> t.Callable[[Progress], None]:
    """Return a callable that shows the progress: by tqdm if it is installed, else as a line."""
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return _line
    shown: t.List[t.Any] = []

    def show(progress: Progress) -> None:
        if not shown:
            shown.append(tqdm(total=progress.total, unit=" samples", unit_scale=True, leave=False))
        one = shown[0]
        if progress.error is not None:
            one.set_postfix(error=f"{100 * progress.error:.2f} %")
        one.update(progress.done - one.n)
        if progress.done == progress.total:
            one.close()

    return show


def _line(progress: Progress) -> None:
    parts = []
    if progress.total:
        parts.append(f"{100 * progress.done / progress.total:.0f} %")
    if progress.error is not None:
        parts.append(f"error {100 * progress.error:.2f} %")
    if progress.left is not None:
        parts.append(f"{progress.left:.0f} s left")
    is_done = progress.done == progress.total
    print("\r" + ", ".join(parts).ljust(40), end="\n" if is_done else "", file=sys.stderr, flush=True)


def stages() -> t.Callable[[LabProgress], None]:
    """Return a callable that prints results, above a bar of the stages if tqdm is installed."""
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return _message
    shown: t.List[t.Any] = []

    def show(progress: LabProgress) -> None:
        if not shown:
            shown.append(tqdm(total=progress.total, unit=" stages", leave=False))
        one = shown[0]
        if progress.message is not None:
            one.write(progress.message, file=sys.stderr)
        one.total = progress.total
        one.set_postfix_str(progress.stage, refresh=False)
        one.update(progress.done - one.n)
        one.refresh()

    return show


def _message(progress: LabProgress) -> None:
    if progress.message is not None:
        print(progress.message, file=sys.stderr, flush=True)
