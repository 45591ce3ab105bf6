"""Readings: the courses that what was seen may have taken through a task, side by side.

A reading is one state of the course with what is kept about the steps under way, the stages that
lie behind it, and a cost: seconds in which what was seen did not fit. The cheapest reading is what
supervision tells. Costs stand where a probabilistic parser has log probabilities, so that such a
parser can take the place of `follow` without anything around it changing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from visup.agent import Relation, StageBelief, Status, Truth
from visup.agent.changing import replace
from visup.tasks.actions import Meaning
from visup.tasks.course import (
    Leaf,
    Move,
    State,
    Step,
    begin,
    enter,
    form,
    leaves,
    moves,
    with_leaves,
)
from visup.tasks.observe import Sighting
from visup.tasks.sentences import outcome
from visup.tasks.settings import TaskSettings
from visup.tasks.tree import Task
from visup.tasks.verify import BAD, Watch, entered, over, update
from visup.tasks.vocabulary import Look

CONTRARY, IDLE, UNOBSERVED, WAITING = 1.0, 0.2, 0.05, 0.02  # cost per second of one step
STAYED = 0.5  # cost of staying, once, when what comes next was seen to begin
GUESSED = 0.4  # cost of going on when what comes next is seen to come nearer, not yet to begin
SKIPPED = 1.5  # cost of leaving a step that was not seen through
MISSED = 3.0  # cost of leaving a step that was seen not to happen
SHARPNESS = 5.0  # how fast a reading loses credit with its cost
WORST = 6.0  # a reading that costs so much more than the best is given up

WORSE = {Status.DONE: 0, Status.UNKNOWN: 1, Status.FAILED: 2}  # the worst ending is told last

See = Callable[[Step], Sighting]


@dataclass(frozen=True, slots=True)
class Reading:
    """One course that what was seen may have taken.

    Attributes:
        state: Where it is.
        cost: How badly it fits, 0 for the best.
        past: Stages that lie behind it, the latest word on each.
        finished: When the task was done by it, or None.
        met: Steps that may come next and whose entry was seen, with the time when it last was.
        stayed: Whether it has paid for staying where it is.
        gone_on: Whether it has left a step.
    """

    state: State[Watch]
    cost: float = 0.0
    past: tuple[StageBelief, ...] = ()
    finished: float | None = None
    met: tuple[tuple[tuple[Step, ...], float], ...] = ()
    stayed: bool = False
    gone_on: bool = False

    @property
    def begun(self) -> bool:
        """Whether anything of the task was seen by it."""
        return self.gone_on or any(x.watch.begun is not None for x in leaves(self.state))


@dataclass(frozen=True, slots=True)
class Follower:
    """What following the readings of one task needs.

    Attributes:
        task: The task.
        actions: Meanings of its actions, with those of comparisons and zones (see `vocabulary`).
        settings: Patience.
        looks: Whether what is no plain relation of the mind holds.
    """

    task: Task
    actions: Mapping[str, Meaning]
    settings: TaskSettings
    looks: Mapping[str, Look] = field(default_factory=dict)
    _started: list[tuple[Task | None, float, tuple[Reading, ...]]] = field(
        default_factory=lambda: [(None, 0.0, ())], init=False, repr=False, compare=False
    )

    def start(self, now: float) -> tuple[Reading, ...]:
        """The readings in which the task begins now."""
        of, then, readings = self._started[0]
        if of is not self.task or then != now:
            # Asked for several times in each step while the task has not begun.
            ways = enter(self.task, begin(self.task), entered(now), now)
            readings = tuple(Reading(s) for s in ways if s is not None)
            self._started[0] = self.task, now, readings
        return readings

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
            At most `most_courses` readings, the cheapest first; its cost is 0.
        """
        aged = [self._age(r, see, now, dt) for r in readings]
        return self._best(n for r in aged for n in self._go_on(r, see, now))

    def _age(self, reading: Reading, see: See, now: float, dt: float) -> Reading:
        """The same reading after `dt` seconds in which it stays where it is."""
        if reading.finished is not None and now - reading.finished > self.settings.regret_s:
            return reading
        done = reading.finished is not None
        new = [self._look(leaf, see(leaf.step), now, dt, done) for leaf in leaves(reading.state)]
        cost = reading.cost + dt * sum(self._cost(x, see(x.step), done) for x in new)
        lost = any(x.watch.status in BAD for x in new)
        return replace(
            reading,
            state=with_leaves(reading.state, iter(new)),
            cost=cost,
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

    def _cost(self, leaf: Leaf[Watch], seen: Sighting, done: bool) -> float:
        if not seen.observed:
            return UNOBSERVED
        if seen.contrary is not None and (seen.stern or seen.holds is not Truth.TRUE):
            return CONTRARY
        if seen.helps is not None or done or self._over(leaf):
            return 0.0
        return WAITING if leaf.watch.begun is None else IDLE

    def _over(self, leaf: Leaf[Watch]) -> bool:
        return over(leaf.watch, leaf.step, self.actions[leaf.step.action])

    def _go_on(self, reading: Reading, see: See, now: float) -> Iterator[Reading]:
        """A reading and those that come out of it by leaving a step."""
        ways = list(moves(self.task, reading.state, entered(now), now))
        reading = replace(reading, met=self._met(reading, ways, see, now))
        ends = any(w.state is None and self._may_end(w) for w in ways)
        if ends and reading.finished is None:
            reading = replace(reading, finished=now)
        forced = tempted = False
        for way in ways:
            price = None if way.state is None else self._price(reading, way, see, now)
            if price is None or way.state is None:
                continue
            forced = forced or all(self._over(x) for x in way.left)
            tempted = tempted or (price == 0.0 and self._seen(reading, way, see, now))
            yield self._moved(reading, way.state, way, price, see, now)
        if ends or not forced:
            if tempted and not reading.stayed:
                reading = replace(reading, cost=reading.cost + STAYED, stayed=True)
            yield reading

    def _may_end(self, way: Move[Watch]) -> bool:
        return all(x.watch.fulfilled and x.watch.status not in BAD for x in way.left)

    def _price(self, reading: Reading, way: Move[Watch], see: See, now: float) -> float | None:
        """What a move costs, or None when nothing speaks for it."""
        if all(self._over(x) for x in way.left):
            return 0.0
        if all(self._goes_on(x.step, way.left) for x in way.entered):
            return None
        skipped = sum(self._skipped(x) for x in way.left)
        if self._seen(reading, way, see, now):
            return skipped
        nearer = all(self._comes(x.step, see(x.step), now) for x in way.entered)
        return skipped + GUESSED if nearer else None

    def _seen(self, reading: Reading, way: Move[Watch], see: See, now: float) -> bool:
        """Whether all that a move enters has been seen to begin, and nothing says "not yet"."""
        if any(see(x.step).not_yet for x in way.entered):
            return False
        return now - dict(reading.met).get(_steps(way), -math.inf) <= self.settings.contact_s

    def _met(
        self, reading: Reading, ways: list[Move[Watch]], see: See, now: float
    ) -> tuple[tuple[tuple[Step, ...], float], ...]:
        """When the entry to each move was last seen, with what is seen now."""
        met = dict(reading.met)
        for way in ways:
            signs = (see(x.step).entry for x in way.entered)
            if way.entered and all(self._enters(sign, now) for sign in signs):
                met[_steps(way)] = now
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

    def _skipped(self, leaf: Leaf[Watch]) -> float:
        """What leaving a step costs."""
        if leaf.watch.fulfilled:
            return 0.0
        lasts = self.actions[leaf.step.action].lasts
        missed = not lasts and not leaf.watch.held and leaf.watch.broken_since is not None
        return MISSED if missed else SKIPPED

    def _moved(
        self,
        reading: Reading,
        state: State[Watch],
        way: Move[Watch],
        price: float,
        see: See,
        now: float,
    ) -> Reading:
        opened = self._seen(reading, way, see, now)
        fresh = [
            self._look(_opened(x, opened), see(x.step), now, 0.0, False) if x in way.entered else x
            for x in leaves(state)
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
        cost = reading.cost + price
        now_at = with_leaves(state, iter(fresh))
        return Reading(now_at, cost, tuple(told.values()), gone_on=True)

    def _ending(self, leaf: Leaf[Watch], now: float) -> StageBelief:
        """How the stage of a step ends when it ends with this step."""
        status, why = outcome(leaf.step, self.actions[leaf.step.action], leaf.watch, now)
        return StageBelief(leaf.step.stage, status, now, leaf.watch.confidence, why)

    def _best(self, readings: Iterator[Reading]) -> tuple[Reading, ...]:
        """The cheapest reading of each form, cheapest first, the best at cost 0."""
        cheapest: dict[object, Reading] = {}
        for reading in readings:
            key = form(reading.state)
            if key not in cheapest or reading.cost < cheapest[key].cost - 1e-9:
                cheapest[key] = reading
        ranked = sorted(cheapest.values(), key=lambda r: r.cost)[: self.settings.most_courses]
        least = ranked[0].cost
        kept = (replace(r, cost=r.cost - least) for r in ranked if r.cost - least <= WORST)
        return tuple(kept)


def _opened(leaf: Leaf[Watch], opened: bool) -> Leaf[Watch]:
    return replace(leaf, watch=replace(leaf.watch, opened=True)) if opened else leaf


def _steps(way: Move[Watch]) -> tuple[Step, ...]:
    return tuple(x.step for x in way.entered)


def confidence(readings: tuple[Reading, ...]) -> float:
    """How sure the best reading is against the others, 0 to 1."""
    if not readings:
        return 0.0
    return 1.0 / sum(math.exp(SHARPNESS * (readings[0].cost - r.cost)) for r in readings)
