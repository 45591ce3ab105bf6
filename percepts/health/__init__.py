"""Health of the camera's image."""

from visup.percepts.health.behaviour import HealthBehaviour
from visup.percepts.health.settings import HealthSettings

__all__ = ["HealthBehaviour", "HealthSettings"]
