#include "services/results/report/svg_file.h"

#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"

namespace weft {
namespace {

// As in report.css, light.
constexpr char kStyle[] =
    "text{font-family:system-ui,'DejaVu Sans',sans-serif;fill:#1c2024;font-size:12px}"
    ".title{font-size:14px;font-weight:600}.tick{font-size:11px;fill:#5b636c}.grid{stroke:#e0e1de}"
    ".lost{fill:#b3261e}.series{fill:none;stroke-width:1.8}"
    ".s0{stroke:#0072b2}.s1{stroke:#d55e00;stroke-dasharray:6 3}.s2{stroke:#009e73;stroke-dasharray:2 3}"
    ".s3{stroke:#cc79a7;stroke-dasharray:8 3 2 3}"
    ".m0{fill:#0072b2}.m1{fill:#d55e00}.m2{fill:#009e73}.m3{fill:#cc79a7}";
constexpr double kTitleHeight = 26;

}  // namespace

std::string SvgFile(double width, double height, const std::string& title, const std::string& body) {
  return absl::StrFormat(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" "
      "height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" role=\"img\">\n<title>%s</title>\n<style>%s</style>\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"#ffffff\"/>\n<text class=\"title\" x=\"10\" "
      "y=\"19\">%s</text>\n<g transform=\"translate(0 %.0f)\">%s</g>\n</svg>\n",
      width, height + kTitleHeight, width, height + kTitleHeight, EscapeHtml(title), kStyle,
      EscapeHtml(title), kTitleHeight, body);
}

}  // namespace weft
