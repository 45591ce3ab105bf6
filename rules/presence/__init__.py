"""Who is there: data association and the life of an object, from first region to deletion.

Read in this order: `association.py` (which region belongs to which object), `objects.py` (percepts
enter the mind, objects are forgotten), `reasoner.py` (one step on one screen), `lifecycle.py` (the states and
every change of them), then who decides about these: `initiation.py` (entry), `fragments.py` (parts that are
no objects), `occlusion.py` (occlusion, exit, loss, reappearance), `merging.py` (two seen as one region)
and `reidentification.py` (the same object under another region). `object_tracks.py` is what is
remembered of each object, `step_context.py` the step in the making, `settings.py` the thresholds.
"""

from visup.rules.presence.objects import ObjectReasoner, ObjectSettings
from visup.rules.presence.reasoner import PresenceReasoner
from visup.rules.presence.settings import PresenceSettings

__all__ = ["ObjectReasoner", "ObjectSettings", "PresenceReasoner", "PresenceSettings"]
