"""Write a task, print its tree, and see what visup reports when it contains a mistake."""

from __future__ import annotations

from visup.agent.model.errors import VisupError
from visup.tasks import parse_task

GOOD = """
<inspection> ::= <close_in> <look> <leave>
<close_in>   ::= converging(inspector, target)
<look>       ::= keeping_distance(inspector, target) for 10 s
<leave>      ::= diverging(inspector, target)
"""
BAD = GOOD.replace("keeping_distance", "keping_distance")

if __name__ == "__main__":
    print(parse_task(GOOD, "inspection.task"))
    try:
        parse_task(BAD, "inspection.task")
    except VisupError as mistake:
        print(mistake)
