"""What is reported of tracks.

`region_report.py` makes regions of tracks and obeys directives; `backward_tracking.py` finds since when a
region has been in view, by following its points back through older images; `cast_shadows.py` leaves out
regions that are nothing but ground seen darker; `trace.py` holds the workings of the last step for those
who want to see them.
"""
