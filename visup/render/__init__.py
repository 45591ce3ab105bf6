"""Scenario rendering: from a scenario file to a video with masks and truth.

A scenario (`scenario.py`) names objects (`meshes.py`, `things.py`, built from `shapes.py`), how they
move (`tracks.py`, `arm.py`) and the light. `renderer.py` casts rays (`raycast.py`) frame by frame over
a background (`background.py`) through a sensor (`sensor.py`); `truth.py` says what is true of it and
`writer.py` writes it down. `demo_models.py` makes the model database of the demo.

Needs the extra ``visup[render]``; nothing here is imported by ``import visup``.
"""
