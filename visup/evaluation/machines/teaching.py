"""From the outlines of a brief to taught views, and to a model database that holds them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.evaluation.machines.clips import Brief, Outline
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.taught.view import TaughtView, taught_view
from visup.percepts.video import open_source


def frame_of(video: Path, index: int) -> NDArray[np.uint8]:
    """One frame of a video, (H, W, 3) uint8 BGR.

    Raises:
        SettingsError: The video has no such frame.
        SourceError: It cannot be opened.
    """
    with open_source(str(video)) as source:
        for frame in source:
            if frame.index >= index:
                return frame.image
    raise SettingsError(
        f"the video has no frame {index}, on which a thing is outlined", where=str(video)
    )


def taught_views(outlines: Sequence[Outline]) -> list[TaughtView]:
    """What a user shows with some outlines; each picture is read once.

    Raises:
        SettingsError: A picture is missing, or an outline shows nothing.
    """
    places = dict.fromkeys((o.video, o.frame) for o in outlines)
    pictures = {place: frame_of(*place) for place in places}
    return [taught_view(o.name, pictures[o.video, o.frame], o.corners) for o in outlines]


def taught_database(brief: Brief, path: Path) -> ModelDatabase:
    """A new model database with all that a brief shows."""
    return ModelDatabase.open_or_new(path).teach(taught_views((*brief.actors, *brief.others)))
