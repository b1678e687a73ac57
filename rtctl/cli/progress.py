"""Progress bar with the time left, on a terminal only."""

import contextlib
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def progress(name: str, wrong: str) -> Iterator[Callable[[int, int, int], None]]:
    """Context with `update(done, total, count)`; `count` and the word `wrong` follow the name. A pipe gets nothing."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda *_: None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(name, total=None)

        def update(done: int, total: int, count: int) -> None:
            bar.update(task, completed=done, total=total, description=f"{name}, {count} {wrong}" if count else name)

        yield update
