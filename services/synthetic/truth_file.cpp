#include "services/synthetic/truth_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/files/atomic_file.h"
#include "services/files/mesh_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 10> kColumns = {
    "kind", "row", "col", "x_px", "y_px", "pitch_px", "facing_deg", "visible", "scoreable", "vertex"};
constexpr std::string_view kHeader = "kind,row,col,x_px,y_px,pitch_px,facing_deg,visible,scoreable,vertex";

void AppendFixed(double value, int digits, std::string& out) {
  char buffer[400];
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::fixed, digits);
  out += ',';
  out.append(buffer, end.ptr);
}

template <typename Number>
bool ParseNumber(std::string_view text, Number least, Number* out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *out);
  if (error != std::errc() || end != text.data() + text.size()) return false;
  return std::isfinite(static_cast<double>(*out)) && *out >= least;
}

// The number of the first column that is wrong, or -1.
int ParseFields(const std::array<std::string_view, kColumns.size()>& fields, NodeTruth* node) {
  constexpr double kLeastPixel = -1e9;
  int visible = 0, scoreable = 0;
  if (fields[0] != "center" && fields[0] != "corner") return 0;
  node->node.kind = fields[0] == "center" ? NodeKind::kCenter : NodeKind::kCorner;
  if (!ParseNumber(fields[1], 0, &node->node.row)) return 1;
  if (!ParseNumber(fields[2], 0, &node->node.col)) return 2;
  if (!ParseNumber(fields[3], kLeastPixel, &node->pixel_px.x())) return 3;
  if (!ParseNumber(fields[4], kLeastPixel, &node->pixel_px.y())) return 4;
  if (!ParseNumber(fields[5], 0.0, &node->pitch_px)) return 5;
  if (!ParseNumber(fields[6], 0.0, &node->facing_deg)) return 6;
  if (!ParseNumber(fields[7], 0, &visible) || visible > 1) return 7;
  if (!ParseNumber(fields[8], 0, &scoreable) || scoreable > 1) return 8;
  if (!ParseNumber(fields[9], -1, &node->vertex)) return 9;
  node->visible = visible == 1;
  node->scoreable = scoreable == 1;
  return -1;
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
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::string ViewTruthToCsv(const ViewTruth& truth) {
  std::string out(kHeader);
  out += '\n';
  for (const NodeTruth& n : truth.nodes) {
    absl::StrAppend(&out, n.node.kind == NodeKind::kCenter ? "center," : "corner,", n.node.row, ",",
                    n.node.col);
    AppendFixed(n.pixel_px.x(), 4, out);
    AppendFixed(n.pixel_px.y(), 4, out);
    AppendFixed(n.pitch_px, 3, out);
    AppendFixed(n.facing_deg, 2, out);
    absl::StrAppend(&out, n.visible ? ",1" : ",0", n.scoreable ? ",1," : ",0,", n.vertex, "\n");
  }
  return out;
}

absl::StatusOr<ViewTruth> ParseViewTruth(std::string_view csv, std::string camera_id,
                                         const std::string& source_name) {
  ViewTruth out;
  out.camera_id = std::move(camera_id);
  int line = 0;
  for (const absl::string_view text : absl::StrSplit(absl::string_view(csv.data(), csv.size()), '\n')) {
    ++line;
    const auto bad = [&](const std::string& what) {
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": line ", line, ": ", what));
    };
    if (line == 1) {
      if (std::string_view(text.data(), text.size()) == kHeader) continue;
      return bad(absl::StrCat("expected the columns ", std::string(kHeader)));
    }
    if (text.empty()) continue;
    std::array<std::string_view, kColumns.size()> fields;
    size_t count = 0;
    for (const absl::string_view field : absl::StrSplit(text, ',')) {
      if (count < fields.size()) fields[count] = std::string_view(field.data(), field.size());
      ++count;
    }
    if (count != fields.size()) return bad(absl::StrCat("has ", count, " columns, expected ", fields.size()));
    NodeTruth node;
    if (const int wrong = ParseFields(fields, &node); wrong >= 0) {
      return bad(
          absl::StrCat(std::string(kColumns[wrong]), " cannot be \"", std::string(fields[wrong]), "\""));
    }
    out.nodes.push_back(node);
  }
  return out;
}

absl::Status WriteFrameTruth(const std::string& folder, const FrameTruth& truth) {
  if (absl::Status status = CreateFolders(folder); !status.ok()) return status;
  for (const ViewTruth& view : truth.views) {
    const std::string path = (fs::path(folder) / (view.camera_id + ".csv")).string();
    if (absl::Status status = WriteFileAtomically(path, ViewTruthToCsv(view)); !status.ok()) return status;
  }
  return WriteMesh((fs::path(folder) / "mesh.ply").string(), truth.mesh);
}

absl::StatusOr<FrameTruth> ReadFrameTruth(const std::string& folder) {
  FrameTruth out;
  absl::StatusOr<TriangleMesh> mesh = ReadMesh((fs::path(folder) / "mesh.ply").string());
  if (!mesh.ok()) return mesh.status();
  out.mesh = *std::move(mesh);
  const auto vertices = static_cast<int>(out.mesh.vertices_mm.size());
  for (const std::string& camera : NamesIn(folder, ".csv")) {
    const std::string path = (fs::path(folder) / (camera + ".csv")).string();
    const absl::StatusOr<std::string> text = ReadWholeFile(path);
    if (!text.ok()) return text.status();
    absl::StatusOr<ViewTruth> view = ParseViewTruth(*text, camera, path);
    if (!view.ok()) return view.status();
    for (const NodeTruth& node : view->nodes) {
      if (node.vertex < vertices) continue;
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": names vertex ", node.vertex, ", mesh.ply has ", vertices));
    }
    out.views.push_back(*std::move(view));
  }
  if (out.views.empty()) {
    return absl::NotFoundError(
        absl::StrCat(folder, ": holds no <camera>.csv; is it a frame of a truth folder of `weft simulate`?"));
  }
  return out;
}

absl::StatusOr<std::vector<std::string>> ListTruthFrames(const std::string& truth_folder) {
  std::vector<std::string> names;
  for (std::string& name : NamesIn(truth_folder, "")) {
    std::error_code error;
    if (fs::exists(fs::path(truth_folder) / name / "mesh.ply", error)) names.push_back(std::move(name));
  }
  if (!names.empty()) return names;
  return absl::NotFoundError(absl::StrCat(
      truth_folder, ": holds no <frame>/mesh.ply; give the truth folder that `weft simulate` wrote"));
}

}  // namespace weft
