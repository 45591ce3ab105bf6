"""One slip at one word of a good text, of each kind: told, mended, and often with what was meant.

`python -m tests.tasks.checks.mistakes.counted` tells of all good texts of the repository; here are a few.
"""

from random import Random

from tests.tasks.checks.mistakes.counted import accounts, good_rules, good_tasks
from tests.tasks.checks.mistakes.mutations import KINDS, mutations

ONE_IN = 20


def test_hints_fix_nearly_all_mechanical_mistakes() -> None:
    found = [one for _, one in accounts(of_each=1, seed=5, every=ONE_IN)]
    assert len(found) > 60
    assert all(one.complete for one in found)
    assert sum(one.legal for one in found) >= 0.94 * len(found)
    assert sum(one.restored for one in found) >= 0.7 * len(found)


def test_each_mutation_changes_one_place_and_every_kind_occurs() -> None:
    kinds: set[str] = set()
    for good in (*good_rules()[::8], *good_tasks()[::8]):
        for mutation in mutations(good, Random(1)):
            kinds.add(mutation.kind)
            assert mutation.text[: mutation.begin] == good[: mutation.begin]
            assert mutation.text != good
    assert kinds == set(KINDS)
