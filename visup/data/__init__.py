"""Files that ship with visup: the demo clip, its ground truth and its model database."""
