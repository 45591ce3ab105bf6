"""Presence: data association and the lifecycle of objects, from first region to deletion.

Read in this order: `association.py` (region to object), `objects.py` (percepts enter the mind, objects are
forgotten), `reasoner.py` (one step), `lifecycle.py` (states and transitions), then the modules that decide on
transitions: `initiation.py` (entry), `fragments.py` (parts that are not objects), `occlusion.py` (occlusion,
exit, loss, reappearance), `merging.py` (two objects in one region) and `reidentification.py` (the same object
under another region). `object_tracks.py` is the memory of each object, `step_context.py` the state of a step
in progress, `settings.py` the thresholds.
"""

from visup.rules.presence.objects import ObjectReasoner, ObjectSettings
from visup.rules.presence.reasoner import PresenceReasoner
from visup.rules.presence.settings import PresenceSettings

__all__ = ["ObjectReasoner", "ObjectSettings", "PresenceReasoner", "PresenceSettings"]
