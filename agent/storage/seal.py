"""Seals (message authentication codes) that identify files written by the same user's visup.

A sealed file need not be checked like a stranger's. The key is a secret of the user, created when first
needed and stored outside all run folders, so that sharing a run does not share the key.
"""

from __future__ import annotations

import hmac
import os
import secrets
from pathlib import Path

from visup.agent.storage.text_file import read_bounded

KEY_FILE = "VISUP_STATE_KEY"
"""Environment variable with another path of the key, for users without a writable home."""
KEY_BYTES = 32
SEALED = b"VISUPSTS"
_SEAL_BYTES = 32


class SealError(ValueError):
    """A file has no seal of this user, or sealing is not possible."""


def key_path() -> Path:
    """Path of this user's key."""
    if named := os.environ.get(KEY_FILE):
        return Path(named)
    state = os.environ.get("XDG_STATE_HOME") or "~/.local/state"
    return Path(state).expanduser() / "visup" / "state.key"


def own_key() -> bytes:
    """The key of this user; created if missing.

    Raises:
        SealError: It cannot be stored.
    """
    try:
        return _read()
    except SealError:
        pass
    path = key_path()
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
        draft.touch(mode=0o600, exist_ok=False)
        try:
            draft.write_bytes(secrets.token_bytes(KEY_BYTES))
            os.link(draft, path)  # atomic: of several processes one wins
        except FileExistsError:
            pass
        finally:
            draft.unlink()
    except (OSError, RuntimeError) as fault:  # RuntimeError: unknown home folder
        reason = fault.strerror if isinstance(fault, OSError) else fault
        raise SealError(
            f"no key can be kept at {path}: {reason}; {KEY_FILE} names another file"
        ) from fault
    return _read()


def seal(data: bytes, key: bytes) -> bytes:
    """Bytes with a seal prepended."""
    return SEALED + hmac.digest(key, data, "sha256") + data


def unsealed(data: bytes) -> bytes:
    """The bytes after the seal.

    Raises:
        SealError: They have none, or another user's.
    """
    at = len(SEALED) + _SEAL_BYTES
    body = data[at:]
    seals = data.startswith(SEALED) and hmac.digest(_read(), body, "sha256")
    if not seals or not hmac.compare_digest(seals, data[len(SEALED) : at]):
        raise SealError("it was changed, or written by another user or machine, and is not read")
    return body


def _read() -> bytes:
    """The existing key."""
    try:
        key = read_bounded(key_path(), KEY_BYTES)
    except (OSError, RuntimeError) as fault:
        raise SealError("this user has no key to know it by, and it is not read") from fault
    if len(key) != KEY_BYTES:
        raise SealError(f"{key_path()} is no key: delete it, and another is made")
    return key
