"""Seals: by which visup knows a file as one that the same user's visup wrote.

What a sealed file holds need not be checked as a stranger's would be. The key is a secret of the user, made
when it is first needed, and kept outside of all run folders: whoever gives away a run gives no key with it.
"""

from __future__ import annotations

import hmac
import os
import secrets
from pathlib import Path

from visup.agent.storage.text_file import read_bounded

KEY_FILE = "VISUP_STATE_KEY"
"""Variable of the environment that names another file of the key, for users who may not write at home."""
KEY_BYTES = 32
SEALED = b"VISUPSTS"
_SEAL_BYTES = 32


class SealError(ValueError):
    """A file bears no seal of this user, or there can be none."""


def key_path() -> Path:
    """Path of this user's key."""
    if named := os.environ.get(KEY_FILE):
        return Path(named)
    state = os.environ.get("XDG_STATE_HOME") or "~/.local/state"
    return Path(state).expanduser() / "visup" / "state.key"


def own_key() -> bytes:
    """The key of this user; made where there is none.

    Raises:
        SealError: None can be kept.
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
            os.link(draft, path)  # of several that begin at once one is first
        except FileExistsError:
            pass
        finally:
            draft.unlink()
    except (OSError, RuntimeError) as fault:  # of a home that nobody knows
        why = fault.strerror if isinstance(fault, OSError) else fault
        raise SealError(
            f"no key can be kept at {path}: {why}; {KEY_FILE} names another file"
        ) from fault
    return _read()


def seal(data: bytes, key: bytes) -> bytes:
    """Bytes with a seal before them."""
    return SEALED + hmac.digest(key, data, "sha256") + data


def unsealed(data: bytes) -> bytes:
    """The bytes after the seal.

    Raises:
        SealError: They bear none, or that of somebody else.
    """
    at = len(SEALED) + _SEAL_BYTES
    body = data[at:]
    seals = data.startswith(SEALED) and hmac.digest(_read(), body, "sha256")
    if not seals or not hmac.compare_digest(seals, data[len(SEALED) : at]):
        raise SealError("it was changed, or written by another user or machine, and is not read")
    return body


def _read() -> bytes:
    """The key that there is."""
    try:
        key = read_bounded(key_path(), KEY_BYTES)
    except (OSError, RuntimeError) as fault:
        raise SealError("this user has no key to know it by, and it is not read") from fault
    if len(key) != KEY_BYTES:
        raise SealError(f"{key_path()} is no key: delete it, and another is made")
    return key
