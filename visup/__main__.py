"""`python -m visup`: the same as the command `visup`."""

from visup.cli import main

if __name__ == "__main__":
    main()
