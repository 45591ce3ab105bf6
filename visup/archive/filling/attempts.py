"""How often a clip was begun and nobody came back from it.

A worker leaves a mark before it begins a clip and takes it away when it is through, well or not. A mark that
stays is of a worker that died meanwhile. It stands in the lake, so that whoever tries the clip next finds it,
whichever worker, machine or scheduler that is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import OutputError

MOST = 2
"""A clip that has ended so many workers is put aside."""
FOLDER = "attempts"


@dataclass(frozen=True, slots=True)
class Attempts:
    """The marks of one run.

    Attributes:
        lake: Folder of the lake.
        run: Key of the run, or of a piece of it.
    """

    lake: Path
    run: str

    @property
    def exhausted(self) -> bool:
        """Whether it is not to be tried any more."""
        return all(mark.exists() for mark in self._marks())

    def begin(self) -> bool:
        """Leave a mark; False when there are as many as may be.

        Raises:
            OutputError: It cannot be written.
        """
        for mark in self._marks():
            try:
                mark.parent.mkdir(parents=True, exist_ok=True)
                mark.touch(exist_ok=False)
            except FileExistsError:
                continue
            except OSError as fault:
                what = f"the lake cannot be written ({fault.strerror})"
                raise OutputError(what, where=str(mark)) from fault
            return True
        return False

    def exhaust(self) -> None:
        """Leave all marks that may be: it is given up.

        Raises:
            OutputError: They cannot be written.
        """
        while self.begin():
            pass

    def clear(self) -> None:
        """Take all marks away: someone came back, or it is to be tried anew."""
        for mark in self._marks():
            mark.unlink(missing_ok=True)

    def _marks(self) -> list[Path]:
        return [self.lake / FOLDER / f"{self.run}.{n}" for n in range(1, MOST + 1)]


def forget_interrupted(lake: Path, *, also_put_aside: bool = False) -> None:
    """Take away the marks of clips that were merely under way when all was stopped.

    Args:
        lake: Folder of the lake; nobody else is filling it.
        also_put_aside: Those of clips that were put aside, too.
    """
    marks = sorted((lake / FOLDER).glob("*.*"))
    for run in {mark.stem for mark in marks}:
        attempts = Attempts(lake, run)
        if also_put_aside or not attempts.exhausted:
            attempts.clear()
