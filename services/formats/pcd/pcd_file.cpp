#include "services/formats/pcd/pcd_file.h"

#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/ply_points.h"
#include "services/formats/pcd/pcl_program.h"

namespace weft {

bool IsPcdName(const std::string& path) { return absl::EndsWithIgnoreCase(path, ".pcd"); }

absl::StatusOr<Ply> ParsePcd(std::string_view bytes, const std::string& source_name) {
  if (bytes.find("DATA ") == std::string_view::npos) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": is no PCD file, it has no line DATA"));
  }
  const absl::StatusOr<std::string> ply = RunPclProgram("read-all", bytes, source_name);
  return ply.ok() ? ParsePly(*ply, source_name) : ply.status();
}

absl::StatusOr<std::string> SerializePcd(const Ply& ply) {
  const absl::StatusOr<std::string> bytes = SerializePly(ply);
  return bytes.ok() ? RunPclProgram("write", *bytes, "cloud") : bytes.status();
}

absl::Status WritePcd(const std::string& path, const Ply& ply) {
  const absl::StatusOr<std::string> bytes = SerializePcd(ply);
  return bytes.ok() ? WriteFileAtomically(path, *bytes) : bytes.status();
}

absl::StatusOr<Points> ReadPoints(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  WEFT_ASSIGN_OR_RETURN(Ply ply, IsPcdName(path) ? ParsePcd(bytes, path) : ParsePly(bytes, path));
  Points points{std::move(ply)};
  points.unmeasured = DropUnmeasured(points.ply);
  return points;
}

}  // namespace weft
