#include "capture/rig/krt.h"

#include <cmath>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// People write matrices with commas, and those of MATLAB with brackets and semicolons.
constexpr char kBetween[] = " \t,;[]";

// Ids may have a # inside.
size_t CommentBegin(absl::string_view line) {
  for (size_t at = line.find('#'); at != absl::string_view::npos; at = line.find('#', at + 1))
    if (at == 0 || line[at - 1] == ' ' || line[at - 1] == '\t') return at;
  return absl::string_view::npos;
}

class KrtReader {
 public:
  KrtReader(std::string_view text, const std::string& source_name)
      : lines_(absl::StrSplit(absl::string_view(text.data(), text.size()), '\n')),
        source_name_(source_name) {}

  // Skips empty lines and comments, from # on; false at the end of the text.
  bool NextLine() {
    while (at_ < lines_.size()) {
      const absl::string_view line = lines_[at_++];
      current_ = absl::StripAsciiWhitespace(line.substr(0, CommentBegin(line)));
      if (!current_.empty()) return true;
    }
    return false;
  }
  std::string Current() const { return std::string(current_); }

  absl::StatusOr<std::vector<double>> Numbers(const std::string& what, size_t count) {
    if (!NextLine()) return Error(absl::StrCat("the file ends where ", what, " is expected"));
    std::vector<double> out;
    for (const absl::string_view word :
         absl::StrSplit(current_, absl::ByAnyChar(kBetween), absl::SkipEmpty())) {
      double value = 0;
      if (!absl::SimpleAtod(word, &value) || !std::isfinite(value)) {
        return Error(absl::StrCat("\"", word, "\" is not a number (", what, ")"));
      }
      out.push_back(value);
    }
    if (out.size() != count)
      return Error(absl::StrCat(what, " has ", out.size(), " numbers, expected ", count));
    return out;
  }

  absl::Status Error(const std::string& what) const {
    return absl::InvalidArgumentError(absl::StrCat(source_name_, ": line ", at_, ": ", what));
  }

 private:
  std::vector<absl::string_view> lines_;
  std::string source_name_;
  size_t at_ = 0;
  absl::string_view current_;
};

absl::StatusOr<CameraModel> ReadCamera(KrtReader& reader) {
  CameraModel camera;
  camera.id = reader.Current();
  if (camera.id.find_first_of(" \t/") != std::string::npos) {
    return reader.Error(absl::StrCat("expected a camera id, found \"", camera.id, "\""));
  }
  std::array<std::array<double, 3>, 3> k{};
  for (int r = 0; r < 3; ++r) {
    WEFT_ASSIGN_OR_RETURN(const auto row,
                          reader.Numbers(absl::StrCat("K row ", r, " of camera ", camera.id), 3));
    std::copy(row.begin(), row.end(), k[r].begin());
  }
  if (std::abs(k[0][1]) > 1e-9 || k[1][0] != 0 || k[2][0] != 0 || k[2][1] != 0 || k[2][2] != 1) {
    return reader.Error(absl::StrCat("K of camera ", camera.id,
                                     " has skew or is not normalised; expected fx 0 cx / 0 fy cy / 0 0 1"));
  }
  camera.fx_px = k[0][0];
  camera.fy_px = k[1][1];
  camera.cx_px = k[0][2];
  camera.cy_px = k[1][2];
  WEFT_ASSIGN_OR_RETURN(const auto distortion,
                        reader.Numbers(absl::StrCat("distortion k1 k2 p1 p2 k3 of camera ", camera.id), 5));
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  for (int r = 0; r < 3; ++r) {
    WEFT_ASSIGN_OR_RETURN(const auto row,
                          reader.Numbers(absl::StrCat("[R|t] row ", r, " of camera ", camera.id), 4));
    for (int c = 0; c < 3; ++c) camera.rotation(r, c) = row[c];
    camera.translation_mm[r] = row[3];
  }
  return camera;
}

}  // namespace

absl::StatusOr<Rig> ParseKrt(std::string_view text, const std::string& source_name, int width_px,
                             int height_px) {
  KrtReader reader(text, source_name);
  Rig rig;
  while (reader.NextLine()) {
    WEFT_ASSIGN_OR_RETURN(CameraModel camera, ReadCamera(reader));
    camera.width_px = width_px;
    camera.height_px = height_px;
    rig.cameras.push_back(std::move(camera));
  }
  if (absl::Status status = rig.Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", status.message()));
  }
  return rig;
}

absl::StatusOr<std::string> FormatKrt(const Rig& rig) {
  WEFT_RETURN_IF_ERROR(rig.Validate());
  std::string out;
  for (const CameraModel& c : rig.cameras) {
    const auto& d = c.distortion;
    if (d[5] != 0 || d[6] != 0 || d[7] != 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          "camera ", c.id,
          ": KRT holds k1 k2 p1 p2 k3 only, and its lens has k4 k5 k6 as well; export as opencv"));
    }
    if (c.id.find_first_of(" \t/") != std::string::npos) {
      return absl::InvalidArgumentError(
          absl::StrCat("camera ", c.id, ": KRT allows no space or slash in an id"));
    }
    absl::StrAppendFormat(&out, "%s\n%.17g 0 %.17g\n0 %.17g %.17g\n0 0 1\n%.17g %.17g %.17g %.17g %.17g\n",
                          c.id, c.fx_px, c.cx_px, c.fy_px, c.cy_px, d[0], d[1], d[2], d[3], d[4]);
    for (int r = 0; r < 3; ++r) {
      absl::StrAppendFormat(&out, "%.17g %.17g %.17g %.17g\n", c.rotation(r, 0), c.rotation(r, 1),
                            c.rotation(r, 2), c.translation_mm[r]);
    }
    out += '\n';
  }
  return out;
}

}  // namespace weft
