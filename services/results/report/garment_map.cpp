#include "services/results/report/garment_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/html_text.h"
#include "services/results/report/picture_data.h"
#include "services/results/report/svg_file.h"

namespace weft {
namespace {

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

// The middle of a diverging scale is nearly white; in deep shadow it would look like what has no value.
absl::StatusOr<std::vector<MeshPicture>> BothSides(const TriangleMesh& mesh, const GarmentMap& map) {
  return DrawBothSides(mesh, ScalarColors(map.values, map.range), map.range.low < 0 ? 0.25 : 0.6);
}

}  // namespace

GarmentMap ShareMap(const std::string& title, const std::string& label, std::vector<double> shares) {
  for (double& share : shares) share *= 100;
  return {title, label, "%", std::move(shares), {0, 100}};
}

absl::StatusOr<v1::PageMap> GarmentMapData(const TriangleMesh& mesh, const GarmentMap& map) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<MeshPicture> pictures, BothSides(mesh, map));
  v1::PageMap data;
  data.set_title(map.title);
  AddPictures(pictures, *data.mutable_pictures());
  *data.mutable_key() = ScaleKey(map.range, map.label, map.unit, IsBounded(map));
  return data;
}

absl::StatusOr<std::string> GarmentMapSvg(const TriangleMesh& mesh, const GarmentMap& map) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<MeshPicture> pictures, BothSides(mesh, map));
  constexpr double kGap = 20, kBarHeight = 40, kBarX = 90, kBarWidth = 220;
  std::string body = "<defs><linearGradient id=\"scale\">";
  const std::vector<std::string> colors = ScaleColors(map.range);
  for (size_t i = 0; i < colors.size(); ++i)
    absl::StrAppendFormat(&body, "<stop offset=\"%.1f%%\" stop-color=\"%s\"/>",
                          100.0 * static_cast<double>(i) / static_cast<double>(colors.size() - 1), colors[i]);
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
