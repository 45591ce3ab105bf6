"""Authentication of webhooks: custom headers, and a signature of the body."""

from __future__ import annotations

import hashlib
import hmac
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from visup.agent.model.errors import SettingsError

TIMESTAMP = "X-Visup-Timestamp"
SIGNATURE = "X-Visup-Signature"
_TOKEN = re.compile(r"[A-Za-z0-9!#$%&'*+.^_`|~-]+")
_RESERVED = ("content-type", "content-length", "host", TIMESTAMP.lower(), SIGNATURE.lower())


@dataclass(frozen=True, slots=True)
class WebhookAccess:
    """Headers and signing key of webhook requests.

    Attributes:
        headers: Name -> value.
        key: Key that signs bodies, or None.

    Raises:
        SettingsError: A header is not valid.
    """

    headers: Mapping[str, str] = field(default_factory=dict, repr=False)
    key: str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name, value in self.headers.items():
            if not _TOKEN.fullmatch(name) or name.lower() in _RESERVED:
                raise SettingsError(
                    f"the header {name!r} of webhooks cannot be set",
                    expected="a name such as Authorization or X-Api-Key",
                )
            if not value.isprintable() or not value.isascii():
                # The value may be a secret, so it is not quoted.
                raise SettingsError(
                    f"the value of the header {name!r} of webhooks cannot be sent",
                    expected="one line of plain ASCII text",
                )
        if self.key is not None and not self.key:
            raise SettingsError("the key of webhooks is empty", expected="some random text")

    def headers_for(self, body: bytes, now_s: float) -> dict[str, str]:
        """The headers of one request.

        Args:
            body: The body.
            now_s: Seconds since 1970, by which receivers can reject replayed requests.
        """
        if self.key is None:
            return dict(self.headers)
        timestamp = str(int(now_s))
        signed = signature(self.key, timestamp, body)
        return {**self.headers, TIMESTAMP: timestamp, SIGNATURE: signed}


def signature(key: str, timestamp: str, body: bytes) -> str:
    """The signature of a body: HMAC-SHA-256 of the timestamp, a dot, and the body.

    >>> signature("key", "0", b"{}")[:19]
    'sha256=7314351dd949'
    """
    message = timestamp.encode() + b"." + body
    return "sha256=" + hmac.new(key.encode(), message, hashlib.sha256).hexdigest()
