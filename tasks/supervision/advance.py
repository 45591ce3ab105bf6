"""Advancing hypotheses: the transitions that observations support, and their probabilities."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from visup.agent import Relation, StageBelief, Status, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.backpointers import Backpointer, behind, extended
from visup.tasks.automaton.entries import held_on_entry, observed_entries
from visup.tasks.automaton.states import Leaf, TaskStep, leaves, with_leaves
from visup.tasks.supervision.hypotheses import Successor, Support, TaskHypothesis
from visup.tasks.supervision.open_transitions import (
    OpenTransition,
    earliest_end,
    goes_on,
    missed,
)
from visup.tasks.supervision.sentences import lasted, outcome
from visup.tasks.verification.reported_relations import (
    ReportedRelations,
    merged_reports,
    with_reported,
)
from visup.tasks.verification.step_model import Observe, StepModel
from visup.tasks.verification.step_monitor import BAD, Moment, StepMonitor, entered, without_hold

WORSE = {Status.DONE: 0, Status.UNKNOWN: 1, Status.FAILED: 2}  # the worst ending is reported last

BEFORE_S = 0.5
"""Tolerance for a beginning before its turn, seconds: relations are evaluated with delays of this order."""

Supported = Sequence[tuple[OpenTransition, Support]]


@dataclass(frozen=True)
class Advance:
    """Advances hypotheses by one time step.

    Attributes:
        steps: Interprets the monitors of steps.
        observe: Gives the present observation of a step.
        now: Seconds.
        dt: Seconds since the last step.
    """

    steps: StepModel
    observe: Observe
    now: float
    dt: float

    def outcomes(
        self, hypothesis: TaskHypothesis, transitions: Sequence[OpenTransition]
    ) -> Iterator[Successor]:
        """A hypothesis and its successors by completing a step.

        Paused steps are not completed.
        """
        if all(self.observe(x.step).paused for x in leaves(hypothesis.state)):
            yield hypothesis.node, lambda: hypothesis, 1.0
            return
        present = [(t, self._is_paused(t)) for t in transitions if not self._awaits(t)]
        barred = tuple(t.entered for t, paused in present if paused)
        transitions = [t for t, paused in present if not paused]
        hypothesis = self._met(hypothesis, transitions)
        ends = any(t.ends and t.may_end for t in transitions)
        if ends and hypothesis.finished is None:
            hypothesis = replace(hypothesis, finished=self.now)
        ways = len({t.entered for t in transitions if not t.ends})
        # A course that may end needs no further round of its last step.
        onward = [t for t in transitions if not t.ends and not (ends and t.again)]
        supported = [(t, s) for t in onward if (s := self._support(hypothesis, t, ways))]
        due = 0.0  # share of another round, which waits until the last one has ceased
        if all(s <= Support.OVER for _, s in supported):
            due = sum(t.share for t in transitions if t.waits and self._all_over(t))
        # If all steps are over by themselves, only the end of the course or another round justifies
        # staying.
        forced = not (ends or due) and any(
            s >= Support.OVER and self._all_over(t) for t, s in supported
        )
        gone = 0.0
        for transition, chance in self._chances(hypothesis, supported, due, ends, forced):
            if chance > 0.0:
                gone += chance
                moved = partial(self._moved, hypothesis, transition)
                yield transition.transition.target, moved, chance
        if not forced:
            considered = tuple((t.entered, support) for t, support in supported)
            considered += tuple(c for c in hypothesis.considered if c[0] in barred)
            stayed = replace(hypothesis, considered=considered)
            yield stayed.node, lambda: stayed, max(0.0, 1.0 - gone)

    def _awaits(self, transition: OpenTransition) -> bool:
        """Whether a transition begins a round of a loop whose new actor is not present."""
        return any(self.observe(s).absent for s in transition.entered)

    def _is_paused(self, transition: OpenTransition) -> bool:
        """Whether any step that a transition completes is paused."""
        return any(self.observe(x.step).paused for x in transition.left)

    def _chances(
        self,
        hypothesis: TaskHypothesis,
        supported: Supported,
        due: float,
        ends: bool,
        forced: bool,
    ) -> Iterator[tuple[OpenTransition, float]]:
        shares = due + sum(t.share for t, _ in supported) or 1.0
        for transition, support in supported:
            if forced:
                yield transition, transition.share / shares * self._skipped(transition)
            else:
                chance = self._chance(hypothesis, transition, support, ends)
                yield transition, chance * transition.share / shares

    def _all_over(self, transition: OpenTransition) -> bool:
        return all(self.steps.over(x) for x in transition.left)

    def _unreached(self, transition: OpenTransition) -> float | None:
        """Since when all steps that it completes are over without reaching their goal, seconds, or None."""
        held = [x.payload.held and x.step.hold_s is None for x in transition.left]
        pairs = zip(transition.left, held, strict=True)
        since = [self.observe(x.step).unreached if h else None for x, h in pairs]
        known = [s for s in since if s is not None]
        return max(known, default=None) if len(known) == len(since) else None

    def _going_on(self, transition: OpenTransition) -> list[TaskStep]:
        """The steps with `for` that a transition completes and that still hold."""
        lasting = (x.step for x in transition.left if x.step.hold_s is not None)
        return [s for s in lasting if self.observe(s).holds is Truth.TRUE]

    def _goes_round(self, transition: OpenTransition) -> bool:
        """Whether the observed beginning is only an effect of moving around an object to stay near it."""
        near = [set(s.actors) for s in self._going_on(transition)]
        return any(set(s.actors) in near and self.observe(s).round for s in transition.entered)

    def _support(
        self, hypothesis: TaskHypothesis, transition: OpenTransition, ways: int
    ) -> Support:
        """How strongly an observation supports a transition, given the number of alternatives."""
        finished = self._all_over(transition) or self._unreached(transition) is not None
        if self._goes_round(transition):
            return Support.NONE
        same = all(goes_on(s, transition.left) for s in transition.entered)
        if same and (not finished or transition.waits):
            return Support.NONE
        opens = transition.entered and self._opens(hypothesis, transition)
        # With several alternatives, an entry alone supports none of them (touching may precede coupling or
        # retreat); a holding action does.
        if opens and (ways == 1 or all(self._holds(s) for s in transition.entered)):
            return Support.BEGUN if self._skipped(transition) == 1.0 else Support.EARLY
        if finished and not self._going_on(transition):
            return Support.OVER
        # A failing step is not passed without the next one being observed.
        fails = any(x.payload.status in BAD for x in transition.left)
        nearer = ways == 1 and not fails and all(self._nearer(s) for s in transition.entered)
        return Support.NEARER if nearer else Support.NONE

    def _chance(
        self, hypothesis: TaskHypothesis, transition: OpenTransition, support: Support, ends: bool
    ) -> float:
        """Probability that a supported transition is taken now."""
        hmm, skipped = self.steps.hmm, self._skipped(transition)
        if support <= dict(hypothesis.considered).get(transition.entered, Support.NONE):
            # Evidence counts once; but an observed entry may become a beginning later.
            late = -math.expm1(-hmm.leave * self.dt)
            return skipped * late if support >= Support.EARLY else 0.0
        if support >= Support.EARLY:
            return skipped * (1.0 - hmm.spurious)
        if support is Support.OVER:
            return 0.5 if ends else 1.0
        return skipped * hmm.unseen

    def _opens(self, hypothesis: TaskHypothesis, transition: OpenTransition) -> bool:
        """Whether the beginnings of all steps that a transition enters were observed."""
        met = dict(hypothesis.met).get(transition.entered, -math.inf)
        longest = self.steps.settings.contact_s
        return all(self.observe(s).elapsed(s, met, self.now) <= longest for s in transition.entered)

    def _met(
        self, hypothesis: TaskHypothesis, transitions: Sequence[OpenTransition]
    ) -> TaskHypothesis:
        """A hypothesis with the entries to next steps, and to transitions, that are observed now."""
        possible = [
            t.entered for t in transitions if not (self._goes_round(t) or t.waits) and t.entered
        ]
        entries, met = observed_entries(
            (hypothesis.entries, hypothesis.met),
            possible,
            self._entry,
            self.now,
            refuted=lambda step: self.observe(step).carried_past,
            held_by=lambda step: self.observe(step).held_by,
        )
        return replace(hypothesis, entries=entries, met=met)

    def _holds(self, step: TaskStep) -> bool:
        """Whether a step holds, or a trend by which it holds has just set in."""
        seen = self.observe(step)
        return seen.holds is Truth.TRUE or seen.new_trend is not None

    def _entry(self, step: TaskStep) -> Relation | None:
        """The relation by which a step is observed to begin: one that has lasted, or is sudden; or None."""
        seen = self.observe(step)
        return seen.entry if seen.new_trend is not None or self._lasted(step, seen.entry) else None

    def _lasted(self, step: TaskStep, relation: Relation | None) -> bool:
        """Whether a relation by which a step begins has lasted long enough."""
        if relation is None:
            return False
        lasted = self.observe(step).elapsed(step, relation.since, self.now)
        return lasted >= self.steps.settings.enter_s - 1e-9

    def _nearer(self, step: TaskStep) -> bool:
        """Whether a step is approaching; one with its own begin condition does not."""
        return step.condition("begins") is None and self._lasted(step, self.observe(step).helps)

    def _skipped(self, transition: OpenTransition) -> float:
        """Probability of completing the steps of a transition in their current state."""
        met = transition.completed_by_meeting(self.observe)
        return math.prod(self._passed_over(x) for x in transition.left if x.step not in met)

    def _passed_over(self, leaf: Leaf[StepMonitor]) -> float:
        # What held, without a required duration, is over as soon as the next is observed.
        lasts, held = self.steps.actions[leaf.step.action].lasts, leaf.payload.held
        if leaf.payload.fulfilled or (held and not lasts and leaf.step.hold_s is None):
            return 1.0
        denied = not lasts and not leaf.payload.held and leaf.payload.broken_since is not None
        return self.steps.hmm.pass_over ** (2 if denied else 1)

    def _moved(self, hypothesis: TaskHypothesis, transition: OpenTransition) -> TaskHypothesis:
        opened, unreached = self._opens(hypothesis, transition), self._unreached(transition)
        state = transition.taken(leaves(hypothesis.state), entered(self.now))
        begun = set(transition.transition.begun)
        under_way = [
            self._begun(self._after(self._in_turn(x, transition), transition), opened, unreached)
            if i in begun
            else x
            for i, x in enumerate(leaves(state))
        ]
        if opened:
            held = held_on_entry(hypothesis.entries, transition.entered, self._holds)
            under_way = [
                self.steps.held_before(x, self.observe(x.step), held[x.step], self.now)
                if x.step in held
                else x
                for x in under_way
            ]
        early = self._early(hypothesis, transition)
        if early:
            under_way = [
                replace(x, payload=replace(without_hold(x.payload), early=True))
                if i in begun and x.step in early
                else x
                for i, x in enumerate(under_way)
            ]
        stages = {x.step.stage for x in under_way}
        return TaskHypothesis(
            with_leaves(state, iter(under_way)),
            transition.transition.target,
            self._past(hypothesis, transition, stages),
            backpointer=extended(hypothesis.backpointer, transition.completed, self.now),
            gone_on=True,
            lasting="" if opened or unreached is not None else self._lasting(transition, stages),
            contact_entry=transition.contact_entry(hypothesis, self.observe, self.now),
        )

    def _lasting(self, transition: OpenTransition, under_way: Collection[str]) -> str:
        """The stage that a transition completes though it lasts until the next one begins, or empty."""
        left = (x for x in transition.left if x.step.stage not in under_way)
        lasts = (x.step.stage for x in left if self.steps.actions[x.step.action].lasts)
        return next((s for s in lasts if not self._all_over(transition)), "")

    def _early(
        self, hypothesis: TaskHypothesis, transition: OpenTransition
    ) -> Collection[TaskStep]:
        """The steps that a transition enters, if all have held since before the steps it completes began.

        Actions that last until something else begins (`converging`) may begin before their turn, and so may
        measurements: if one is entered, none is early. Steps of actors of whom something was required before
        continue that, and are left out, unless they undo it.
        """
        if not transition.entered or any(
            s.already or s.has_stage_conditions for s in transition.entered
        ):
            return ()
        turn = transition.turn
        if turn is None:
            return ()  # not known if the completed steps were never observed
        now = {frozenset(x.step.actors) for x in transition.left}
        passed = tuple(behind(hypothesis.backpointer))
        new = [s for s in transition.entered if not self._continues(s, now, passed)]
        return new if all(self._before(s, turn) for s in new) else ()

    def _before(self, step: TaskStep, turn: float) -> bool:
        """Whether a step held well before a time."""
        meaning, seen = self.steps.actions[step.action], self.observe(step)
        if meaning.lasts or meaning.measures or seen.held_by is None:
            return False
        return seen.elapsed(step, seen.held_by.since, turn) > BEFORE_S

    def _continues(
        self, step: TaskStep, now: Collection[frozenset[str]], passed: Sequence[Backpointer]
    ) -> bool:
        """Whether a step continues an earlier step of the same actors."""
        actors = frozenset(step.actors)
        if actors in now:
            return True
        last = next((b for b in passed if frozenset(b.step.actors) == actors), None)
        held_by = self.observe(step).held_by
        return last is not None and not (held_by and self._undone(step, held_by.since, last))

    def _undone(self, step: TaskStep, since: float, last: Backpointer) -> bool:
        """Whether a step that holds since a time has undone an earlier one that was observed before then."""
        if last.begun is None or since < last.begun:
            return False
        undoes = self.steps.actions[step.action].undoes
        return not set(undoes).isdisjoint(self.steps.actions[last.step.action].holds)

    def _in_turn(self, leaf: Leaf[StepMonitor], transition: OpenTransition) -> Leaf[StepMonitor]:
        """A beginning step with the time from which its evidence counts, and the reports made before it."""
        left = transition.left
        same = any(leaf.step.same_as(x.step) for x in left)
        begun = (x.payload.begun for x in left)
        turn = math.inf if same else min((b for b in begun if b is not None), default=-math.inf)
        reported = merged_reports(self._reports(x, transition) for x in left)
        earliest = max((earliest_end(x) for x in left), default=-math.inf)
        monitor = replace(leaf.payload, turn=turn, reported=reported, earliest=earliest)
        return replace(leaf, payload=monitor)

    def _reports(self, left: Leaf[StepMonitor], transition: OpenTransition) -> ReportedRelations:
        """The reports after a step is completed: about it and its predecessors."""
        step, monitor = left.step, left.payload
        if self._ending(left, followed := self._followed(transition)).status is not Status.DONE:
            return monitor.reported
        meaning, denied = self.steps.actions[step.action], self._denied(step)
        _, until = lasted(step, meaning, monitor, self.now, followed, denied)
        until = self.now if until is None else until
        return with_reported(monitor.reported, step.actors, meaning.name, until)

    def _after(self, leaf: Leaf[StepMonitor], transition: OpenTransition) -> Leaf[StepMonitor]:
        """A beginning step with the end of its predecessor, from which its delay counts."""
        if leaf.step.delay is None:
            return leaf
        over = max((self._over_at(x) for x in transition.left), default=self.now)
        return replace(leaf, payload=replace(leaf.payload, after=over))

    def _over_at(self, left: Leaf[StepMonitor]) -> float:
        """When a step ended; for one that lasts until the next begins, when it was last observed."""
        at = left.payload.fulfilled_at if self.steps.over(left) else left.payload.helped_at
        return self.now if at is None else at

    def _begun(
        self, leaf: Leaf[StepMonitor], opened: bool, unreached: float | None
    ) -> Leaf[StepMonitor]:
        """A step that begins now, with its first observation."""
        seen = self.observe(leaf.step)
        if opened:
            leaf = replace(leaf, payload=replace(leaf.payload, opened=True))
        if unreached is not None:
            leaf = Leaf(leaf.step, missed(leaf.payload, seen, unreached, self.now))
        return self.steps.observed(leaf, seen, Moment(self.now, 0.0), False)

    def _past(
        self, hypothesis: TaskHypothesis, transition: OpenTransition, under_way: set[str]
    ) -> tuple[StageBelief, ...]:
        """The latest beliefs about completed stages after a transition."""
        found = {p.stage: p for p in hypothesis.past}
        followed = self._followed(transition)
        left = (self._ending(x, followed) for x in transition.left)
        for ending in sorted(left, key=lambda e: WORSE[e.status]):
            failed = ending.status is Status.FAILED
            before = found.get(ending.stage)
            if before is not None and before.status is Status.FAILED:
                continue  # failure is final
            if ending.stage not in under_way or failed:
                found[ending.stage] = ending
        return tuple(found.values())

    def _followed(self, transition: OpenTransition) -> tuple[float, ...]:
        """Since when each observed step that a transition enters has been observed."""
        seen = (self.observe(s) for s in transition.entered)
        return tuple(r.since for o in seen if (r := o.helps or o.entry) is not None)

    def _ending(self, leaf: Leaf[StepMonitor], followed: Sequence[float]) -> StageBelief:
        """The belief about a stage that ends with this step."""
        meaning = self.steps.actions[leaf.step.action]
        denied = self._denied(leaf.step)
        status, why = outcome(leaf.step, meaning, leaf.payload, self.now, followed, denied)
        return StageBelief(leaf.step.stage, status, self.now, leaf.payload.confidence, why)

    def _denied(self, step: TaskStep) -> float | None:
        """Since when a step's action has been contradicted, or None."""
        contrary = self.observe(step).contrary
        return None if contrary is None else contrary.since
