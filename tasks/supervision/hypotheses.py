"""Readings: the courses that what was seen may have taken through a task, side by side.

A reading is one state of the course with what is kept about the steps under way and the stages that
lie behind it. Its mass is the probability of all that leads to it, by the forward algorithm
(`forward.py`) with the probabilities of the model (`process.py`): readings of the same state are
merged, their masses add up. The phase of a step is not guessed at here: it is read off what is kept
about it (`verify.py`), so that what is told of a step can be accounted for. The likeliest reading
is what supervision tells, and its mass is how sure that is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from visup.agent import Relation, StageBelief, Status, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.actions.vocabulary import FactEvaluator
from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.backpointers import Trail, longer
from visup.tasks.automaton.derivatives import Leaf, State, Step, leaves, with_leaves
from visup.tasks.automaton.forward import merged, settled
from visup.tasks.automaton.prognosis import Foresight, begun_by
from visup.tasks.automaton.stage_hmm import SUPERVISED, WAITING, Process, Seen
from visup.tasks.automaton.transitions import Place
from visup.tasks.grammar.nodes import Task
from visup.tasks.supervision.advance import Onward, Paths
from visup.tasks.supervision.sentences import outcome
from visup.tasks.verification.observe import Sighting
from visup.tasks.verification.settings import TaskSettings
from visup.tasks.verification.verify import BAD, Watch, entered, over, update

LEAST = 1e-13  # a reading with less of the mass is given up

WORSE = {Status.DONE: 0, Status.UNKNOWN: 1, Status.FAILED: 2}  # the worst ending is told last

# How strongly something speaks for a way on; each time that this rises, it is chosen or not.
NEARER, OVER, BEGUN = 1, 2, 3

See = Callable[[Step], Sighting]


@dataclass(frozen=True)
class Reading:
    """One course that what was seen may have taken.

    Attributes:
        state: Where it is.
        node: The number of that state (see `Automaton`).
        mass: Its probability, given all that was seen.
        best: Probability of the best single way to it, relative to that of all.
        past: Stages that lie behind it, the latest word on each.
        finished: When the task was done by it, or None.
        met: Steps that may come next and whose entry was seen, with the time when it last was.
        weighed: Ways on that were not taken, by their steps, and how strongly they were spoken for.
        trail: The steps that lie behind it, and when each was left.
        gone_on: Whether it has left a step.
    """

    state: State[Watch]
    node: int
    mass: float = 1.0
    best: float = 1.0
    past: tuple[StageBelief, ...] = ()
    finished: float | None = None
    met: tuple[tuple[tuple[Step, ...], float], ...] = ()
    weighed: tuple[tuple[tuple[Step, ...], int], ...] = ()
    trail: Trail | None = None
    gone_on: bool = False

    @property
    def begun(self) -> bool:
        """Whether anything of the task was seen by it."""
        return self.gone_on or any(x.watch.begun is not None for x in leaves(self.state))

    def times(self, factor: float) -> Reading:
        """The same reading, so much likelier."""
        return replace(self, mass=self.mass * factor, best=self.best * factor)


@dataclass(frozen=True)
class Follower:
    """What following the readings of one task needs.

    Attributes:
        task: The task.
        actions: Meanings of its actions, with those of comparisons and zones (see `task_vocabulary`).
        settings: Patience.
        looks: Whether what is no plain relation of the mind holds.
        process: The probabilities of the model.
    """

    task: Task
    actions: Mapping[str, ActionDefinition]
    settings: TaskSettings
    looks: Mapping[str, FactEvaluator] = field(default_factory=dict)
    process: Process = SUPERVISED

    @cached_property
    def automaton(self) -> Automaton:
        """The states of the course, worked out as they are come to."""
        return Automaton(self.task)

    @cached_property
    def foresight(self) -> Foresight:
        """What the model expects of the rest of the task."""
        return Foresight(self.automaton, self.process)

    @cached_property
    def _paths(self) -> Paths:
        return Paths(self.task, self.automaton)

    def start(self, now: float) -> tuple[Reading, ...]:
        """The readings in which the task begins now."""
        found = self._paths.begin(now)
        return tuple(Reading(state, node, 1.0 / len(found)) for state, node in found)

    @cached_property
    def first_steps(self) -> tuple[Step, ...]:
        """The steps with which the task may begin, whenever that is."""
        return tuple(self._paths.first_steps())

    def asked_for(self, node: int) -> tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]:
        """What is asked for at a node of the automaton: actors, and relations between these.

        Of each step under way what it holds and expects, of each that may come next its beginning.
        """
        if node not in self._asked_for:
            self._asked_for[node] = tuple(self._asking(node))
        return self._asked_for[node]

    @cached_property
    def _asked_for(self) -> dict[int, tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]]:
        return {}

    def _asking(self, node: int) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
        for step in self.automaton.steps(node):
            meaning = self.actions[step.action]
            yield step.actors, (meaning.name, *meaning.holds, *meaning.expects)
        for way in self.automaton.ways(node):
            for step in begun_by(self.automaton, way):
                yield step.actors, self.actions[step.action].begins

    def onward(self, reading: Reading, now: float) -> list[Onward]:
        """The ways on from a reading."""
        return self._paths.onward(reading.state, reading.node, now)

    def follow(
        self, readings: tuple[Reading, ...], see: See, now: float, dt: float
    ) -> tuple[Reading, ...]:
        """Take what is seen now into all readings.

        Args:
            readings: As they were.
            see: What is seen now of a step.
            now: Seconds.
            dt: Seconds since the last time.

        Returns:
            At most `most_courses` readings, the likeliest first; their masses sum to 1.
        """
        aged = [self._age(r, see, now, dt) for r in readings]
        grown = (n for r in aged for n in self._go_on(r, see, now, dt))
        found = merged((r.node, r, r.mass, r.best) for r in grown)
        kept = settled(found, self.settings.most_courses, LEAST).kept.values()
        ranked = sorted(kept, key=lambda w: -w.mass)
        return tuple(replace(w.what, mass=w.mass, best=w.best) for w in ranked)

    def next_stages(self, readings: tuple[Reading, ...]) -> dict[str, float]:
        """For each stage the probability that it is the next to begin; the rest is for the end."""
        found: dict[str, float] = {}
        for reading in readings:
            if reading.finished is None:
                for stage, chance in self.foresight.next_stages(reading.node).items():
                    found[stage] = found.get(stage, 0.0) + reading.mass * chance
        return found

    def success(self, readings: tuple[Reading, ...]) -> float:
        """Probability that the course as followed reaches its end, with no stage failed for good."""
        hopes = (
            r.mass * self.foresight.success(self.place(r))
            for r in readings
            if all(p.status is not Status.FAILED for p in r.past)
        )
        return min(1.0, sum(hopes))

    def gain(self, reading: Reading, see: See) -> float:
        """The evidence of a second that a task is going on, as a reading has it.

        The logarithm of how much likelier what is seen is than in a scene where none of it is asked
        for: there what holds is as seldom as here its contrary.
        """
        if reading.finished is not None:
            return 0.0
        return sum(self._gain(x, see(x.step)) for x in leaves(reading.state))

    def _gain(self, leaf: Leaf[Watch], seen: Sighting) -> float:
        fit = self.process.fit
        if not seen.observed or self._over(leaf):
            return 0.0
        if seen.contrary is not None and (seen.stern or seen.holds is not Truth.TRUE):
            return math.log(fit(Seen.CONTRARY, seen.contrary.confidence, 1.0))
        if seen.helps is not None:
            return -math.log(fit(Seen.CONTRARY, seen.helps.confidence, 1.0))
        return 0.0 if leaf.watch.begun is None else math.log(fit(Seen.NEITHER, 1.0, 1.0))

    def place(self, reading: Reading) -> Place:
        """Where a reading is by the model: its phases are read off what is kept of its steps."""
        if reading.finished is not None:
            return Place(END, ())
        return Place(reading.node, tuple(self._phase(x) for x in leaves(reading.state)))

    def _phase(self, leaf: Leaf[Watch]) -> int:
        watch, whole = leaf.watch, self.process.count(leaf.step)
        if watch.status in BAD:
            return whole + (1 if watch.status is Status.FAILING else 2)
        if watch.fulfilled:
            return whole
        return WAITING if watch.begun is None else 1

    def _age(self, reading: Reading, see: See, now: float, dt: float) -> Reading:
        """The same reading after `dt` seconds in which it stays where it is."""
        if reading.finished is not None and now - reading.finished > self.settings.regret_s:
            return reading
        done = reading.finished is not None
        new = [self._look(leaf, see(leaf.step), now, dt, done) for leaf in leaves(reading.state)]
        fits = math.prod(self._fit(x, see(x.step), done, dt) for x in new)
        lost = any(x.watch.status in BAD for x in new)
        return replace(
            reading,
            state=with_leaves(reading.state, iter(new)),
            mass=reading.mass * fits,
            best=reading.best * fits,
            finished=None if lost else reading.finished,
        )

    def _look(
        self, leaf: Leaf[Watch], seen: Sighting, now: float, dt: float, done: bool
    ) -> Leaf[Watch]:
        # A `within` no longer matters once the task is done.
        step = replace(leaf.step, deadlines=()) if done else leaf.step
        meaning = self.actions[step.action]
        watch = update(leaf.watch, step, meaning, seen, now, dt, self.settings)
        return replace(leaf, watch=watch)

    def _fit(self, leaf: Leaf[Watch], seen: Sighting, done: bool, dt: float) -> float:
        """How well `dt` seconds of what is seen fit a step; 1 at best."""
        if not seen.observed:
            return self.process.fit(Seen.UNKNOWN, 1.0, dt)
        if seen.contrary is not None and (seen.stern or seen.holds is not Truth.TRUE):
            return self.process.fit(Seen.CONTRARY, seen.contrary.confidence, dt)
        if done or self._over(leaf) or (seen.helps is not None and leaf.watch.held):
            return 1.0
        if seen.helps is not None or leaf.watch.begun is None:
            return math.exp(-self.process.begin * dt)  # it has not begun to hold in all that time
        return self.process.fit(Seen.NEITHER, 1.0, dt)

    def _over(self, leaf: Leaf[Watch]) -> bool:
        return over(leaf.watch, leaf.step, self.actions[leaf.step.action])

    def _go_on(self, reading: Reading, see: See, now: float, dt: float) -> Iterator[Reading]:
        """A reading and those that come out of it by leaving a step."""
        ways = self.onward(reading, now)
        reading = replace(reading, met=self._met(reading, ways, see, now))
        ends = [w for w in ways if w.ends and self._may_end(w)]
        if ends and reading.finished is None:
            reading = replace(reading, finished=now)
        open_to = [(w, self._spoken_for(reading, w, see, now)) for w in ways if not w.ends]
        open_to = [(w, level) for w, level in open_to if level > 0]
        # Where the steps are over by themselves, nothing is left to stay for but the end.
        shares = sum(w.share for w, _ in open_to) or 1.0
        forced = not ends and any(level >= OVER and self._all_over(w) for w, level in open_to)
        gone = 0.0
        for way, level in open_to:
            chance = self._chance(reading, way, level, bool(ends), dt) * way.share / shares
            if forced:
                chance = way.share / shares * self._skipped(way)
            if chance > 0.0:
                gone += chance
                yield self._moved(reading, way, chance, see, now)
        if not forced:
            weighed = tuple((w.entered, level) for w, level in open_to)
            yield replace(reading, weighed=weighed).times(max(0.0, 1.0 - gone))

    def _may_end(self, way: Onward) -> bool:
        return all(x.watch.fulfilled and x.watch.status not in BAD for x in way.left)

    def _all_over(self, way: Onward) -> bool:
        return all(self._over(x) for x in way.left)

    def _spoken_for(self, reading: Reading, way: Onward, see: See, now: float) -> int:
        """How strongly something speaks for a way on; 0 when nothing does."""
        finished = self._all_over(way)
        if not finished and all(self._goes_on(s, way.left) for s in way.entered):
            return 0
        if way.entered and self._seen(reading, way, see, now):
            return BEGUN
        if finished:
            return OVER
        return NEARER if all(self._comes(s, see(s), now) for s in way.entered) else 0

    def _chance(self, reading: Reading, way: Onward, level: int, ends: bool, dt: float) -> float:
        """Probability that the course goes on now by a way that is spoken for."""
        seen_through = self._skipped(way)
        if level <= dict(reading.weighed).get(way.entered, 0):
            # What was told already is told once; but what was seen to begin may begin later on.
            return seen_through * -math.expm1(-self.process.leave * dt) if level == BEGUN else 0.0
        if level == BEGUN:
            return seen_through * (1.0 - self.process.spurious)
        if level == OVER:
            return 0.5 if ends else 1.0
        return seen_through * self.process.unseen

    def _seen(self, reading: Reading, way: Onward, see: See, now: float) -> bool:
        """Whether all that a way enters has been seen to begin, and nothing says "not yet"."""
        if any(see(s).not_yet for s in way.entered):
            return False
        return now - dict(reading.met).get(way.entered, -math.inf) <= self.settings.contact_s

    def _met(
        self, reading: Reading, ways: list[Onward], see: See, now: float
    ) -> tuple[tuple[tuple[Step, ...], float], ...]:
        """When the entry to each move was last seen, with what is seen now."""
        met = dict(reading.met)
        for way in ways:
            signs = (see(s).entry for s in way.entered)
            if way.entered and all(self._enters(sign, now) for sign in signs):
                met[way.entered] = now
        return tuple(met.items())

    def _enters(self, sign: Relation | None, now: float) -> bool:
        """Whether a sign of a step has lasted long enough."""
        return sign is not None and now - sign.since >= self.settings.enter_s - 1e-9

    def _comes(self, step: Step, seen: Sighting, now: float) -> bool:
        """Whether a step is seen to come nearer; one whose course says when it begins only begins."""
        return step.sign("begins") is None and self._enters(seen.helps, now)

    def _goes_on(self, step: Step, left: tuple[Leaf[Watch], ...]) -> bool:
        """Whether a step asks for what is going on already: it can only begin once that ceased."""
        return any(step.same_as(x.step) and not x.watch.ceased for x in left)

    def _skipped(self, way: Onward) -> float:
        """Probability that the steps that a way leaves are left as they stand."""
        return math.prod(self._passed_over(x) for x in way.left)

    def _passed_over(self, leaf: Leaf[Watch]) -> float:
        if leaf.watch.fulfilled:
            return 1.0
        lasts = self.actions[leaf.step.action].lasts
        missed = not lasts and not leaf.watch.held and leaf.watch.broken_since is not None
        return self.process.pass_over ** (2 if missed else 1)

    def _moved(self, reading: Reading, way: Onward, chance: float, see: See, now: float) -> Reading:
        opened = self._seen(reading, way, see, now)
        state, node = self._paths.taken(way, reading.state, entered(now))
        fresh = [
            self._look(_opened(x, opened), see(x.step), now, 0.0, False) if i in way.fresh else x
            for i, x in enumerate(leaves(state))
        ]
        under_way = {x.step.stage for x in fresh}
        told = {p.stage: p for p in reading.past}
        endings = sorted((self._ending(x, now) for x in way.left), key=lambda e: WORSE[e.status])
        for ending in endings:
            failed = ending.status is Status.FAILED
            before = told.get(ending.stage)
            if before is not None and before.status is Status.FAILED:
                continue  # there is no way back from that
            if ending.stage not in under_way or failed:
                told[ending.stage] = ending
        now_at = with_leaves(state, iter(fresh))
        past = tuple(told.values())
        trail = longer(reading.trail, tuple(x.step for x in way.left), now)
        mass, best = reading.mass * chance, reading.best * chance
        return Reading(now_at, node, mass, best, past, trail=trail, gone_on=True)

    def _ending(self, leaf: Leaf[Watch], now: float) -> StageBelief:
        """How the stage of a step ends when it ends with this step."""
        status, why = outcome(leaf.step, self.actions[leaf.step.action], leaf.watch, now)
        return StageBelief(leaf.step.stage, status, now, leaf.watch.confidence, why)


def _opened(leaf: Leaf[Watch], opened: bool) -> Leaf[Watch]:
    return replace(leaf, watch=replace(leaf.watch, opened=True)) if opened else leaf


def confidence(readings: tuple[Reading, ...]) -> float:
    """How likely the reading is that is told: its probability, given all that was seen."""
    return readings[0].mass if readings else 0.0
