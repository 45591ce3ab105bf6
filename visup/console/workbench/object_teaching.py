"""Teaches clicked objects: saves the view of an object at a moment to a model database."""

from __future__ import annotations

from pathlib import Path

from visup.agent import Presence
from visup.agent.model.errors import OutputError, SettingsError
from visup.console.run_view import RunView
from visup.percepts.taught.taught_view import taught_view_from_mask
from visup.teaching.outline_teaching import TeachingResult, store

MODELS = "console.models"
"""The model database in the `save_to` folder; further views are added to it."""


def teach_object(
    run: RunView, number: int, object_id: int, name: str, folder: Path
) -> TeachingResult:
    """Save the appearance of an object at a moment as a view of a model.

    Args:
        run: The run.
        number: Number of the moment, from 0.
        object_id: The object.
        name: Name of the model.
        folder: Folder of the database.

    Raises:
        VisupError: The object is not visible, the video is missing, or the database cannot be written.
    """
    mind = run.mind(number)
    belief = mind.objects.get(object_id)
    if belief is None or belief.presence is not Presence.SEEN:
        raise SettingsError(
            f"object {object_id} is not seen at this moment",
            hint="go to a moment that shows it clearly",
        )
    picture = run.pictures.source_frame(mind)
    if picture is None:
        why = run.pictures.problem or "the video shows frames of another size"
        raise OutputError(
            f"there is no picture of this moment: {why[:1].lower()}{why[1:]}", where=run.folder.name
        )
    view = taught_view_from_mask(name, picture, belief.region.full_mask(mind.frame_size))
    return store(folder / MODELS, [view])
