#include "services/formats/synthetic/truth_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/little_endian.h"
#include "services/formats/files/mesh_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "weftvt1\n";
constexpr size_t kNodeBytes = 21;
constexpr double kPixelSteps = 1e4, kPitchSteps = 256, kAngleSteps = 100;
enum Flag : uint8_t { kIsCorner = 1, kIsVisible = 2, kIsScoreable = 4, kAllFlags = 7 };

template <typename Number>
Number Steps(double value, double steps) {
  using Limits = std::numeric_limits<Number>;
  return static_cast<Number>(std::clamp<double>(std::round(value * steps), Limits::min(), Limits::max()));
}

// Names in `folder` of files with this ending (without it), or of folders when it is empty; sorted.
std::vector<std::string> NamesIn(const std::string& folder, std::string_view ending) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const fs::path& path = it->path();
    if (ending.empty() ? it->is_directory(error) : path.extension() == ending)
      names.push_back(ending.empty() ? path.filename().string() : path.stem().string());
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace

std::string EncodeViewTruth(const ViewTruth& truth) {
  std::string out(kMagic);
  out.reserve(kMagic.size() + sizeof(uint32_t) + kNodeBytes * truth.nodes.size());
  PutLittleEndian(static_cast<uint32_t>(truth.nodes.size()), out);
  for (const NodeTruth& n : truth.nodes) {
    const int flags = (n.node.kind == NodeKind::kCorner ? kIsCorner : 0) | (n.visible ? kIsVisible : 0) |
                      (n.scoreable ? kIsScoreable : 0);
    PutLittleEndian(static_cast<uint8_t>(flags), out);
    PutLittleEndian(static_cast<uint16_t>(n.node.row), out);
    PutLittleEndian(static_cast<uint16_t>(n.node.col), out);
    PutLittleEndian(Steps<int32_t>(n.pixel_px.x(), kPixelSteps), out);
    PutLittleEndian(Steps<int32_t>(n.pixel_px.y(), kPixelSteps), out);
    PutLittleEndian(Steps<uint16_t>(n.pitch_px, kPitchSteps), out);
    PutLittleEndian(Steps<uint16_t>(n.facing_deg, kAngleSteps), out);
    PutLittleEndian(static_cast<int32_t>(n.vertex), out);
  }
  return out;
}

absl::StatusOr<ViewTruth> DecodeViewTruth(std::string_view bytes, std::string camera_id,
                                          const std::string& source_name) {
  const auto bad = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", what));
  };
  if (!bytes.starts_with(kMagic)) return bad("is not a view's truth; it does not begin with weftvt1");
  bytes.remove_prefix(kMagic.size());
  if (bytes.size() < sizeof(uint32_t)) return bad("ends before the number of nodes");
  const auto count = TakeLittleEndian<uint32_t>(bytes);
  if (bytes.size() != kNodeBytes * count)
    return bad(absl::StrCat("holds ", bytes.size(), " bytes for ", count, " nodes, expected ",
                            kNodeBytes * count, "; was the file truncated?"));
  ViewTruth out;
  out.camera_id = std::move(camera_id);
  out.nodes.resize(count);
  for (NodeTruth& n : out.nodes) {
    const auto number = &n - out.nodes.data();
    const auto flags = TakeLittleEndian<uint8_t>(bytes);
    if (flags > kAllFlags) return bad(absl::StrCat("node ", number, ": flags cannot be ", flags));
    n.node.kind = (flags & kIsCorner) != 0 ? NodeKind::kCorner : NodeKind::kCenter;
    n.visible = (flags & kIsVisible) != 0, n.scoreable = (flags & kIsScoreable) != 0;
    n.node.row = TakeLittleEndian<uint16_t>(bytes), n.node.col = TakeLittleEndian<uint16_t>(bytes);
    n.pixel_px.x() = TakeLittleEndian<int32_t>(bytes) / kPixelSteps;
    n.pixel_px.y() = TakeLittleEndian<int32_t>(bytes) / kPixelSteps;
    n.pitch_px = TakeLittleEndian<uint16_t>(bytes) / kPitchSteps;
    n.facing_deg = TakeLittleEndian<uint16_t>(bytes) / kAngleSteps;
    n.vertex = TakeLittleEndian<int32_t>(bytes);
    if (n.vertex < -1) return bad(absl::StrCat("node ", number, ": vertex cannot be ", n.vertex));
  }
  return out;
}

absl::Status WriteFrameTruth(const std::string& folder, const FrameTruth& truth) {
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  for (const ViewTruth& view : truth.views) {
    const std::string path = (fs::path(folder) / (view.camera_id + ".truth")).string();
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(path, EncodeViewTruth(view)));
  }
  return WriteMesh((fs::path(folder) / "mesh.ply").string(), truth.mesh);
}

absl::StatusOr<FrameTruth> ReadFrameTruth(const std::string& folder) {
  FrameTruth out;
  WEFT_ASSIGN_OR_RETURN(out.mesh, ReadMesh((fs::path(folder) / "mesh.ply").string()));
  const auto vertices = static_cast<int>(out.mesh.vertices_mm.size());
  for (const std::string& camera : NamesIn(folder, ".truth")) {
    const std::string path = (fs::path(folder) / (camera + ".truth")).string();
    WEFT_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path));
    WEFT_ASSIGN_OR_RETURN(ViewTruth view, DecodeViewTruth(text, camera, path));
    for (const NodeTruth& node : view.nodes) {
      if (node.vertex < vertices) continue;
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": names vertex ", node.vertex, ", mesh.ply has ", vertices));
    }
    out.views.push_back(std::move(view));
  }
  if (out.views.empty()) {
    return absl::NotFoundError(absl::StrCat(
        folder, ": holds no <camera>.truth; is it a frame of a truth folder of `weft simulate`?"));
  }
  return out;
}

absl::StatusOr<std::vector<std::string>> ListTruthFrames(const std::string& truth_folder) {
  std::vector<std::string> names;
  for (std::string& name : NamesIn(truth_folder, "")) {
    const fs::path folder = fs::path(truth_folder) / name;
    const bool is_template = PathExists(folder / "template.json");  // beside the frames of a take
    if (!is_template && PathExists(folder / "mesh.ply")) names.push_back(std::move(name));
  }
  if (!names.empty()) return names;
  return absl::NotFoundError(absl::StrCat(
      truth_folder, ": holds no <frame>/mesh.ply; give the truth folder that `weft simulate` wrote"));
}

}  // namespace weft
