"""The commands: one module for each command of `visup`, or a folder where it has commands of its own.

`visup/cli.py` gathers them. A command reads its options, calls what does the work and prints the result;
heavy imports stay inside its functions, so that `visup --help` comes at once.
"""
