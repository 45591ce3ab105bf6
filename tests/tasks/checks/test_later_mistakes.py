"""Of the mistakes of later sittings, one in eight; `tests.tasks.checks.mistakes.count` tells of all."""

from tests.tasks.checks.mistakes.count import mistakes

ONE_IN = 8


def test_hints_fix_95_percent_of_the_later_mistakes() -> None:
    some = list(mistakes())[::ONE_IN]
    missed = [text for text, is_mended in some if not is_mended()]
    assert len(missed) <= 0.05 * len(some), missed
