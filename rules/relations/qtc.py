"""QTC, the qualitative trajectory calculus: relative motion of two points.

Van de Weghe, *Representing and reasoning about moving objects: a qualitative approach* (PhD,
Ghent 2004); Van de Weghe, Cohn, De Tre, De Maeyer, *A qualitative trajectory calculus as a basis
for representing moving objects in geographical information systems*, Control and Cybernetics 35
(2006). QTC-B states for each of the two whether it moves towards the other's position (-), away from it (+)
or neither (0). QTC-C (double cross) adds on which side of the line from itself to the other it moves: left
(-), right (+), or neither (0).
 Signs are decided from velocities (the definition's limit for short times) along and across the line between
the positions. Left and right are as seen in the image.
"""

SIGNS = ("-", "0", "+")
"""The signs of the codes `BELOW`, `WITHIN`, `ABOVE`."""


def text(*codes: int) -> str | None:
    """Codes in the calculus' notation, such as '-0+0'; None when one is unknown.

    >>> text(0, 1, 2, 1)
    '-0+0'
    """
    return None if min(codes) < 0 else "".join(SIGNS[c] for c in codes)
