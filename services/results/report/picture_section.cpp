// The section with pictures of meshes.
#include "absl/strings/str_cat.h"
#include "services/results/report/html_text.h"
#include "services/results/report/picture_html.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

// A row of its own, since the pictures are to be looked at closely.
std::string InImages(const FramePictures& frame) {
  if (frame.in_images.empty()) return "";
  if (frame.by_state.empty()) {
    return absl::StrCat(
        "<div class=\"in-images\">",
        PictureRow(frame.in_images, absl::StrCat("frame ", frame.frame), "",
                   "<p class=\"legend\">Images of cameras; the frame could not be registered.</p>"),
        "</div>\n");
  }
  return absl::StrCat(
      "<div class=\"in-images\">",
      PictureRow(
          frame.in_images, absl::StrCat("frame ", frame.frame, " with the mesh over it"), "",
          "<p class=\"legend\">Images of cameras. Lines, black inside and white outside: edges of the "
          "mesh as the camera sees them; where they leave the cloth, the mesh is off. Tinted by state: "
          "what three cameras did not observe.</p>"),
      "</div>\n");
}

}  // namespace

std::string PictureSection(const std::vector<FramePictures>& pictures) {
  std::string body;
  for (const FramePictures& frame : pictures) {
    if (frame.by_state.empty() && frame.by_sigma.empty() && frame.in_images.empty()) continue;
    absl::StrAppend(
        &body, "<h3>Frame ", NameHtml(frame.frame),
        frame.why_shown.empty() ? "" : absl::StrCat(" <small>", EscapeHtml(frame.why_shown), "</small>"),
        "</h3>\n<div class=\"meshes\">\n",
        PictureRow(frame.by_state, absl::StrCat("frame ", frame.frame), "state",
                   StateLegend({VertexState::kObserved, VertexState::kTwoView,
                                frame.is_driven ? VertexState::kDriven : VertexState::kInferred})),
        PictureRow(frame.by_sigma, absl::StrCat("frame ", frame.frame), "uncertainty",
                   ColorBar(frame.sigma_range_mm, "sigma", "mm")),
        InImages(frame), "</div>\n");
  }
  return body.empty() ? "" : Section("meshes", "Meshes", body);
}

}  // namespace weft
