"""Step the agent until an object is identified, then look at what it believes and why."""

from __future__ import annotations

from visup.agent import ObjectBelief
from visup.agent.model.step import Step
from visup.runs.demo import demo_settings
from visup.runs.wiring import build_agent, open_video


def identified(step: Step) -> bool:
    return any(event.kind == "identified" for event in step.events)


def describe(belief: ObjectBelief) -> str:
    votes = ", ".join(f"{c.name} {c.share:.2f}" for c in belief.candidates)
    return f"object {belief.id} ({belief.presence.value}), box {belief.region.bbox}: {votes}"


if __name__ == "__main__":
    settings = demo_settings(every=2)
    agent = build_agent(settings)
    with open_video(settings) as source:
        last = agent.run(source, until=identified)
    print(f"frame {agent.mind.frame_index}, {agent.mind.time:.1f} s")
    for belief in agent.mind.objects.values():
        print(" ", describe(belief))
    for relation in agent.mind.relations:
        print(" ", relation.name, relation.objects, relation.truth.value)
