"""Files that ship with visup: the demo clip, what is true of it, and its model database."""
