"""How both clients reach the service: address, headers, proxies, and what all their flows share."""

from __future__ import annotations

import ipaddress
import os
import re
from dataclasses import dataclass
from urllib.parse import urlsplit

import httpx2

from grazemap.client.cache import ResultCache
from grazemap.client.operations import Settings
from grazemap.version import __version__

_ADDRESS = "base_url must look like http://host:port or https://host"
# A header can carry no more than this; an empty key is none.
_HEADER_TEXT = re.compile(r"[!-~]*")


@dataclass(frozen=True)
class Connection:
    """The checked arguments of a client's constructor."""

    base_url: str
    api_key: str | None
    timeout: float
    settings: Settings

    @classmethod
    def of(
        cls,
        base_url: str,
        api_key: str | None,
        cache_dir: str | os.PathLike[str] | None,
        timeout: float,
        retries: int,
    ) -> Connection:
        """Check the arguments; nothing is sent. Raises ValueError."""
        try:
            parts = httpx2.URL(base_url)
            port_fits = parts.port is None or parts.port < 1 << 16
        except (httpx2.InvalidURL, TypeError, ValueError):
            raise ValueError(_ADDRESS) from None
        if parts.scheme not in ("http", "https") or not parts.host or not port_fits:
            raise ValueError(_ADDRESS)
        if parts.userinfo:
            raise ValueError("base_url must not hold a user or a password; use api_key")
        if api_key is not None and not _HEADER_TEXT.fullmatch(api_key):
            raise ValueError("api_key must be printable ASCII without spaces")
        if timeout <= 0 or retries < 0:
            raise ValueError("timeout must be > 0 and retries >= 0")
        cache = ResultCache(cache_dir) if cache_dir is not None else None
        return cls(base_url.rstrip("/"), api_key, timeout, Settings(retries, cache))

    @property
    def headers(self) -> dict[str, str]:
        """Headers of every request."""
        common = {"user-agent": f"grazemap/{__version__}", "accept": "application/json"}
        return {**common, "authorization": f"Bearer {self.api_key}"} if self.api_key else common

    @property
    def use_environment(self) -> bool:
        """Whether proxies of the environment apply: never to a service on this machine."""
        host = urlsplit(self.base_url).hostname or ""
        try:
            return not ipaddress.ip_address(host).is_loopback
        except ValueError:
            return host != "localhost"
