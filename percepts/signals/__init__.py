"""Signals that are not from the image: a battery, a door, a mode, told beside the video.

Read `files.py` (tables), `mqtt.py` (messages of a broker) and `behaviour.py` (what is reported for a frame).
"""

from visup.percepts.signals.behaviour import SIGNAL, SignalBehaviour
from visup.percepts.signals.files import SignalTable, read_signals

__all__ = ["SIGNAL", "SignalBehaviour", "SignalTable", "read_signals"]
