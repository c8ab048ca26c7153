"""Client of weftd, the registration server for cloth. Start with Client; messages of the API are in weft.v1."""

from importlib.metadata import PackageNotFoundError, version

from weft.channel import Identity
from weft.client import Client
from weft.connection import Watch
from weft.errors import (Aborted, AlreadyExists, Cancelled, DataLoss, DeadlineExceeded, FailedPrecondition, FormatError,
                         Internal, InvalidArgument, NotFound, OutOfRange, PermissionDenied, ResourceExhausted,
                         Unauthenticated, Unavailable, Unimplemented, Unknown, WeftError)
from weft.formats import (Cloud, Mesh, Observations, Rays, read_cloud, read_evaluation, read_export, read_job,
                          read_mesh, read_observations, read_report)
from weft.jobs import work_spec
from weft.library import reference
from weft.listing import Listing
from weft.operations import operation_spec
from weft.retry import RetryPolicy

try:
    __version__ = version("weft")
except PackageNotFoundError:  # a source tree on the path
    __version__ = "0+unknown"

__all__ = [
    "Aborted", "AlreadyExists", "Cancelled", "Client", "Cloud", "DataLoss", "DeadlineExceeded", "FailedPrecondition",
    "FormatError", "Identity", "Internal", "InvalidArgument", "Listing", "Mesh", "NotFound", "Observations", "OutOfRange",
    "PermissionDenied", "Rays", "ResourceExhausted", "RetryPolicy", "Unauthenticated", "Unavailable", "Unimplemented",
    "Unknown", "Watch", "WeftError", "operation_spec", "read_cloud", "read_evaluation", "read_export", "read_job",
    "read_mesh", "read_observations", "read_report", "reference", "work_spec", "__version__",
]
