#include "services/report/picture_html.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/report/frame_pictures.h"
#include "services/report/html_text.h"

namespace weft {
namespace {

std::string Picture(const MeshPicture& picture, const std::string& what_of, const std::string& coloring) {
  const std::string what =
      EscapeHtml(absl::StrCat(picture.title, " of ", what_of, ", coloured by ", coloring));
  return absl::StrFormat(
      "<figure><img width=\"%d\" height=\"%d\" alt=\"%s\" src=\"data:image/png;base64,%s\">"
      "<figcaption>%s</figcaption></figure>\n",
      picture.width_px, picture.height_px, what, Base64(picture.png), EscapeHtml(picture.title));
}

}  // namespace

std::string ColorBar(const ScalarRange& range, const std::string& label, const std::string& unit,
                     bool bounded) {
  constexpr int kStops = 16;
  std::string stops;
  for (int i = 0; i <= kStops; ++i) {
    const double t = static_cast<double>(i) / kStops;
    absl::StrAppendFormat(&stops, "%s%s %.1f%%", i > 0 ? "," : "", HexColor(MapColor(t)), 100 * t);
  }
  const std::string unit_html = unit.empty() ? "" : absl::StrCat(" ", EscapeHtml(unit));
  return absl::StrFormat(
      "<p class=\"colorbar\"><span>%s %g%s</span><i "
      "style=\"background:linear-gradient(90deg,%s)\"></i><span>%g%s%s</span></p>",
      EscapeHtml(label), range.low, unit_html, stops, range.high, unit_html, bounded ? "" : " and more");
}

std::string StateLegend(const std::vector<VertexState>& states) {
  const auto meaning = [](VertexState state) {
    switch (state) {
      case VertexState::kObserved:
        return "observed: measured in this frame";
      case VertexState::kTwoView:
        return "measured by two cameras only";
      case VertexState::kBridged:
        return "bridged: from the frames around";
      case VertexState::kInferred:
        break;
    }
    return "inferred from the cloth around it";
  };
  std::string html = "<ul class=\"legend\">";
  for (const VertexState state : states)
    absl::StrAppend(&html, "<li><i style=\"background:", HexColor(StateColor(state)), "\"></i>",
                    meaning(state), "</li>");
  return html + "</ul>";
}

GarmentMap ShareMap(const std::string& title, const std::string& label, std::vector<double> shares) {
  for (double& share : shares) share *= 100;
  return {title, label, "%", std::move(shares), {0, 100}};
}

std::string PictureRow(const std::vector<MeshPicture>& pictures, const std::string& what_of,
                       const std::string& coloring, const std::string& legend) {
  if (pictures.empty()) return "";
  std::string html = absl::StrCat("<div class=\"pair\">", legend, "<div class=\"pictures\">\n");
  for (const MeshPicture& picture : pictures) html += Picture(picture, what_of, coloring);
  return html + "</div></div>\n";
}

absl::StatusOr<std::string> GarmentMapHtml(const TriangleMesh& mesh, const GarmentMap& map) {
  const absl::StatusOr<std::vector<MeshPicture>> pictures =
      DrawBothSides(mesh, ScalarColors(map.values, map.range), 0.6);
  if (!pictures.ok()) return pictures.status();
  const bool bounded = std::none_of(map.values.begin(), map.values.end(),
                                    [&](double value) { return value > map.range.high; });
  return absl::StrCat(
      "<div><h3>", EscapeHtml(map.title), "</h3>\n",
      PictureRow(*pictures, "the garment", map.title, ColorBar(map.range, map.label, map.unit, bounded)),
      "</div>\n");
}

}  // namespace weft
