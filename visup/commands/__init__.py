"""The commands: one module per command of `visup`, or a folder if it has sub-commands.

`visup/cli.py` collects them. A command reads its options, calls the code that does the work, and prints the
result; heavy imports stay inside its functions, so that `visup --help` is fast.
"""
