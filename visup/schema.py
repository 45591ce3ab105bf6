"""The form of a recorded step, for programs that read journals without visup (docs/step.schema.json)."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from visup.agent import ReportState

VERSION = 1
"""Of the form; that of the journal that holds it is `visup.agent.storage.journal.VERSION`."""

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


class RegionValue(_Strict):
    """A part of the image that moves coherently (`visup.agent.Region`)."""

    tag: Literal["Region"] = Field(alias="$")
    id: int
    bbox: Annotated[list[int], Field(min_length=4, max_length=4, description="x, y, width, height")]
    mask: list[int] = Field(
        description="Lengths of runs in reading order within the box: first of pixels that are not of "
        "the region, then of those that are, and so on."
    )
    contour: Chain | ArrayValue
    centroid: Tuple
    area: Number
    velocity: Tuple
    velocity_sigma: Number
    motion: ArrayValue | None
    cut: bool
    confidence: Number
    visible_since: Number | None


class HypothesisValue(_Strict):
    """What a region looks like (`visup.agent.Hypothesis`)."""

    tag: Literal["Hypothesis"] = Field(alias="$")
    region_id: int
    name: str
    view: int
    similarity: Number
    rotation: Number | None
    scale: Number | None
    direction: Tuple | None


class DepthValue(_Strict):
    """Relative depth of a region under one identity (`visup.agent.Depth`)."""

    tag: Literal["Depth"] = Field(alias="$")
    region_id: int
    name: str
    depth: Number
    sigma: Number


class HealthStatusValue(_Strict):
    """State of the camera's image (`visup.agent.HealthStatus`)."""

    tag: Literal["HealthStatus"] = Field(alias="$")
    of: str


class HealthValue(_Strict):
    """State of the camera's image, and why (`visup.agent.Health`)."""

    tag: Literal["Health"] = Field(alias="$")
    status: HealthStatusValue
    detail: str


Value = RegionValue | HypothesisValue | DepthValue | HealthValue | Tuple | ArrayValue | Any
"""Whatever a behaviour reports. Plug-ins' values are JSON values, with objects that have the key '$' for
tuples, arrays, bytes, sets, mappings with other keys than words, and visup's records by their name."""


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
    """The JSON Schema of a recorded step, as it stands in the docs."""
    schema = StepDocument.model_json_schema()
    named = {"$id": f"visup-step-{VERSION}", "title": f"visup: a recorded step, version {VERSION}"}
    return json.dumps({**schema, **named}, indent=1, sort_keys=True) + "\n"


if __name__ == "__main__":
    print(schema_text(), end="")
