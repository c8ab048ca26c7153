#include "services/results/report/picture_html.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/html_text.h"
#include "services/results/report/svg_file.h"

namespace weft {
namespace {

constexpr int kStops = 16;

Eigen::Vector3f StopColor(int stop, const ScalarRange& range) {
  return ScalarColor(range.low + (range.high - range.low) * stop / kStops, range);
}

// "0 mm", "0.5 mm and more".
struct BarEnds {
  std::string low, high;
};
BarEnds EndsOf(const ScalarRange& range, const std::string& unit, bool bounded) {
  const std::string after = unit.empty() ? "" : absl::StrCat(" ", unit);
  const std::string minus = range.low < 0 ? "\xE2\x88\x92" : "", plus = range.low < 0 ? "+" : "";
  return {absl::StrFormat("%s%g%s%s", minus, std::abs(range.low), after,
                          range.low < 0 && !bounded ? " and less" : ""),
          absl::StrFormat("%s%g%s%s", plus, range.high, after, bounded ? "" : " and more")};
}

bool IsBounded(const GarmentMap& map) {
  return std::ranges::none_of(map.values, [&](double value) {
    return value > map.range.high || (map.range.low < 0 && value < map.range.low);
  });
}

std::string Picture(const MeshPicture& picture, const std::string& what_of, const std::string& coloring) {
  const std::string colours = coloring.empty() ? "" : absl::StrCat(", coloured by ", coloring);
  const std::string what = EscapeHtml(absl::StrCat(picture.title, " of ", what_of, colours));
  return absl::StrFormat(
      "<figure><img width=\"%d\" height=\"%d\" alt=\"%s\" src=\"data:%s;base64,%s\">"
      "<figcaption>%s</figcaption></figure>\n",
      picture.width_px, picture.height_px, what, picture.type, Base64(picture.bytes),
      EscapeHtml(picture.title));
}

}  // namespace

std::string ColorBar(const ScalarRange& range, const std::string& label, const std::string& unit,
                     bool bounded) {
  std::string stops;
  for (int i = 0; i <= kStops; ++i)
    absl::StrAppendFormat(&stops, "%s%s %.1f%%", i > 0 ? "," : "", HexColor(StopColor(i, range)),
                          100.0 * i / kStops);
  const BarEnds ends = EndsOf(range, unit, bounded);
  return absl::StrFormat(
      "<p class=\"colorbar\"><span>%s %s</span><i "
      "style=\"background:linear-gradient(90deg,%s)\"></i><span>%s</span></p>",
      EscapeHtml(label), EscapeHtml(ends.low), stops, EscapeHtml(ends.high));
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
      case VertexState::kDriven:
        return "driven: by the garment's avatar and at most one camera";
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

namespace {

// The middle of a diverging scale is nearly white; in deep shadow it would look like what has no value.
double ShadingOf(const GarmentMap& map) { return map.range.low < 0 ? 0.25 : 0.6; }

}  // namespace

absl::StatusOr<std::string> GarmentMapHtml(const TriangleMesh& mesh, const GarmentMap& map) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<MeshPicture> pictures,
                        DrawBothSides(mesh, ScalarColors(map.values, map.range), ShadingOf(map)));
  return absl::StrCat("<div><h3>", EscapeHtml(map.title), "</h3>\n",
                      PictureRow(pictures, "the garment", map.title,
                                 ColorBar(map.range, map.label, map.unit, IsBounded(map))),
                      "</div>\n");
}

absl::StatusOr<std::string> GarmentMapSvg(const TriangleMesh& mesh, const GarmentMap& map) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<MeshPicture> pictures,
                        DrawBothSides(mesh, ScalarColors(map.values, map.range), ShadingOf(map)));
  constexpr double kGap = 20, kBarHeight = 40, kBarX = 90, kBarWidth = 220;
  std::string body = "<defs><linearGradient id=\"scale\">";
  for (int i = 0; i <= kStops; ++i)
    absl::StrAppendFormat(&body, "<stop offset=\"%.1f%%\" stop-color=\"%s\"/>", 100.0 * i / kStops,
                          HexColor(StopColor(i, map.range)));
  const BarEnds ends = EndsOf(map.range, map.unit, IsBounded(map));
  absl::StrAppendFormat(&body,
                        "</linearGradient></defs><text x=\"10\" y=\"14\">%s</text><rect x=\"%.0f\" y=\"4\" "
                        "width=\"%.0f\" height=\"11\" fill=\"url(#scale)\"/><text class=\"tick\" x=\"%.0f\" "
                        "y=\"29\">%s</text><text class=\"tick\" x=\"%.0f\" y=\"29\" "
                        "text-anchor=\"end\">%s</text>",
                        EscapeHtml(map.label), kBarX, kBarWidth, kBarX, EscapeHtml(ends.low),
                        kBarX + kBarWidth, EscapeHtml(ends.high));
  double x = 10, height = 0;
  for (const MeshPicture& picture : pictures) {
    absl::StrAppendFormat(&body,
                          "<image x=\"%.0f\" y=\"%.0f\" width=\"%d\" height=\"%d\" "
                          "href=\"data:%s;base64,%s\"/><text class=\"tick\" x=\"%.0f\" y=\"%.0f\" "
                          "text-anchor=\"middle\">%s</text>",
                          x, kBarHeight, picture.width_px, picture.height_px, picture.type,
                          Base64(picture.bytes), x + 0.5 * picture.width_px,
                          kBarHeight + picture.height_px + 14, EscapeHtml(picture.title));
    x += picture.width_px + kGap;
    height = std::max<double>(height, picture.height_px);
  }
  return SvgFile(x, kBarHeight + height + 22, map.title, body);
}

}  // namespace weft
