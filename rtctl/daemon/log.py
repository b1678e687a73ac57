"""Log of the daemon. structlog takes 60 ms to import and is loaded with the first message; most processes log none."""

from typing import Any


class Log:
    """Logger whose methods are the levels: `log.warning("plant ended", last_words=...)`."""

    def __getattr__(self, level: str) -> Any:
        if level.startswith("_"):
            raise AttributeError(level)
        import structlog

        return getattr(structlog.get_logger(), level)


log = Log()
