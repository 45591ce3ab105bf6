"""Output: the regions reported for tracks.

`region_report.py` turns tracks into regions and obeys directives; `backward_tracking.py` finds when a region
came into view, by tracking its points back through older images; `cast_shadows.py` drops regions that are
only shaded ground; `segmentation_trace.py` exposes the intermediate results of the last step.
"""
