"""Access check of the page's server: only browsers on this computer with the token, and only this server's page.

    Host     must be a loopback name; otherwise a foreign name could point to this server (DNS rebinding)
    Origin   of a WebSocket must be this server; otherwise any page could open one (cross-site WebSocket hijacking)
    token    a secret in a file of mode 0600, because other accounts of this computer reach loopback, too

Source: OWASP cheat sheets on cross-site request forgery and WebSocket security.
"""

import hmac
import os
import secrets
from pathlib import Path
from urllib.parse import urlsplit

from aiohttp import web

from rtctl.config.errors import UserError
from rtctl.daemon.server import runtime_dir

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",  # the first address contains the token
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}
ASK = (
    "This page needs the address that `rtctl scope` printed when it was started: it ends in ?token=... . "
    "The token is kept in {path}."
)


class Guard:
    """Checks requests to the server on `port`. The token stays in a file, so that a page can use the next server."""

    def __init__(self, folder: Path | None = None):
        self.path = (folder or runtime_dir()) / "scope.token"
        self.token = kept_token(self.path)
        self.port = 0

    @property
    def cookie(self) -> str:
        """Name of the cookie, with the port: browsers share cookies between ports, and several scopes may run."""
        return f"rtctl_scope_{self.port}"

    def refuse(self, request: web.Request) -> web.Response | None:
        """Response that refuses a request; None for a request to serve."""
        host = request.headers.get("Host", "")
        hosts = [f"{name}:{self.port}" for name in LOOPBACK]
        if host not in hosts:
            return self._no(f"the host '{host[:80]}' is not this server; use http://{hosts[0]}")
        origin = request.headers.get("Origin")
        if origin is not None and (urlsplit(origin).scheme != "http" or urlsplit(origin).netloc != host):
            return self._no(f"the page at {origin[:80]} is not this server's")
        if request.path == "/stream" and origin is None:
            return self._no("a WebSocket without Origin is not from this server's page")
        given = request.query.get("token") if request.path == "/" else None
        if not self._is_token(given or request.cookies.get(self.cookie, "")):
            return self._no(ASK.format(path=self.path))
        return None

    def welcome(self, response: web.StreamResponse) -> None:
        """Store the token in a cookie that scripts and other sites cannot read."""
        response.set_cookie(self.cookie, self.token, httponly=True, samesite="Strict", path="/")

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())

    def _no(self, why: str) -> web.Response:
        return web.Response(status=403, text=f"{why}\n")


def kept_token(path: Path) -> str:
    """Token in a file, which is made if missing. Raises UserError if other users can read the file."""
    try:
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise UserError(f"{path}: no file for the page's token: {error.strerror}") from None
    with os.fdopen(fd, "r+") as file:
        found = os.fstat(fd)
        if found.st_uid != os.geteuid() or found.st_mode & 0o077:
            raise UserError(f"{path}: others can read the page's token; remove the file, a new one will be made")
        token = file.read().strip()
        if len(token) < 32:
            token = secrets.token_urlsafe(32)
            file.seek(0)
            file.truncate()
            file.write(token + "\n")
    return token
