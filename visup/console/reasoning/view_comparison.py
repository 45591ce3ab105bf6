"""Pictures that explain an identification: the silhouette next to the most similar views."""

from __future__ import annotations

from visup.agent.model.errors import OutputError
from visup.console.drawing.pictures import jpeg
from visup.console.run_view import RunView
from visup.percepts.shape.drawing.pictures import match_picture
from visup.percepts.shape.silhouette.silhouette import normalise

VIEW_COUNT = 3
"""Number of views shown."""


def view_comparison_picture(run: RunView, number: int, object_id: int) -> bytes:
    """The silhouette of an object, and the most similar views at its last match.

    All views are searched again: the run may have searched only the models named by its tasks.

    Args:
        run: The run.
        number: Number of the moment, from 0.
        object_id: The object.

    Returns:
        A JPEG.

    Raises:
        VisupError: The run has no models, they cannot be read, or the object was never matched.
    """
    moment, _ = run.last_match(number, object_id)
    belief = run.mind(moment).objects.get(object_id) if moment is not None else None
    if moment is None or belief is None or run.models is None:
        raise OutputError(f"no model was compared with object {object_id}", where=run.folder.name)
    silhouette = normalise(belief.region.mask, cut=belief.region.cut)
    if silhouette is None:
        raise OutputError(f"object {object_id} has no outline there", where=run.folder.name)
    ranking = run.models.query(silhouette, top=VIEW_COUNT)
    title = f"Object {object_id} in frame {run.frames[moment]}"
    return jpeg(match_picture(run.models, silhouette, ranking, title, VIEW_COUNT))
