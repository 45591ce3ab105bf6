"""The version of visup that is installed."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("visup")
except PackageNotFoundError:  # run from a checkout that was never installed
    __version__ = "0+unknown"
