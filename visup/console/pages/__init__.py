"""The web pages of the console: the list of runs, and the page of one run.

Pages are built with NiceGUI, which keeps the elements of each page on the server; their content comes only
from `visup.console`.
"""
