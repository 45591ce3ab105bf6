"""Objects that were clicked become models: what is seen of one at a moment is a taught view of it."""

from __future__ import annotations

from pathlib import Path

from visup.agent import Presence
from visup.agent.model.errors import OutputError, SettingsError
from visup.console.run_view import RunView
from visup.percepts.taught.view import taught_mask
from visup.teaching.lesson import Lesson, store

MODELS = "console.models"
"""The model database in the folder for what operators save; each further view is added to it."""


def remember(run: RunView, number: int, object_id: int, name: str, folder: Path) -> Lesson:
    """Keep what an object looks like at a moment as a view of a model.

    Args:
        run: The run.
        number: Of the moment, from 0.
        object_id: The object.
        name: Of the model.
        folder: Where the database is.

    Raises:
        VisupError: The object is not seen then, the video is gone, or the database cannot be written.
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
    view = taught_mask(name, picture, belief.region.full_mask(mind.frame_size))
    return store(folder / MODELS, [view])
