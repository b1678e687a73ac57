"""The daemon's log. structlog loads with the first message: loop and plant seldom write one, and it takes 60 ms."""

from typing import Any


class Log:
    """Logger whose methods are the levels: `log.warning("plant ended", last_words=...)`."""

    def __getattr__(self, level: str) -> Any:
        if level.startswith("_"):
            raise AttributeError(level)
        import structlog

        return getattr(structlog.get_logger(), level)


log = Log()
