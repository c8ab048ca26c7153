#include "services/studio/preview/preview_page.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/image/image_encoders.h"
#include "services/results/report/html_text.h"
#include "services/studio/preview/coverage_picture.h"

namespace weft {
namespace {

// Shares lost in white: white cells are a seventh of the cloth; lamps may stand in a picture.
constexpr double kClippedCloth = 0.01, kClippedPicture = 0.06;
constexpr int kDim = 80;              // a 99th percentile below leaves two thirds of the range unused
constexpr double kFocusFallen = 0.6;  // of the best so far
constexpr double kFull = 0.97;        // of a bar

constexpr const char* kStyle = R"(<style>
:root { color-scheme: light dark; --page: #f6f6f3; --card: #fff; --ink: #1c2024; --soft: #5b636c; --line: #dcdedb;
  --rail: #e3e5e2; --bad: #b3261e; --good: #1f7a3f; --accent: #2f6fb0; }
@media (prefers-color-scheme: dark) { :root { --page: #14171a; --card: #1c2024; --ink: #e7e9ea; --soft: #9ea7b0;
  --line: #333a41; --rail: #333a41; --bad: #f28b82; --good: #6cc98c; --accent: #6aa9e6; } }
* { box-sizing: border-box; }
body { margin: 0; padding: 14px 18px 30px; background: var(--page); color: var(--ink);
  font: 14px/1.45 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; font-variant-numeric: tabular-nums; }
header { display: flex; flex-wrap: wrap; align-items: baseline; gap: 4px 14px; margin-bottom: 10px; }
h1 { font-size: 20px; margin: 0; font-weight: 650; } h2 { font-size: 16px; margin: 0 0 6px; font-weight: 650; }
header span, .soft { color: var(--soft); }
.chip { padding: 0 10px; border-radius: 999px; color: #fff; background: var(--good); font-weight: 600; font-size: 13px; }
.over .chip { background: var(--soft); } .stale .chip { background: var(--bad); }
header .chip { color: #fff; }
section, figure { background: var(--card); border: 1px solid var(--line); border-radius: 10px; }
section { padding: 12px 16px 14px; margin-bottom: 14px; }
.alerts { border-left: 5px solid var(--bad); } .alerts p { margin: 0; }
.columns { display: grid; grid-template-columns: minmax(300px, 27%) 1fr; gap: 14px; align-items: start; }
@media (max-width: 900px) { .columns { grid-template-columns: 1fr; } }
.cameras { display: grid; grid-template-columns: repeat(auto-fill, minmax(210px, 1fr)); gap: 10px; }
figure { margin: 0; overflow: hidden; } figure img { display: block; width: 100%; height: auto; }
figure.faulty { border-color: var(--bad); box-shadow: inset 0 0 0 1px var(--bad); }
figcaption { padding: 6px 10px 9px; } figcaption b { font-size: 15px; } .bad { color: var(--bad); font-weight: 600; }
.none { padding: 26px 10px; text-align: center; }
.meter { display: grid; grid-template-columns: 1fr auto; gap: 2px 10px; align-items: end; margin-top: 8px; color: var(--soft);
  font-size: 14px; }
.meter em { font-style: normal; color: var(--ink); font-size: 19px; font-weight: 650; line-height: 1.1; white-space: nowrap; }
.meter em small { font-size: 13px; font-weight: 400; color: var(--soft); }
.rail { grid-column: 1 / -1; background: var(--rail); height: 22px; border-radius: 5px; position: relative; overflow: hidden; }
.focus .rail { height: 34px; } .focus em { font-size: 30px; }
.rail i { position: absolute; top: 0; bottom: 0; background: var(--accent); }
.rail i.mid { width: 3px; background: var(--card); }
.rail i.full { background: var(--good); }
figure a { color: inherit; text-decoration: none; } figure .all { display: none; color: var(--accent); font-size: 20px; }
figure:target { position: fixed; inset: 0; z-index: 9; display: flex; flex-direction: column; border-radius: 0; overflow: auto; }
figure:target > a { flex: 1; min-height: 0; } figure:target img { width: 100%; height: 100%; object-fit: contain; }
figure:target .all { display: block; float: right; } figure:target figcaption { padding: 10px 24px 20px; }
figure:target .rail { height: 8vh; } figure:target .focus .rail { height: 16vh; }
figure:target .meter { font-size: 3vh; } figure:target .meter em { font-size: 6vh; } figure:target .focus em { font-size: 13vh; }
.coverage .share { font-size: 34px; font-weight: 650; line-height: 1.1; }
.stack { display: flex; height: 12px; border-radius: 6px; overflow: hidden; margin: 8px 0; background: var(--rail); }
.coverage table { border-collapse: collapse; width: 100%; font-size: 13px; } .coverage td { padding: 1px 0; }
.coverage td + td { text-align: right; } .key { display: inline-block; width: 11px; height: 11px; border-radius: 3px; margin-right: 7px; }
.pictures { display: flex; align-items: flex-start; gap: 8px; margin-top: 10px; } .pictures img { flex: 1; min-width: 0; max-width: 100%; height: auto; image-rendering: auto; }
</style>
)";

// Says how old the page is, and warns where nobody renews it.
constexpr const char* kScript = R"(<script>
const made = %d, limit = %.1f, over = %s;
function tell() {
  const age = (Date.now() - made) / 1000, stale = !over && age > limit;
  document.getElementById("time").textContent = new Date(made).toLocaleTimeString();
  document.body.classList.toggle("stale", stale);
  if (stale) document.getElementById("chip").textContent = "page not updated for " + Math.round(age) + " s: the recorder stopped or hangs";
}
tell(); setInterval(tell, 500);
</script>
)";

std::string JpegTag(const Frame& rgb, const std::string& what) {
  constexpr int kQuality = 80;
  const absl::StatusOr<std::vector<uint8_t>> bytes =
      EncodeJpeg({rgb.width_px, rgb.height_px, 3, 8, *rgb.pixels}, kQuality);
  if (!bytes.ok())
    return absl::StrCat("<p class=bad>", EscapeHtml(std::string(bytes.status().message())), "</p>\n");
  return absl::StrFormat("<img alt=\"%s\" width=%d height=%d src=\"data:image/jpeg;base64,%s\">\n",
                         EscapeHtml(what), rgb.width_px, rgb.height_px,
                         Base64({reinterpret_cast<const char*>(bytes->data()), bytes->size()}));
}

// A bar between two shares of its rail, with a mark inside where `mark` is not negative.
std::string Meter(const char* name, double begin, double end, double mark, const std::string& text) {
  std::string rail = absl::StrFormat("<i%s style=\"left:%.1f%%;width:%.1f%%\"></i>",
                                     begin <= 0 && end >= kFull ? " class=full" : "", 100 * begin,
                                     100 * std::max(0.01, end - begin));
  if (mark >= 0) absl::StrAppendFormat(&rail, "<i class=mid style=\"left:%.1f%%\"></i>", 100 * mark);
  return absl::StrFormat("<div class=\"meter %s\"><span>%s</span><em>%s</em><div class=rail>%s</div></div>\n",
                         name, name, text, rail);
}

std::string CameraFigure(const PreviewCamera& camera) {
  const std::string fault = PictureFault(camera);
  const std::string anchor = EscapeHtml("camera-" + camera.id);
  std::string html = absl::StrCat("<figure id=\"", anchor, fault.empty() ? "\">\n" : "\" class=faulty>\n");
  if (!camera.thumbnail.pixels) {
    return absl::StrCat(html, "<div class=\"none bad\">no picture</div><figcaption><b>", NameHtml(camera.id),
                        "</b> <span class=bad>", EscapeHtml(camera.missing),
                        "</span></figcaption></figure>\n");
  }
  absl::StrAppend(&html, "<a href=\"#", anchor, "\" title=\"this camera alone\">",
                  JpegTag(camera.thumbnail, "camera " + camera.id),
                  "</a><figcaption><a class=all href=\"#\">all cameras</a><b>", NameHtml(camera.id), "</b>");
  if (!fault.empty()) absl::StrAppend(&html, " <span class=bad>", fault, "</span>");
  const PictureQuality& quality = camera.quality;
  const double focus = camera.best_focus > 0 ? quality.focus / camera.best_focus : 0;
  absl::StrAppend(
      &html,
      Meter("exposure", quality.low / 255.0, quality.high / 255.0, quality.middle / 255.0,
            absl::StrFormat("%.1f&nbsp;%% <small>white</small>", 100 * quality.clipped_share)),
      Meter("focus", 0, focus, -1, absl::StrFormat("%.0f&nbsp;%% <small>of best</small>", 100 * focus)));
  if (camera.cells >= 0)
    absl::StrAppend(&html, "<div class=meter><span>cells read</span><em>", FormatCount(camera.cells),
                    "</em></div>");
  return html + "</figcaption></figure>\n";
}

std::string Alerts(const PreviewPage& page) {
  std::string items;
  size_t faulty = 0;
  for (const PreviewCamera& camera : page.cameras) {
    const std::string fault = PictureFault(camera);
    if (fault.empty()) continue;
    ++faulty;
    absl::StrAppend(&items, items.empty() ? "" : " &middot; ", "<b>", NameHtml(camera.id), "</b> ",
                    EscapeHtml(fault));
  }
  if (faulty == 0) return "";
  return absl::StrCat("<section class=alerts><p>", faulty, " of ",
                      Counted(static_cast<int64_t>(page.cameras.size()), "camera", "cameras"),
                      " to check: ", items, "</p></section>\n");
}

std::string CoverageHtml(const PreviewCoverage& coverage, size_t cameras) {
  int64_t all = 0;
  for (const int64_t cells : coverage.cells) all += cells;
  const auto share = [&](int64_t cells) {
    return all > 0 ? static_cast<double>(cells) / static_cast<double>(all) : 0.0;
  };
  std::string stack, rows;
  for (size_t i = kCoverageClasses; i-- > 0;) {
    absl::StrAppendFormat(&stack, "<i style=\"background:%s;width:%.2f%%\"></i>", CoverageColor(i),
                          100 * share(coverage.cells[i]));
    absl::StrAppend(&rows, "<tr><td><i class=key style=\"background:", CoverageColor(i), "\"></i>",
                    kCoverageClassNames[i], "<td>", FormatCount(coverage.cells[i]), "<td>",
                    FormatPercent(share(coverage.cells[i])), "\n");
  }
  std::string pictures;
  for (const MeshPicture& picture : coverage.pictures)
    absl::StrAppendFormat(&pictures, "<img alt=\"%s\" width=%d height=%d src=\"data:image/png;base64,%s\">\n",
                          EscapeHtml(picture.title), picture.width_px, picture.height_px,
                          Base64(picture.bytes));
  return absl::StrCat("<section class=coverage><h2>Coverage</h2><div class=share>",
                      FormatPercent(share(coverage.cells[3] + coverage.cells[4])),
                      "</div><div class=soft>of ", FormatCount(all),
                      " cells are read by three cameras or more; ", coverage.cameras, " of ", cameras,
                      " cameras decoded so far</div><div class=stack>", stack, "</div>\n<table>", rows,
                      "</table>\n<div class=pictures>", pictures, "</div></section>\n");
}

}  // namespace

std::string PictureFault(const PreviewCamera& camera) {
  if (!camera.thumbnail.pixels) return absl::StrCat("no picture: ", camera.missing);
  const PictureQuality& quality = camera.quality;
  if (quality.clipped_share > (camera.is_cloth ? kClippedCloth : kClippedPicture)) return "overexposed";
  if (quality.high < kDim) return "too dark";
  if (quality.focus < kFocusFallen * camera.best_focus) return "less sharp than before";
  return "";
}

std::string PreviewHtml(const PreviewPage& page) {
  std::string html = "<!doctype html>\n<html lang=en><meta charset=utf-8>\n";
  if (!page.is_over)
    absl::StrAppendFormat(&html, "<meta http-equiv=refresh content=\"%.1f\">\n", page.refresh_s);
  absl::StrAppend(&html, "<title>", EscapeHtml(page.title), "</title>\n", kStyle, "<body",
                  page.is_over ? " class=over" : "", ">\n<header><h1>", EscapeHtml(page.title),
                  "</h1><span class=chip id=chip>", page.is_over ? "over" : "live", "</span><span>");
  if (page.set) {
    absl::StrAppend(&html, "frame set ", *page.set, ", <span id=time></span>; ", page.passed_over,
                    " skipped since the page before");
  } else {
    absl::StrAppend(&html, "no frame set yet, <span id=time></span>");
  }
  absl::StrAppend(&html, "</span><span>", EscapeHtml(page.state), "</span></header>\n", Alerts(page));
  if (page.coverage)
    absl::StrAppend(&html, "<div class=columns>", CoverageHtml(*page.coverage, page.cameras.size()));
  html += "<main class=cameras>\n";
  for (const PreviewCamera& camera : page.cameras) html += CameraFigure(camera);
  html += "</main>\n";
  if (page.coverage) html += "</div>\n";
  absl::StrAppendFormat(&html, kScript, page.made_unix_ms, 5 + 3 * page.refresh_s,
                        page.is_over ? "true" : "false");
  return html + "</html>\n";
}

}  // namespace weft
