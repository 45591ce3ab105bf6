"""A process stands ready once all is calm, takes the next job, and is followed by another."""

from __future__ import annotations

from pathlib import Path

from tests.serving.fakes import Bench, FakeChild, begun_journal, site_camera
from visup.serving.reports import CameraJob, ReportKind
from visup.serving.site.records import Site
from visup.serving.site_supervisor import SiteSupervisor
from visup.serving.spare_process import SETTLE_S, SpareProcess


class ReadyChild(FakeChild):
    """A process that is given its job later, perhaps."""

    def __init__(self, job: CameraJob | None) -> None:
        self.spare = job is None
        super().__init__(job)  # type: ignore[arg-type]

    def send_job(self, job: CameraJob) -> None:
        self.job = job
        begun_journal(job.folder)

    def end(self) -> None:
        self.kill()
        self.close()


class Scene:
    def __init__(self, folder: Path) -> None:
        self.begun: list[ReadyChild] = []
        self.spare = SpareProcess(self.begin)  # type: ignore[arg-type]
        site = Site(folder / "site.toml", folder, (site_camera("one"), site_camera("two")))
        self.supervisor = SiteSupervisor(site, Bench().tell, self.spare.start)
        self.now = 0.0

    def begin(self, job: CameraJob | None) -> ReadyChild:
        self.begun.append(ReadyChild(job))
        return self.begun[-1]

    def tick(self, later_s: float = 0.1) -> None:
        self.now += later_s
        self.supervisor.tick(self.now)
        self.spare.tick(self.supervisor, self.now)

    def all_watch(self) -> None:
        for child in self.begun:
            if child.job and child.code is None:
                begun_journal(child.job.folder)
                child.tell(ReportKind.STEP, steps=1)
        self.tick()


def test_a_spare_starts_once_all_cameras_are_stable_and_takes_the_next_job(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.tick()
    scene.tick(10 * SETTLE_S)
    assert [c.spare for c in scene.begun] == [False, False]  # nobody watches yet
    scene.all_watch()
    scene.tick(SETTLE_S)
    assert [c.spare for c in scene.begun] == [False, False, True]
    victim = scene.begun[0]
    victim.kill()
    scene.tick()
    scene.tick(1.1)
    assert scene.begun[2].job.folder == victim.job.folder
    assert scene.begun[2].job.resume
    assert len(scene.begun) == 3
    scene.tick(3 * SETTLE_S)
    assert len(scene.begun) == 3  # the camera has not come back yet
    scene.all_watch()
    scene.tick(SETTLE_S)
    assert scene.begun[3].spare
    scene.spare.close()
    assert scene.begun[3].code == -9
    assert scene.begun[3].closed


def test_a_spare_that_dies_loses_no_job_and_restarts_with_growing_waits(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.tick()
    scene.all_watch()
    scene.tick(SETTLE_S)
    scene.begun[2].kill()
    scene.begun[0].kill()
    scene.tick(0.0)
    scene.tick(1.1)
    again = scene.begun[-1]
    assert not again.spare
    assert again.job.folder == scene.begun[0].job.folder
    scene.all_watch()
    spares = len([c for c in scene.begun if c.spare])
    for _ in range(100):
        scene.tick(1.0)
        if scene.begun[-1].spare and scene.begun[-1].code is None:
            scene.begun[-1].kill()
    assert len([c for c in scene.begun if c.spare]) - spares < 10
