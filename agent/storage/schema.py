"""The JSON Schema of a recorded step, for programs that read journals without visup (docs/step.schema.json).

Fields of records are derived from the records; only what the codec encodes differently is defined here.
"""

from __future__ import annotations

import json
from dataclasses import fields as dataclass_fields
from enum import Enum
from functools import reduce
from operator import or_
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, create_model

from visup.agent.model.records import CameraMotion, Depth, Health, Hypothesis, Region, ReportState

VERSION = 1
"""Version of this schema; that of the journal is `visup.agent.storage.journal.VERSION`."""

Number = Annotated[float, Field(description="A number; Infinity and NaN are written so.")]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", ser_json_inf_nan="constants", allow_inf_nan=True)


class Tuple(_Strict):
    """A tuple."""

    tag: Literal["tuple"] = Field(alias="$")
    of: list[Any]


class ArrayValue(_Strict):
    """A NumPy array (or one number of such a type, 'scalar'): raw little-endian bytes in base64."""

    tag: Literal["array", "scalar"] = Field(alias="$")
    dtype: str = Field(description="As of NumPy, such as '<f4'.")
    shape: list[int]
    of: str = Field(description="Base64, in C order.")


class Chain(_Strict):
    """A contour that goes from pixel to neighbouring pixel."""

    tag: Literal["chain"] = Field(alias="$")
    start: Annotated[list[int], Field(alias="from", min_length=2, max_length=2)]
    of: str = Field(
        pattern="^[0-7]*$", description="Directions in steps of 45 degrees: 0 is right, 2 is down."
    )


def _document_type(hint: Any) -> Any:
    """The type in a document of a field of a record."""
    if hint is float:
        return Number
    if isinstance(hint, UnionType):
        return reduce(or_, (_document_type(part) for part in get_args(hint)))
    if get_origin(hint) is tuple:
        return Tuple
    if get_origin(hint) is np.ndarray:
        return ArrayValue
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _tagged(
            hint, "State of the camera's image", of=(Literal[tuple(m.value for m in hint)], ...)
        )
    return hint


def _tagged(kind: type, description: str, **fields: Any) -> Any:
    name = kind.__name__
    tag: Any = (Literal[name], Field(alias="$"))
    return create_model(
        f"{name}Value",
        __base__=_Strict,
        __doc__=f"{description} (`visup.agent.{name}`).",
        tag=tag,
        **fields,
    )


def _record(kind: type, description: str, **replacements: Any) -> Any:
    """The schema of a record: its fields in order, with replacements for those encoded differently."""
    hints = get_type_hints(kind, localns={"np": np, "NDArray": NDArray})
    fields = {
        f.name: (replacements.get(f.name) or _document_type(hints[f.name]), ...)
        for f in dataclass_fields(kind)
    }
    return _tagged(kind, description, **fields)


_BOX = Annotated[list[int], Field(min_length=4, max_length=4, description="x, y, width, height")]
_RUNS = Annotated[
    list[int],
    Field(
        description="Lengths of runs in reading order within the box: first of pixels that are not of "
        "the region, then of those that are, and so on."
    ),
]
RECORDS = (
    _record(
        Region,
        "A part of the image that moves coherently",
        bbox=_BOX,
        mask=_RUNS,
        contour=Chain | ArrayValue,
    ),
    _record(Hypothesis, "What a region looks like"),
    _record(Depth, "Relative depth of a region under one identity"),
    _record(CameraMotion, "How the picture of the resting scene moved because the camera did"),
    _record(Health, "State of the camera's image, and why"),
)

if TYPE_CHECKING:
    Value = Any
else:
    Value = reduce(or_, (*RECORDS, Tuple, ArrayValue, Any))
"""The value of a percept. Values of plug-ins are JSON values, with objects that have the key '$' for tuples,
arrays, bytes, sets, mappings whose keys are not strings, and visup's records by name."""


class ReportDocument(_Strict):
    """What one behaviour did in a step."""

    behaviour: str
    state: ReportState
    gives: list[str] = Field(description="Kinds of percept that it would have reported.")
    percepts: list[tuple[str, Value, Any, str, Any]] = Field(
        default=[], description="Each is: kind, value, time in seconds, source, confidence."
    )
    error: str = Field(default="", description="What went wrong.")
    lost: str | None = Field(
        default=None,
        description="Type of a value that could not be recorded; percepts are then left out.",
    )


class StepDocument(_Strict):
    """What was perceived of one frame: `steps.seen` of a journal, after zlib."""

    frame_index: int
    time: Number = Field(description="Seconds since the start of the source.")
    frame_size: Annotated[list[int], Field(min_length=2, max_length=2)] = Field(
        description="Width and height, pixels."
    )
    reports: list[ReportDocument]


def schema_text() -> str:
    """The JSON Schema of a recorded step, as in the documentation."""
    schema = StepDocument.model_json_schema()
    named = {"$id": f"visup-step-{VERSION}", "title": f"visup: a recorded step, version {VERSION}"}
    return json.dumps({**schema, **named}, indent=1, sort_keys=True) + "\n"


if __name__ == "__main__":
    print(schema_text(), end="")
