"""Questions to the operator about identities that votes alone do not settle (paper, section 5).

Two names that stay close for a while will hardly be separated by more of the same evidence. The operator is
then asked once, and again only after a long time. The question stays in the mind until it is answered,
settles by itself, or its object is gone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import (
    Directive,
    Event,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Presence,
    Question,
)
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.rules.wording.sentences import role_or_model, spaced


@dataclass(frozen=True, slots=True)
class QuestionSettings:
    """When to ask the operator.

    Attributes:
        close: Difference in likelihood within which two names are close.
        least: Likelihood below which a name is not worth asking about.
        patience_s: How long two names must be close.
        again_s: Least time between two questions about an object.
        most: Most names offered.
    """

    close: float = 0.5
    least: float = 0.1
    patience_s: float = 3.0
    again_s: float = 30.0
    most: int = 3


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """Since when an object's names are close, and when the operator was last asked; seconds or None."""

    since: float | None = None
    asked: float | None = None


QUESTIONS: MemoryKey[Mapping[int, Ambiguity]] = MemoryKey("rules.questions", MappingProxyType({}))


@dataclass(frozen=True, slots=True)
class QuestionReasoner:
    """Reasoner of the cogitate phase, after the votes: maintains the open questions."""

    settings: QuestionSettings = field(default_factory=QuestionSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        old = mind.recall(QUESTIONS)
        open_now = {q.object_id: q for q in mind.questions}
        ambiguities: dict[int, Ambiguity] = {}
        waiting: list[Question] = []
        asked: list[Question] = []
        for belief in mind.present():
            ambiguity = self._updated(belief, old.get(belief.id, Ambiguity()), mind)
            question = open_now.get(belief.id)
            if ambiguity.since is None:
                question = None
            elif question is None and self._ripe(ambiguity, mind.time):
                question = self._question(mind, belief)
                ambiguity = replace(ambiguity, asked=mind.time)
                asked.append(question)
            waiting += [question] if question else []
            if ambiguity != Ambiguity():
                ambiguities[belief.id] = ambiguity
        mind = mind.remember(QUESTIONS, MappingProxyType(ambiguities), questions=tuple(waiting))
        events = tuple(_event(q, observation) for q in asked)
        return Outcome(mind, events, directives=tuple(_directives(waiting)))

    def _updated(self, belief: ObjectBelief, before: Ambiguity, mind: Mind) -> Ambiguity:
        if belief.presence is not Presence.SEEN:
            return before
        close = belief.id not in mind.answers and len(self._names(belief)) > 1
        if not close:
            return replace(before, since=None)
        return before if before.since is not None else replace(before, since=mind.time)

    def _ripe(self, ambiguity: Ambiguity, now: float) -> bool:
        s = self.settings
        again = ambiguity.asked is None or now - ambiguity.asked >= s.again_s
        return (
            again and ambiguity.since is not None and now - ambiguity.since >= s.patience_s - 1e-6
        )

    def _names(self, belief: ObjectBelief) -> tuple[str, ...]:
        """The best name and those close to it."""
        s = self.settings
        best = belief.candidates[0].confidence if belief.candidates else 0.0
        return tuple(
            c.name
            for c in belief.candidates[: s.most]
            if c.confidence >= max(s.least, best - s.close)
        )

    def _question(self, mind: Mind, belief: ObjectBelief) -> Question:
        names = self._names(belief)
        return Question(belief.id, names, mind.time, question_text(mind, belief.id, names))


def question_text(mind: Mind, object_id: int, names: tuple[str, ...]) -> str:
    """The question in words: 'Is object 2 the arm or the guitar?'."""
    phrases = [f"the {spaced(role_or_model(mind, name))}" for name in names]
    return f"Is object {object_id} {', '.join(phrases[:-1])} or {phrases[-1]}?"


def _event(question: Question, observation: Observation) -> Event:
    return Event(
        "question",
        observation.time,
        observation.frame_index,
        question.text,
        (question.object_id,),
        data=MappingProxyType({"names": question.names}),
    )


def _directives(waiting: list[Question]) -> Iterator[Directive]:
    for q in waiting:
        data = {"object": q.object_id, "names": q.names, "question": q.text}
        yield Directive("ask", f"Votes do not tell who object {q.object_id} is.", data)
