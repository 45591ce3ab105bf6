"""Reads the contracts of user behaviours in another process, so that none of their code runs here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from visup.agent.contract.contract import Contract
from visup.agent.execution.messages import Message
from visup.agent.execution.process_runner import ChildProcess
from visup.agent.model import errors
from visup.agent.model.errors import BehaviourError, ErrorGroup, VisupError

IMPORT_TIMEOUT_S = 60.0
"""Time limit for importing a file of behaviours, seconds."""


def read_contracts(
    where: str, settings: Mapping[str, Mapping[str, Any]] | None = None
) -> list[Contract]:
    """The contracts of the behaviours of a file or module, created with their settings.

    Args:
        where: `FILE.py`, or `package.module:Class`.
        settings: Name of a behaviour -> values for its settings.

    Raises:
        BehaviourError: It is missing, does not run, ends its process, or has no behaviour.
        SettingsError: A setting is not valid.
    """
    request = {"do": "contracts", "where": where, "settings": _as_dicts(settings or {})}
    child = ChildProcess(request)
    try:
        answer = child.receive(IMPORT_TIMEOUT_S, "its contract was not given")
    except BehaviourError as fault:
        raise BehaviourError(f"it does not run: {fault.what}", where=where) from fault
    finally:
        child.close()
    if "fault" in answer:
        raise _reported_error(answer, where)
    try:
        return [Contract(**_tuples(fields)) for fields in answer["contracts"]]
    except (KeyError, TypeError, AttributeError) as fault:
        raise BehaviourError("its contract cannot be read", where=where) from fault


def _as_dicts(settings: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    return {name: dict(values) for name, values in settings.items()}


def _tuples(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}


def _reported_error(answer: Message, where: str) -> VisupError:
    """The error that the process reported, with all its parts."""
    fields = answer.get("refused")
    faults = [_error(f, where) for f in fields if isinstance(f, Mapping)] if fields else []
    if len(faults) > 1:
        return ErrorGroup(faults)
    fault = answer["fault"]
    text = ": ".join(str(s) for s in fault if s) if isinstance(fault, list) else ""
    return faults[0] if faults else BehaviourError(f"it does not run: {text[:1000]}", where=where)


def _error(fields: Mapping[str, Any], where: str) -> VisupError:
    kind = getattr(errors, str(fields.get("kind")), BehaviourError)
    if not (isinstance(kind, type) and issubclass(kind, VisupError)):
        kind = BehaviourError
    if kind in (ErrorGroup, errors.ExtraMissingError):
        kind = BehaviourError
    texts = {k: str(fields[k])[:1000] for k in ("where", "expected", "hint") if fields.get(k)}
    error: VisupError = kind(str(fields.get("what"))[:1000], **{"where": where, **texts})
    return error
