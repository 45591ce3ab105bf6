"""Signals that do not come from the image, such as a battery, a door or a mode.

Read `files.py` (tables), `mqtt.py` (messages from a broker) and `behaviour.py` (reports for a frame).
"""

from visup.percepts.signals.behaviour import SIGNAL, SignalBehaviour
from visup.percepts.signals.files import SignalTable, read_signals

__all__ = ["SIGNAL", "SignalBehaviour", "SignalTable", "read_signals"]
