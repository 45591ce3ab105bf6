"""Watch the clip that ships with visup and print the story with its verdict."""

from __future__ import annotations

from visup.agent.model.step import Step
from visup.runs.demo import demo_settings
from visup.runs.wiring import build_agent, final_verdict, open_video


def tell(step: Step) -> None:
    for event in step.events:
        print(f"{event.time:6.1f} s  {event.text}")


if __name__ == "__main__":
    settings = demo_settings(every=4)
    agent = build_agent(settings)
    with open_video(settings) as source:
        for step in agent.steps(source):
            tell(step)
    print("verdict:", final_verdict(agent.mind).value)
