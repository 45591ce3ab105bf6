"""Watch until an object is identified, then inspect the beliefs and the reasons for them."""

from __future__ import annotations

import visup
from visup.agent import ObjectBelief
from visup.runs.demo import demo_settings


def describe(belief: ObjectBelief) -> str:
    votes = ", ".join(f"{c.name} {c.share:.2f}" for c in belief.candidates)
    return f"object {belief.id} ({belief.presence.value}), box {belief.region.bbox}: {votes}"


if __name__ == "__main__":
    with visup.watch(demo_settings(every=2)) as run:
        step = next(s for s in run if any(e.kind == "identified" for e in s.events))
    print(f"frame {step.frame_index}, {step.time:.1f} s")
    for belief in step.mind.objects.values():
        print(" ", describe(belief))
    for relation in step.mind.relations:
        print(" ", relation.name, relation.objects, relation.truth.value)
