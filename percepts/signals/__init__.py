"""Signals that do not come from the image, such as a battery, a door or a mode.

Read `files.py` (tables), `mqtt.py` (messages of a broker) and `behaviour.py` (what is reported for a frame).
"""

from visup.percepts.signals.behaviour import SIGNAL, SignalBehaviour
from visup.percepts.signals.files import SignalTable, read_signals

__all__ = ["SIGNAL", "SignalBehaviour", "SignalTable", "read_signals"]
