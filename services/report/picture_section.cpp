// The section with pictures of meshes.
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/report/html_text.h"
#include "services/report/report_sections.h"

namespace weft {
namespace {

std::string Picture(const MeshPicture& picture, const std::string& frame, absl::string_view coloring) {
  const std::string what =
      EscapeHtml(absl::StrCat(picture.title, " of frame ", frame, ", coloured by ", coloring));
  return absl::StrFormat(
      "<figure><img width=\"%d\" height=\"%d\" alt=\"%s\" src=\"data:image/png;base64,%s\">"
      "<figcaption>%s</figcaption></figure>\n",
      picture.width_px, picture.height_px, what, Base64(picture.png), EscapeHtml(picture.title));
}

std::string StateLegend() {
  const auto entry = [](VertexState state, absl::string_view text) {
    return absl::StrCat("<li><i style=\"background:", HexColor(StateColor(state)), "\"></i>", text, "</li>");
  };
  return absl::StrCat("<ul class=\"legend\">",
                      entry(VertexState::kObserved, "observed: measured in this frame"),
                      entry(VertexState::kInferred, "inferred from its surroundings"), "</ul>");
}

std::string ColorBar(const ScalarRange& range) {
  constexpr int kStops = 16;
  std::string stops;
  for (int i = 0; i <= kStops; ++i) {
    const double t = static_cast<double>(i) / kStops;
    absl::StrAppendFormat(&stops, "%s%s %.1f%%", i > 0 ? "," : "", HexColor(MapColor(t)), 100 * t);
  }
  return absl::StrFormat(
      "<p class=\"colorbar\"><span>sigma %g</span><i "
      "style=\"background:linear-gradient(90deg,%s)\"></i><span>%g "
      "mm and more</span></p>",
      range.low, stops, range.high);
}

std::string PictureRow(const std::vector<MeshPicture>& pictures, const std::string& frame,
                       absl::string_view coloring, const std::string& legend) {
  if (pictures.empty()) return "";
  std::string html = absl::StrCat("<div class=\"pair\">", legend, "<div class=\"pictures\">\n");
  for (const MeshPicture& picture : pictures) html += Picture(picture, frame, coloring);
  return html + "</div></div>\n";
}

}  // namespace

std::string PictureSection(const std::vector<FramePictures>& pictures) {
  std::string body;
  for (const FramePictures& frame : pictures) {
    if (frame.by_state.empty() && frame.by_sigma.empty()) continue;
    absl::StrAppend(
        &body, "<h3>Frame ", NameHtml(frame.frame),
        frame.why_shown.empty() ? "" : absl::StrCat(" <small>", EscapeHtml(frame.why_shown), "</small>"),
        "</h3>\n<div class=\"meshes\">\n", PictureRow(frame.by_state, frame.frame, "state", StateLegend()),
        PictureRow(frame.by_sigma, frame.frame, "uncertainty", ColorBar(frame.sigma_range_mm)), "</div>\n");
  }
  return body.empty() ? "" : Section("meshes", "Meshes", body);
}

}  // namespace weft
