// The files of a result: those of a frame, <result>/<frame>/, and the job's own.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <utility>

namespace weft {

enum class FrameFile { kMesh, kUnrefined, kCloud, kCloudPcd, kObservations, kReport };

// All but the report, which lists them.
inline constexpr std::array kDataFiles = {FrameFile::kMesh, FrameFile::kUnrefined, FrameFile::kCloud,
                                          FrameFile::kCloudPcd, FrameFile::kObservations};

constexpr const char* FileName(FrameFile file) {
  switch (file) {
    case FrameFile::kMesh:
      return "mesh.ply";
    case FrameFile::kUnrefined:
      return "unrefined.ply";
    case FrameFile::kCloud:
      return "cloud.ply";
    case FrameFile::kCloudPcd:
      return "cloud.pcd";
    case FrameFile::kObservations:
      return "observations.csv";
    case FrameFile::kReport:
      return "report.json";
  }
  return "";
}

// Beside the frames' folders.
inline constexpr char kJobFile[] = "job.json";
inline constexpr char kJobReportFile[] = "report.html";

// Where a frame's files lie; whether they are there is another question.
class FramePaths {
 public:
  explicit FramePaths(std::string folder) : folder_(std::move(folder)) {}
  FramePaths(const std::string& result, const std::string& frame)
      : folder_((std::filesystem::path(result) / frame).string()) {}

  const std::string& folder() const { return folder_; }
  std::string Of(FrameFile file) const { return (std::filesystem::path(folder_) / FileName(file)).string(); }

 private:
  std::string folder_;
};

}  // namespace weft
