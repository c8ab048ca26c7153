#include "services/server/rpc/result_names.h"

#include "services/formats/files/frame_paths.h"

namespace weft {

std::string ResultFileName(v1::ResultKind kind) {
  switch (kind) {
    case v1::RESULT_KIND_MESH:
      return FileName(FrameFile::kMesh);
    case v1::RESULT_KIND_CLOUD:
      return FileName(FrameFile::kCloud);
    case v1::RESULT_KIND_CLOUD_PCD:
      return FileName(FrameFile::kCloudPcd);
    case v1::RESULT_KIND_OBSERVATIONS:
      return FileName(FrameFile::kObservations);
    case v1::RESULT_KIND_FRAME_REPORT:
      return FileName(FrameFile::kReport);
    case v1::RESULT_KIND_JOB:
      return kJobFile;
    case v1::RESULT_KIND_JOB_REPORT:
      return kJobReportFile;
    default:
      return "";
  }
}

}  // namespace weft
