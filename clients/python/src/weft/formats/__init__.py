"""Results of Weft as numpy arrays, and its JSON files as messages of weft.v1. A bad file is a FormatError."""

from weft.formats.cloud import Cloud, Rays, read_cloud
from weft.formats.mesh import Mesh, read_mesh
from weft.formats.messages import read_evaluation, read_export, read_job, read_message, read_report
from weft.formats.observations import Observations, read_observations

__all__ = ["Cloud", "Mesh", "Observations", "Rays", "read_cloud", "read_evaluation", "read_export", "read_job", "read_mesh",
           "read_message", "read_observations", "read_report"]
