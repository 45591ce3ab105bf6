"""Bodies before a dark sky: what is brighter than black space stands out, moving or not.

`sky.py` finds the sky and the bright components before it; `body.py` is what is known of a body;
`splitting.py` shares a component among bodies that touch in the image; `tracking.py` follows the bodies;
`reporting.py` gives regions of motion the outlines of the bodies, and reports bodies that drift slowly.
"""
