"""A bar with the time left, where a person is watching."""

import contextlib
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def progress(name: str, wrong: str) -> Iterator[Callable[[int, int, int], None]]:
    """Gives `update(done, total, count)`; a count of what is `wrong` stands beside the name. A pipe sees nothing."""
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
