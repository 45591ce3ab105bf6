"""QTC, the qualitative trajectory calculus: how two moving points move to each other.

Van de Weghe, *Representing and reasoning about moving objects: a qualitative approach* (PhD,
Ghent 2004); Van de Weghe, Cohn, De Tre, De Maeyer, *A qualitative trajectory calculus as a basis
for representing moving objects in geographical information systems*, Control and Cybernetics 35
(2006). QTC-B tells for each of the two whether it moves towards the other's place (-), away from
it (+) or neither (0). QTC-C (double cross) adds on which side of the line from itself to the other
it moves: to the left (-), to the right (+), or neither (0).

Signs are judged of velocities (the definition's limit for short times) along and across the line
between the places. Left and right are as one sees them in the image.
"""

SIGNS = ("-", "0", "+")
"""What a code stands for: `BELOW`, `WITHIN`, `ABOVE`."""


def text(*codes: int) -> str | None:
    """Codes as the calculus writes them, such as '-0+0'; None when one is unknown.

    >>> text(0, 1, 2, 1)
    '-0+0'
    """
    return None if min(codes) < 0 else "".join(SIGNS[c] for c in codes)
