"""The codec of observations: lossless, so that replayed reasoning gives identical events.

A step is one JSON document (docs/step.schema.json), compressed by zlib. Numbers are read back exactly; masks
are run-length encoded, contours between neighbouring pixels are chain codes. Values of plug-ins are saved if
they consist of plain values, arrays and visup's own records; of others only the type is recorded, and their
kind is unknown when the run is replayed.

It is hand-written, over the fields of the records, because pydantic's `TypeAdapter` has no form for types
that JSON lacks (tuples, arrays, read-only mappings) and is no faster: 1.6 to 1.8 microseconds for a
hypothesis, as here. The format is derived from the records in `schema.py`.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import from_json, to_json

from visup.agent.model import events, mind, object_beliefs, records, task_beliefs
from visup.agent.model.errors import OutputError
from visup.agent.model.records import Observation, Percept, Region, Report, ReportState
from visup.agent.storage.mask_codec import (
    chain_to_contour,
    contour_to_chain,
    mask_to_runs,
    pixel_limit,
    runs_to_mask,
)
from visup.agent.storage.text_file import check_room

LARGEST_STEP_BYTES = 256 * 2**20
"""Largest step, bytes uncompressed: a damaged file must not fill the memory."""
LARGEST_REPORT_BYTES = 32 * 2**20
"""Reports larger than this are left out of a step that is too large."""
MAX_BITS = 1024
"""Longest integer, bits: longer ones could not be read back."""

_COMPRESSION_LEVEL = 1  # zlib: higher levels save a few per cent and take several times as long
_PLAIN = frozenset({type(None), bool, float, str})
"""Types written unchanged; so are integers up to `MAX_BITS`."""
_NOT_ENCODED = (records.Frame, records.Observation, mind.Mind)
_TYPES: Mapping[str, type] = MappingProxyType(
    {
        name: kind
        for module in (records, events, object_beliefs, task_beliefs, mind)
        for name, kind in vars(module).items()
        if isinstance(kind, type)
        and kind.__module__ == module.__name__
        and (is_dataclass(kind) or issubclass(kind, Enum))
        and kind not in _NOT_ENCODED
    }
)
_FIELDS = {k: tuple(f.name for f in fields(k)) for k in _TYPES.values() if is_dataclass(k)}


UNREADABLE = (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError)
"""Exceptions raised by reading an invalid document."""


class UnsupportedTypeError(TypeError):
    """A value has a type that the codec does not support."""


def pack_observation(observation: Observation) -> bytes:
    """Encode an observation.

    Args:
        observation: The observation of one frame; the run times of behaviours are left out.

    Returns:
        A compressed JSON document.
    """
    document = to_document(observation)
    try:
        text = _checked_text(document)
    except ValueError:
        text = _checked_text(
            {**document, "reports": [_without_unreadable(r) for r in document["reports"]]}
        )
    return zlib.compress(text, _COMPRESSION_LEVEL)


def _checked_text(document: Any) -> bytes:
    """A document as text, checked to be readable.

    Raises:
        ValueError: It is not.
    """
    text = to_json(document, inf_nan_mode="constants")
    if len(text) > LARGEST_STEP_BYTES:
        raise ValueError(f"it takes more than {LARGEST_STEP_BYTES >> 20} MB")
    check_room(text)
    return text


def _without_unreadable(report: dict[str, Any]) -> dict[str, Any]:
    """A report unchanged, or without percepts if they could not be read back."""
    try:
        if len(_checked_text(report)) <= LARGEST_REPORT_BYTES:
            return report
        reason = "more than a step has room for"
    except ValueError as fault:
        reason = f"what cannot be written ({str(fault)[:80]})"
    return {k: v for k, v in report.items() if k != "percepts"} | {"lost": reason}


def unpack_observation(data: bytes, where: str = "") -> Observation:
    """Decode an observation.

    Raises:
        OutputError: The bytes are damaged.
    """
    try:
        inflater = zlib.decompressobj()
        text = inflater.decompress(data, LARGEST_STEP_BYTES)
        if not inflater.eof:
            raise ValueError("it is cut off or too large")
        check_room(text)
        return from_document(from_json(text))
    except (zlib.error, *UNREADABLE) as fault:
        raise OutputError(
            f"a recorded step cannot be read ({fault})",
            where=where or None,
            hint="the file is damaged; steps before this one can be used",
        ) from fault


def to_document(observation: Observation) -> dict[str, Any]:
    """An observation as JSON values, in the format of docs/step.schema.json."""
    return {
        "frame_index": observation.frame_index,
        "time": float(observation.time),
        "frame_size": [int(n) for n in observation.frame_size],
        "reports": [_report(r) for r in observation.reports],
    }


def from_document(document: Mapping[str, Any]) -> Observation:
    """The observation of a document; reports whose values were not recorded count as rested."""
    width, height = document["frame_size"]
    with pixel_limit():
        reports = tuple(_report_of(r) for r in document["reports"])
    return Observation(
        int(document["frame_index"]), float(document["time"]), (int(width), int(height)), reports
    )


def _report(r: Report) -> dict[str, Any]:
    out: dict[str, Any] = {"behaviour": r.behaviour, "state": r.state.value, "gives": list(r.gives)}
    if r.error:
        out["error"] = r.error
    try:
        out["percepts"] = [encode_percept(p) for p in r.percepts]
    except UnsupportedTypeError as fault:
        out["lost"] = str(fault)
    return out


def encode_percept(p: Percept) -> list[Any]:
    """A percept as JSON values.

    Raises:
        UnsupportedTypeError: Its value is, or contains, an unsupported type.
    """
    return [p.kind, encode(p.value), encode(p.time), p.source, encode(p.confidence)]


def decode_percept(document: list[Any]) -> Percept:
    """Decode a percept, without validating it.

    Raises:
        ValueError, TypeError, KeyError: It is not valid.
    """
    kind, value, time, source, confidence = document
    return Percept(str(kind), decode(value), decode(time), str(source), decode(confidence))


def _report_of(document: Mapping[str, Any]) -> Report:
    gives = tuple(str(k) for k in document["gives"])
    if "lost" in document:
        error = f"its percepts were not recorded: {document['lost']}"
        return Report(str(document["behaviour"]), ReportState.RESTED, gives, error=error)
    percepts = tuple(decode_percept(p) for p in document["percepts"])
    state = ReportState(document["state"])
    return Report(
        str(document["behaviour"]), state, gives, percepts, str(document.get("error", ""))
    )


def encode(value: Any) -> Any:
    """A value as JSON values; types that JSON lacks become objects with the key '$'.

    Raises:
        UnsupportedTypeError: It is, or contains, an unsupported type.
    """
    kind = type(value)
    if kind in _PLAIN:
        return value
    if kind is int:
        return _integer(value)
    if kind is Region:
        return _region(value)
    if kind in _FIELDS:
        return _record(kind, value)
    if kind is tuple:
        return {"$": "tuple", "of": [v if type(v) in _PLAIN else encode(v) for v in value]}
    if kind is list:
        return [encode(v) for v in value]
    if isinstance(value, Enum):
        if _TYPES.get(kind.__name__) is not kind:
            raise UnsupportedTypeError(f"{kind.__module__}.{kind.__qualname__}")
        return {"$": kind.__name__, "of": value.value}
    if kind is dict or kind is MappingProxyType:
        return _mapping(value)
    if isinstance(value, np.ma.MaskedArray) and value.dtype.kind in "biufc":
        return {"$": "masked", "of": _array(value.filled(0)), "hidden": _array(_masked(value))}
    if isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biufc":
        return _array(value)
    if kind is frozenset or kind is set:
        ordered = sorted((encode(v) for v in value), key=lambda v: json.dumps(v, sort_keys=True))
        return {"$": kind.__name__, "of": ordered}
    if kind is bytes:
        return {"$": "bytes", "of": base64.b64encode(value).decode()}
    raise UnsupportedTypeError(f"{kind.__module__}.{kind.__qualname__}")


def decode(value: Any) -> Any:
    """Decode a value.

    Raises:
        ValueError, TypeError, KeyError: It is not valid.
    """
    kind = type(value)
    if kind in _PLAIN or kind is int:
        return value
    if kind is list:
        return [decode(v) for v in value]
    tag = value.get("$")
    if tag is None:
        return {k: decode(v) for k, v in value.items()}
    if tag == "Region":
        return _region_of(value)
    if tag in _TYPES:
        return _record_of(_TYPES[tag], value)
    return _DECODERS[tag](value)


def _integer(value: int) -> int:
    if value.bit_length() > MAX_BITS:
        raise UnsupportedTypeError(f"a whole number of {value.bit_length()} bits")
    return value


def _record(kind: type, value: Any) -> dict[str, Any]:
    out: dict[str, Any] = {"$": kind.__name__}
    for name in _FIELDS[kind]:
        field_value = getattr(value, name)
        out[name] = field_value if type(field_value) in _PLAIN else encode(field_value)
    return out


def _mapping(value: Mapping[Any, Any]) -> dict[str, Any]:
    if type(value) is dict and all(type(k) is str and k != "$" for k in value):
        return {k: encode(v) for k, v in value.items()}
    pairs = [[encode(k), encode(v)] for k, v in value.items()]
    return {"$": "map" if type(value) is dict else "frozenmap", "of": pairs}


def _record_of(kind: type, document: Mapping[str, Any]) -> Any:
    if kind not in _FIELDS:
        return kind(document["of"])
    values = {n: v if type(v) in _PLAIN else decode(v) for n, v in document.items()}
    del values["$"]
    return kind(**values)


def _array(value: NDArray[Any] | np.generic) -> dict[str, Any]:
    array = np.asarray(value)
    little = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return {
        "$": "array" if isinstance(value, np.ndarray) else "scalar",
        "dtype": little.dtype.str,
        "shape": list(array.shape),
        "of": base64.b64encode(np.ascontiguousarray(little).tobytes()).decode(),
    }


def _masked(value: Any) -> NDArray[np.bool_]:
    return np.ma.getmaskarray(value)


def _masked_of(document: Mapping[str, Any]) -> Any:
    return np.ma.MaskedArray(_array_of(document["of"]), _array_of(document["hidden"]))


def _array_of(document: Mapping[str, Any]) -> NDArray[Any]:
    dtype = np.dtype(str(document["dtype"]))
    if dtype.kind not in "biufc":
        raise ValueError(f"an array of {dtype}")
    flat = np.frombuffer(base64.b64decode(document["of"]), dtype)
    # As newly created arrays: writable, in native byte order.
    return flat.astype(dtype.newbyteorder("=")).reshape([int(n) for n in document["shape"]])


_DECODERS: dict[str, Callable[[Mapping[str, Any]], Any]] = {
    "tuple": lambda written: tuple([v if type(v) in _PLAIN else decode(v) for v in written["of"]]),
    "set": lambda written: {decode(v) for v in written["of"]},
    "frozenset": lambda written: frozenset(decode(v) for v in written["of"]),
    "map": lambda written: {decode(k): decode(v) for k, v in written["of"]},
    "frozenmap": lambda written: MappingProxyType({decode(k): decode(v) for k, v in written["of"]}),
    "bytes": lambda written: base64.b64decode(written["of"]),
    "array": _array_of,
    "masked": _masked_of,
    "scalar": lambda written: _array_of(written)[()],
}


_REGION_FIELDS = tuple(n for n in _FIELDS[Region] if n not in ("mask", "contour", "bbox"))


def _region(r: Region) -> dict[str, Any]:
    out: dict[str, Any] = {
        "$": "Region",
        "bbox": [int(n) for n in r.bbox],
        "mask": mask_to_runs(r.mask),
        "contour": contour_to_chain(r.contour) or encode(r.contour),
    }
    for name in _REGION_FIELDS:
        field_value = getattr(r, name)
        out[name] = field_value if type(field_value) in _PLAIN else encode(field_value)
    return out


def _region_of(document: Mapping[str, Any]) -> Region:
    x, y, w, h = (int(n) for n in document["bbox"])
    values = {
        n: decode(v) for n, v in document.items() if n not in ("$", "bbox", "mask", "contour")
    }
    mask = runs_to_mask(document["mask"], (h, w))
    return Region(
        bbox=(x, y, w, h), mask=mask, contour=np.asarray(decode(document["contour"])), **values
    )


_DECODERS["chain"] = chain_to_contour
