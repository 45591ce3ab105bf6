from __future__ import annotations

from dataclasses import replace

from tests.agent.scripted import COUNTING, Scripted, alert_while, counting, exploding_at, frames
from visup.agent import Directive, Mind, Observation, Outcome, Severity
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.step import Step
from visup.agent.storage.jsonable import to_jsonable


def summary(steps: list[Step]) -> list[object]:
    return [to_jsonable(replace(s, observation=Observation(0, 0, (0, 0)))) for s in steps]


def counting_agent() -> Agent:
    reasoners = Reasoners(update=(counting,), cogitate=(alert_while(lambda t: 0.3 <= t < 0.6),))
    return Agent([Scripted("eye", ("x",))], reasoners)


def test_the_same_frames_give_the_same_steps() -> None:
    assert summary(list(counting_agent().steps(frames(30)))) == summary(
        list(counting_agent().steps(frames(30)))
    )


def test_two_agents_share_no_state() -> None:
    a, b = counting_agent(), counting_agent()
    alone = summary(list(counting_agent().steps(frames(20))))
    mixed = [(a.step(f), b.step(f)) for f in frames(20)]
    assert summary([s for s, _ in mixed]) == summary([s for _, s in mixed]) == alone


def test_a_run_stops_at_its_condition_and_continues_from_there() -> None:
    agent, source = counting_agent(), frames(10)
    first = agent.run(source, until=lambda s: s.frame_index == 3)
    then = agent.run(source)
    assert first is not None
    assert first.frame_index == 3
    assert then is not None
    assert then.frame_index == 9
    assert agent.mind.recall(COUNTING) == 10


def test_a_run_over_no_frames_gives_no_step() -> None:
    assert counting_agent().run(frames(0)) is None


def test_a_reasoner_that_raises_leaves_the_mind_unchanged_and_opens_an_alert() -> None:
    reasoners = Reasoners(update=(counting, exploding_at(4)))
    agent = Agent([Scripted("eye", ("x",))], reasoners)
    steps = list(agent.steps(frames(8)))
    before, hit, after = steps[3], steps[4], steps[5]
    assert hit.mind.memory == before.mind.memory  # half of a step never enters the mind
    assert hit.mind.time == hit.time
    assert hit.mind.unknown == {"x"}
    assert [a.kind for a in hit.mind.alerts] == ["reasoning_failed"]
    assert hit.mind.alerts[0].severity is Severity.CRITICAL
    assert after.mind.recall(COUNTING) == 5


def test_an_open_alert_stays_open_in_a_step_whose_reasoning_failed() -> None:
    always = alert_while(lambda _: True)
    blown = [exploding_at(i) for i in range(5, 40)]
    agent = Agent([], Reasoners(cogitate=(always, *blown)))
    last = agent.run(frames(40))
    assert last is not None
    assert "worry" in {a.kind for a in last.mind.alerts}


def test_directives_reach_behaviours_in_the_next_step() -> None:
    def asks(mind: Mind, observation: Observation) -> Outcome:
        wish = Directive(
            "expect_regions", "There should be two.", {"count": observation.frame_index}
        )
        return Outcome(mind, directives=(wish,))

    eye = Scripted("eye", ("x",))
    Agent([eye], Reasoners(cogitate=(asks,))).run(frames(3))
    assert [[d.data["count"] for d in given] for given in eye.directives] == [[], [0], [1]]


def test_a_failed_behaviour_opens_an_alert() -> None:
    def says(i: int) -> object:
        raise ValueError("broken")

    last = Agent([Scripted("eye", ("x",), says)]).run(frames(2))
    assert last is not None
    assert [(a.kind, a.evidence) for a in last.mind.alerts] == [
        ("behaviour_failed", ("ValueError: broken",))
    ]


def test_observers_receive_every_step_with_an_immutable_mind() -> None:
    kept: list[Mind] = []
    agent = counting_agent()
    agent.observers = (lambda step, frame: kept.append(step.mind),)
    agent.run(frames(5))
    assert [m.recall(COUNTING) for m in kept] == [1, 2, 3, 4, 5]
