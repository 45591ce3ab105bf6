"""Beliefs about an object: presence, identity, pose and rotation."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from visup.agent.model.display import enable_display
from visup.agent.model.records import Region

UNKNOWN_OBJECT = "unknown object"


class Presence(StrEnum):
    """Where an object is believed to be."""

    SEEN = "seen"
    HIDDEN = "hidden"
    LEFT = "left"


@dataclass(frozen=True, slots=True)
class Candidate:
    """An identity that an object may have.

    Attributes:
        name: Model name.
        votes: Time-discounted votes (paper, section 5).
        share: Share of all votes for the object, 0 to 1.
        confidence: Probability that it is the right one, 0 to 1; those of all candidates and that of none of
            the known models sum to 1.
    """

    name: str
    votes: float
    share: float
    confidence: float = 0.0


@dataclass(frozen=True, slots=True)
class Spin:
    """How fast an object turns about itself.

    Attributes:
        rate: Degrees per second, not negative.
        sigma: Standard deviation of `rate`.
        axis: Unit vector in the camera's frame (x right, y down, z forward), about which it turns by
            the right-hand rule.
    """

    rate: float
    sigma: float
    axis: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """Which way an object faces under its most likely identity (paper, section 5, figure 5).

    Attributes:
        name: The model.
        view: Number of the view within the model.
        direction: Unit vector from the object to the viewer in the model's frame.
        rotation: In-plane rotation from view to region, radians, or None when it is not known.
        since: Seconds since when this view is believed.
        confidence: 0 to 1.
        spin: How it turns, or None while that is not known.
    """

    name: str
    view: int
    direction: tuple[float, float, float]
    rotation: float | None
    since: float
    confidence: float = 1.0
    spin: Spin | None = None


@dataclass(frozen=True, slots=True)
class Question:
    """A question to the operator: which of several candidates an object is.

    Attributes:
        object_id: The object.
        names: The candidates, most likely first.
        asked: Seconds.
        text: The sentence, with question mark.
    """

    object_id: int
    names: tuple[str, ...]
    asked: float
    text: str


@dataclass(frozen=True, eq=False)
class ObjectBelief:
    """What is believed about one object.

    Attributes:
        id: Stable number; an object keeps it through occlusion and reappearance.
        region: The region as last seen.
        presence: Seen, hidden or left.
        first_seen: Seconds.
        last_seen: Seconds.
        confirmed: Seen often enough for its entry to be reported.
        candidates: Identities, most likely first; empty while nothing is known.
        depth: Relative depth in the units of the best candidate's model, or None when unknown.
        depth_sigma: Standard deviation of `depth`.
        pose: Which way it faces and how it spins, or None while that is not known.
        unknown: How likely it is none of the models known, 0 to 1.
    """

    id: int
    region: Region
    presence: Presence
    first_seen: float
    last_seen: float
    confirmed: bool = False
    candidates: tuple[Candidate, ...] = ()
    depth: float | None = None
    depth_sigma: float | None = None
    pose: Pose | None = None
    unknown: float = 1.0

    @property
    def name(self) -> str:
        """Most likely identity, or 'unknown object'."""
        return self.candidates[0].name if self.candidates else UNKNOWN_OBJECT

    @property
    def strength(self) -> float:
        """Vote share of the most likely identity, 0 to 1."""
        return self.candidates[0].share if self.candidates else 0.0

    @property
    def confidence(self) -> float:
        """How likely its name is right, 0 to 1; of an unknown object, how likely none is."""
        return self.candidates[0].confidence if self.candidates else self.unknown


@dataclass(frozen=True, slots=True)
class Coupling:
    """Two objects believed to be rigidly connected.

    Attributes:
        objects: Ids, smaller first.
        since: Seconds.
    """

    objects: tuple[int, int]
    since: float


enable_display(Candidate, Coupling, ObjectBelief, Pose, Question, Spin)
