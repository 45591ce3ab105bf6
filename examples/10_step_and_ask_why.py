"""Step a supervisor like a program: stop, inspect, go back, ask why, and try what-if."""

from __future__ import annotations

from visup.runs.demo import demo_settings
from visup.runs.wiring import build_agent, open_video
from visup.stepping import Stepper
from visup.stepping.what_if import AssumedIdentity

if __name__ == "__main__":
    settings = demo_settings(every=4)
    with open_video(settings) as source:
        it = Stepper(build_agent(settings), source)
        it.watch("speed(a)")

        # A breakpoint, and a stop inside the next step with its intermediate mind.
        it.break_at("identified")
        print("stopped:", *it.step(until="20.0").reasons)
        it.step(until="update")
        print("inside frame", it.mind.frame_index, "after", it.paused and it.paused.phase.value)

        # Back, and forward again to exactly the same state.
        first = it.back()
        it.back(5)
        print("from there to here:", it.diff(it.at, it.made))
        again = it.step(5).step
        print("the same events again:", first and again and first.events == again.events)

        # Why, and why not?
        why = it.why("identity 1")
        print(why)
        print(f"it rests on {len(why.percepts)} percepts")
        print(it.why_not("stage captured"))

        # What if it were something else from here on? The original timeline is not changed.
        branch = it.branch(AssumedIdentity(1, "spartan"))
        branch.step(10)
        changed = branch.compare()
        real = it.mind_at(branch.at)
        print("what if:", branch.mind.objects[1].name, "where it really was", real.objects[1].name)
        print(len(changed.gone), "events are not told there,", len(changed.new), "are told besides")
        it.close()
