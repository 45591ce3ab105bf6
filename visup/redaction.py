"""Addresses as they may be shown and written: without user, password, and what looks like a key.

Whoever may read a record, a log or a report need not be one who may log in to the camera.
"""

from __future__ import annotations

import re

HIDDEN = "***"
_ADDRESS = re.compile(r"([a-z][a-z0-9+.-]*://)([^/?#]*)(.*)", re.IGNORECASE | re.DOTALL)
_PLACE = re.compile(r"[^:@]*(:\d*)?|\[[^]]*\](:\d*)?")
"""A host, perhaps with its port."""

_SECRET = re.compile(
    r"((?:user|usr|login|pass|pwd|psw|token|secret|key|auth|sig|sess|code|cred)\w*?=)"
    r"(?:(?!_\w+=)[^&;/?#])*",
    re.IGNORECASE,
)
"""Some cameras take both in the path: `/user=admin_password=abc_channel=1.sdp`."""

_VALUE = re.compile(r"=[^&;#]*")
_SHORT_NUMBER = re.compile(r"=\d{1,4}")


def redacted(address: str) -> str:
    """An address without what only its owner should know; any other text as it is.

    >>> redacted("rtsp://guard:swordfish@10.0.0.3:554/stream?channel=1&token=x7")
    'rtsp://10.0.0.3:554/stream?channel=1&token=***'
    >>> redacted("clip.mp4")
    'clip.mp4'
    """
    parts = _ADDRESS.fullmatch(address)
    if parts is None:
        return address
    scheme, place, rest = parts.groups()
    if "@" not in place and "@" in rest and not _PLACE.fullmatch(place):
        place, rest = f"{place}{rest}".rpartition("@")[0::2]  # a slash in a password
        place, rest = _ADDRESS.fullmatch(f"{scheme}{rest}").groups()[1:]  # type: ignore[union-attr]
    path, mark, query = _SECRET.sub(rf"\1{HIDDEN}", rest).partition("?")
    values = _VALUE.sub(lambda v: v[0] if _SHORT_NUMBER.fullmatch(v[0]) else f"={HIDDEN}", query)
    return f"{scheme}{place.rpartition('@')[2]}{path}{mark}{values}"


def has_secret(address: str) -> bool:
    """Whether an address holds what is left out where it is shown.

    >>> has_secret("rtsp://guard:swordfish@10.0.0.3/stream"), has_secret("rtsp://10.0.0.3/stream")
    (True, False)
    """
    return redacted(address) != address
