"""Of the mistakes of later sittings, one in eight; `tests.tasks.checks.mistakes.count` tells of all."""

from tests.tasks.checks.mistakes.count import mistakes

ONE_IN = 8


def test_of_later_mistakes_95_of_a_hundred_are_mended_by_their_hints() -> None:
    some = list(mistakes())[::ONE_IN]
    missed = [text for text, is_mended in some if not is_mended()]
    assert len(missed) <= 0.05 * len(some), missed
