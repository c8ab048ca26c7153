"""Jobs: registrations and driven garments on the daemon's machine, and their results as files or arrays."""

from __future__ import annotations

import io
import os
import re
from typing import IO, Callable, Iterator, Optional, Sequence, TypeVar

from weft import v1
from weft.connection import Connection, Watch, new_key
from weft.errors import NotFound
from weft.formats.cloud import Cloud
from weft.formats.mesh import Mesh
from weft.formats.messages import parse_message, read_report
from weft.formats.observations import Observations
from weft.library import KINDS, Library, Progress, reference
from weft.listing import USUAL_LIMIT, Listing, listing_of_pages
from weft.named import Words, pairs
from weft.storage import check_name, folder_below, written_atomically
from weft.transfer import receive
from weft.v1.jobs_pb2_grpc import JobsStub

ENDED = (v1.JOB_STATE_DONE, v1.JOB_STATE_FAILED, v1.JOB_STATE_CANCELLED)
_WITH_MESH = (v1.FRAME_STATE_DONE, v1.FRAME_STATE_DEGRADED)
_WITH_FILES = (v1.FRAME_STATE_DONE, v1.FRAME_STATE_DEGRADED, v1.FRAME_STATE_FAILED)
_FILE_NAMES = {
    v1.RESULT_KIND_OBSERVATIONS: "observations.csv",
    v1.RESULT_KIND_CLOUD: "cloud.ply",
    v1.RESULT_KIND_CLOUD_PCD: "cloud.pcd",
    v1.RESULT_KIND_MESH: "mesh.ply",
    v1.RESULT_KIND_FRAME_REPORT: "report.json",
    v1.RESULT_KIND_JOB_REPORT: "report.html",
    v1.RESULT_KIND_JOB: "job.json",
}
_DAEMON_HAS = ("take:", "job:", "library:")  # what such a name begins with is no path of this machine
_MESH_NAME = re.compile("[a-z][a-z0-9_-]{0,31}")
T = TypeVar("T")
_WORDS = {item: word for word, item in KINDS.items()}
_SUBMIT_S = 600.0  # the daemon reads the inputs meanwhile


def work_spec(kind: str, inputs: Words, options: Optional[Words] = None, *, out: str = "", frames: str = "") -> v1.RegistrationSpec:
    """A job of a kind that Jobs.kinds() lists, for submit(): `work_spec("copy meshes", {"result": "job:ID"}, {"every": "2"})`.
    The value of a flag is ""."""
    work = v1.WorkSpec(kind=kind, inputs=[v1.NamedValue(name=name, value=value) for name, value in pairs(inputs)],
                       options=[v1.NamedValue(name=name, value=value) for name, value in pairs(options or {})])
    return v1.RegistrationSpec(work=work, out=out, frames=frames)


class Jobs:
    """Submits, watches, cancels and fetches jobs."""

    def __init__(self, connection: Connection, library: Library) -> None:
        self._connection, self._library, self._stub = connection, library, JobsStub(connection.channel)

    def submit(self, spec: v1.RegistrationSpec, *, priority: int = 0, idempotency_key: str = "") -> v1.Job:
        """Queues a job. Paths of the spec are the daemon's, "take:ID" or "library:NAME"; without `out` the results stay
        below the daemon's state folder, for fetch(). Higher priority goes first, -100 to 100; above 10 is for
        operators. With `spec.driving` an avatar
        drives the frames, v1.DrivingSpec(avatar="library:shirt", cameras=["front", "back"]).

        The request has an idempotency key, so it is repeated safely where its answer was lost. InvalidArgument, NotFound and
        PermissionDenied name the field."""
        request = v1.SubmitJobRequest(spec=spec, priority=priority, idempotency_key=idempotency_key or new_key())
        return self._connection.call(self._stub.SubmitJob, request, v1.Job, harmless=True, timeout_s=_SUBMIT_S)

    def kinds(self) -> Sequence[v1.WorkKindInfo]:
        """What the daemon can do, and what each kind reads and takes. Those with `start` WORK_START_JOB are asked for by
        work_spec(), those with WORK_START_OPERATION by operation_spec()."""
        return list(self._connection.call(self._stub.ListWorkKinds, v1.ListWorkKindsRequest(), v1.ListWorkKindsResponse,
                                          harmless=True).kinds)

    def upload_inputs(self, spec: v1.RegistrationSpec, progress: Optional[Progress] = None) -> v1.RegistrationSpec:
        """The spec with dump, rig, board, garment and avatar, which are paths of this machine, in the daemon's library. What is
        there already is not sent again. Scans and start meshes are not uploaded."""
        uploaded = v1.RegistrationSpec()
        uploaded.CopyFrom(spec)
        for kind, field in (("rig", "rig"), ("board", "board"), ("template", "garment"), ("dump", "dump")):
            path = getattr(spec, field)
            if path and not path.startswith(_DAEMON_HAS):
                setattr(uploaded, field, reference(self._library.upload(kind, path, progress=progress)))
        avatar = spec.driving.avatar
        if avatar and not avatar.startswith(_DAEMON_HAS):
            uploaded.driving.avatar = reference(self._library.upload("avatar", avatar, progress=progress))
        if spec.HasField("work"):
            self._upload_of_work(uploaded.work, progress)
        return uploaded

    def _upload_of_work(self, work: v1.WorkSpec, progress: Optional[Progress]) -> None:
        items = {info.name: info.item for kind in self.kinds() if kind.name == work.kind for info in kind.inputs}
        for given in work.inputs:
            word = _WORDS.get(items.get(given.name, v1.ITEM_KIND_UNSPECIFIED))
            if word and not given.value.startswith(_DAEMON_HAS):
                given.value = reference(self._library.upload(word, given.value, progress=progress))

    def get(self, job_id: str) -> v1.Job:
        return self._connection.call(self._stub.GetJob, v1.GetJobRequest(job_id=job_id), v1.Job, harmless=True)

    def list(self, limit: int = 100) -> Listing[v1.Job]:
        """The newest first."""
        def page(request: v1.ListJobsRequest) -> v1.ListJobsResponse:
            return self._connection.call(self._stub.ListJobs, request, v1.ListJobsResponse, harmless=True)

        return listing_of_pages(page, v1.ListJobsRequest(), "jobs", limit or USUAL_LIMIT)

    def frames(self, job_id: str) -> Sequence[v1.FrameInfo]:
        def page(request: v1.ListFramesRequest) -> v1.ListFramesResponse:
            return self._connection.call(self._stub.ListFrames, request, v1.ListFramesResponse, harmless=True)

        return list(listing_of_pages(page, v1.ListFramesRequest(job_id=job_id), "frames"))

    def cancel(self, job_id: str) -> v1.Job:
        """Finished frames stay."""
        return self._connection.call(self._stub.CancelJob, v1.CancelJobRequest(job_id=job_id), v1.Job, harmless=True)

    def retry(self, job_id: str) -> v1.Job:
        """Queues a job that has ended for its failed and cancelled frames. Not repeated: it might fail twice."""
        return self._connection.call(self._stub.RetryJob, v1.RetryJobRequest(job_id=job_id), v1.Job, harmless=False)

    def watch(self, job_id: str, timeout_s: Optional[float] = None) -> Watch[v1.JobUpdate]:
        """The state now, then every change with the frames that changed, until the job has ended. After a lost connection
        the first update has the state of all frames again."""
        return self._connection.watch(self._stub.WatchJob, v1.WatchJobRequest(job_id=job_id), timeout_s=timeout_s)

    def wait(self, job_id: str, timeout_s: Optional[float] = None) -> v1.Job:
        """The job when it has ended; its `state` says how. DeadlineExceeded: it has not."""
        last: Optional[v1.Job] = None
        with self.watch(job_id, timeout_s) as updates:
            for update in updates:
                last = update.job
        return last if last is not None else self.get(job_id)

    def download(self, job_id: str, kind: v1.ResultKind, file: IO[bytes], frame: str = "", mesh: str = "") -> None:
        """One file of the results; `frame` is empty where it is one of the whole job. `mesh` names one of the frame's, where
        it is not the garment or the only one. NotFound: there is none."""
        request = v1.FetchResultRequest(job_id=job_id, frame=frame, kind=kind, mesh=mesh)

        def open_transfer(offset: int, version: str) -> object:
            request.offset, request.version = offset, version
            return self._connection.start(self._stub.FetchResult, request, None)

        receive(self._connection, open_transfer, file, _label(job_id, frame, kind))

    def fetch(self, job_id: str, folder: str | os.PathLike[str], progress: Optional[Progress] = None) -> v1.Job:
        """Writes all results to `folder`, as `weft job fetch`: <frame>/mesh.ply, cloud.ply, observations.csv where it was
        asked for, report.json, the meshes beside the garment, and job.json and report.html. `progress` gets frames done and all of them."""
        job, root, frames = self.get(job_id), os.fspath(folder), self.frames(job_id)
        kinds = [v1.RESULT_KIND_OBSERVATIONS, v1.RESULT_KIND_CLOUD, v1.RESULT_KIND_MESH, v1.RESULT_KIND_FRAME_REPORT]
        if job.spec.options.cloud_format == "pcd":
            kinds.insert(2, v1.RESULT_KIND_CLOUD_PCD)
        for done, frame in enumerate(frames, 1):
            if frame.state in _WITH_FILES:
                below = folder_below(root, check_name(frame.frame))
                for kind in kinds:
                    self._fetch_if_there(job_id, kind, below, frame.frame, "garment" if kind == v1.RESULT_KIND_MESH else "")
                for name in _other_meshes(os.path.join(below, _FILE_NAMES[v1.RESULT_KIND_FRAME_REPORT])):
                    self._fetch_if_there(job_id, v1.RESULT_KIND_MESH, below, frame.frame, name)
            if progress:
                progress(done, len(frames))
        os.makedirs(root, exist_ok=True)
        for kind in (v1.RESULT_KIND_JOB_REPORT, v1.RESULT_KIND_JOB):
            self._fetch_if_there(job_id, kind, root, "")
        return job

    def _fetch_if_there(self, job_id: str, kind: v1.ResultKind, folder: str, frame: str, mesh: str = "") -> None:
        name = _FILE_NAMES[kind] if mesh in ("", "garment") else f"{mesh}.ply"
        try:
            with written_atomically(os.path.join(folder, name)) as file:
                self.download(job_id, kind, file, frame, mesh)
        except NotFound:
            return

    def mesh(self, job_id: str, frame: str, name: str = "") -> Mesh:
        """A mesh of a frame, without a file in between; without a name the garment, or the only one. NotFound names those
        that there are; `report(job_id, frame).meshes` lists them."""
        return self._parsed(job_id, v1.RESULT_KIND_MESH, frame, Mesh.from_ply, name)

    def meshes(self, job_id: str, name: str = "") -> Iterator[tuple[v1.FrameInfo, Mesh]]:
        """The frames that have a mesh, in order, each fetched when it is asked for. Of a job that runs: those so far."""
        for frame in self.frames(job_id):
            if frame.bridged or frame.state in _WITH_MESH:
                yield frame, self.mesh(job_id, frame.frame, name)

    def cloud(self, job_id: str, frame: str) -> Cloud:
        return self._parsed(job_id, v1.RESULT_KIND_CLOUD, frame, Cloud.from_ply)

    def observations(self, job_id: str, frame: str) -> Observations:
        """NotFound: the job was submitted without options.write_observations."""
        return self._parsed(job_id, v1.RESULT_KIND_OBSERVATIONS, frame, Observations.from_csv)

    def report(self, job_id: str, frame: str) -> v1.FrameReport:
        return self._parsed(job_id, v1.RESULT_KIND_FRAME_REPORT, frame,
                            lambda data, name: parse_message(data, name, v1.FrameReport))

    def _parsed(self, job_id: str, kind: v1.ResultKind, frame: str, parse: Callable[[bytes, str], T], mesh: str = "") -> T:
        buffer = io.BytesIO()
        self.download(job_id, kind, buffer, frame, mesh)
        return parse(buffer.getvalue(), _label(job_id, frame, kind))


def _other_meshes(report: str) -> list[str]:
    """Names of the meshes beside the garment, by a frame's report.json, where it is there."""
    if not os.path.exists(report):
        return []
    names = [mesh.name for mesh in read_report(report).meshes if mesh.name != "garment"]
    for name in names:
        if not _MESH_NAME.fullmatch(name):
            raise ValueError(f"{report}: {name!r} is no name of a mesh")
    return names


def _label(job_id: str, frame: str, kind: v1.ResultKind) -> str:
    return "/".join(part for part in (f"job:{job_id}", frame, _FILE_NAMES.get(kind, str(kind))) if part)
