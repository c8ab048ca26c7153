// The formats of `weft export` and what each of them carries.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

enum class ExportFormat { kPly, kObj, kGlb, kMdd, kPc2, kUsda, kNpz };

// Besides positions and faces, which all formats carry (point caches in a mesh beside them).
enum class ExportAttribute {
  kUv,        // texture coordinates per corner of a face, u to the right, v upwards
  kVelocity,  // of a vertex, exported unit per second
  kState,     // of a vertex at a frame: 0 inferred, 1 observed, 2 observed by two views, 3 bridged, 4 driven
  kSigma,     // standard deviation of a vertex's position at a frame, exported unit
  kViews,     // cameras that observed the vertex at a frame
  kCoverage,  // share of the exported frames in which the vertex was observed, 0 to 1
  kNormal,    // outward normal of a vertex at a frame, of length 1; on request, since it doubles a file
};

enum class UpAxis { kY, kZ };
enum class LengthUnit { kMetre, kCentimetre, kMillimetre };

struct FormatTraits {
  ExportFormat format;
  const char* name;             // of --format, and the ending of the files
  const char* about;            // a line of help
  bool file_per_frame = false;  // <out>/<frame>.<name>; else <out>/garment.<name>
  UpAxis up;                    // unless told otherwise
  bool fixed_axes = false;      // y up and metres by the format's specification
  bool needs_rate = false;      // frames have times
  bool repeats_gaps = false;    // samples are equidistant: a frame without a mesh repeats the one before
  std::vector<ExportAttribute> carries;

  bool Carries(ExportAttribute attribute) const;
  // All that are written where none is named.
  std::vector<ExportAttribute> ByDefault() const;
};

// All formats, in the order of the documents.
const std::vector<FormatTraits>& ExportFormats();
const FormatTraits& TraitsOf(ExportFormat format);

// Names as on the command line: "glb"; "uv", "velocity"; "y"; "mm".
const char* NameOf(ExportAttribute attribute);
const char* NameOf(UpAxis up);
const char* NameOf(LengthUnit unit);

// InvalidArgument lists the known names.
absl::StatusOr<ExportFormat> ExportFormatFromName(std::string_view name);
absl::StatusOr<ExportAttribute> ExportAttributeFromName(std::string_view name);
absl::StatusOr<UpAxis> UpAxisFromName(std::string_view name);
absl::StatusOr<LengthUnit> LengthUnitFromName(std::string_view name);

// A table, a line per format: which attributes it carries, for --help.
std::string FormatTable();

}  // namespace weft
