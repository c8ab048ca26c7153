#include "services/results/report/sequence_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"
#include "services/results/report/picture_data.h"
#include "services/results/report/picture_html.h"
#include "services/results/report/sequence_script.h"

namespace weft {
namespace {

constexpr size_t kMaxFrames = 300;
// Base64 takes a third more: 24 MB of a page. Browsers read some 30 MB a second, and a page is to open in
// less than 2 s; on a garment of 1 m2 in 300 frames vertices are 11 mm apart.
constexpr size_t kMaxBytes = 18'000'000;
constexpr size_t kMostVertices = 16'000;
constexpr size_t kPositionBytes = 3 * sizeof(uint16_t);
constexpr uint8_t kNoValue = 255;

template <typename T>
std::string BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string Numbers(const Eigen::Vector3d& v) {
  return absl::StrFormat("%.9g %.9g %.9g", v.x(), v.y(), v.z());
}

std::string PaletteBytes(const std::array<Eigen::Vector3f, 256>& palette) {
  std::vector<uint8_t> bytes;
  for (const Eigen::Vector3f& color : palette)
    for (const float c : color)
      bytes.push_back(static_cast<uint8_t>(std::lround(255 * std::clamp(c, 0.0f, 1.0f))));
  return BytesOf(bytes);
}

// As pages show it that are made in C++.
std::string LegendHtml(const v1::PageKey& key) {
  if (key.has_scale())
    return ColorBar({key.scale().low(), key.scale().high()}, key.scale().label(), key.scale().unit());
  std::string html = "<ul class=\"legend\">";
  for (const v1::PageKey::Entry& entry : key.entries())
    absl::StrAppend(&html, "<li><i style=\"background:", entry.color(), "\"></i>", entry.meaning(), "</li>");
  return html + "</ul>";
}

}  // namespace

SequenceColoring ColoringByState() {
  const std::vector<VertexState> states = {VertexState::kObserved, VertexState::kTwoView,
                                           VertexState::kInferred, VertexState::kBridged,
                                           VertexState::kDriven};
  SequenceColoring coloring{"state", StateKey(states), {}, false};
  coloring.palette.fill(UnknownColor());
  for (const VertexState state : states) coloring.palette[static_cast<size_t>(state)] = StateColor(state);
  return coloring;
}

SequenceColoring ColoringByValue(const std::string& name, const std::string& label, const std::string& unit,
                                 const ScalarRange& range) {
  SequenceColoring coloring{name, ScaleKey(range, label, unit), {}, false};
  for (int i = 0; i < kNoValue; ++i) coloring.palette[i] = MapColor(i / 254.0);
  coloring.palette[kNoValue] = UnknownColor();
  return coloring;
}

uint8_t PaletteIndex(double value, const ScalarRange& range) {
  if (!std::isfinite(value)) return kNoValue;
  const double extent = range.high > range.low ? range.high - range.low : 1;
  return static_cast<uint8_t>(std::lround(254 * std::clamp((value - range.low) / extent, 0.0, 1.0)));
}

size_t SequenceVertices(size_t frames, size_t colorings) {
  const size_t shown = std::clamp<size_t>(frames, 1, kMaxFrames);
  return std::min(kMostVertices, kMaxBytes / (shown * (kPositionBytes + colorings)));
}

std::vector<size_t> SequenceFrames(size_t frames) {
  std::vector<size_t> shown;
  if (frames <= kMaxFrames) {
    for (size_t i = 0; i < frames; ++i) shown.push_back(i);
    return shown;
  }
  for (size_t i = 0; i < kMaxFrames; ++i) shown.push_back(i * (frames - 1) / (kMaxFrames - 1));
  return shown;
}

PageProgram SequenceProgram(const SequenceView& sequence) { return {kSequenceScript, sequence.Data()}; }

std::string SequenceView::FaceBytes() const {
  std::vector<uint16_t> faces;
  for (const Face& face : mesh_.faces)
    for (const int v : face) faces.push_back(static_cast<uint16_t>(v));
  return BytesOf(faces);
}

v1::PageSequence SequenceView::Take() && {
  page_.set_vertices(static_cast<int>(mesh_.vertices.size()));
  page_.set_faces(FaceBytes());
  for (const SequenceColoring& coloring : colorings_) {
    v1::PageSequence::Coloring& added = *page_.add_colorings();
    added.set_name(coloring.name);
    *added.mutable_key() = coloring.key;
    added.set_palette(PaletteBytes(coloring.palette));
    added.set_first_shown(coloring.is_first_shown);
  }
  for (const SequencePart& part : parts_) {
    v1::PageSequence::Part& added = *page_.add_parts();
    added.set_name(part.name);
    added.set_faces(static_cast<int>(part.faces));
  }
  for (int axis = 0; axis < 3; ++axis) {
    page_.add_right(viewpoint_.right[axis]);
    page_.add_up(viewpoint_.up[axis]);
  }
  page_.set_fps(fps_);
  return std::move(page_);
}

std::string SequenceView::Data() const {
  std::string data = absl::StrCat("<script type=\"text/plain\" class=\"sequence-faces\">",
                                  Base64(FaceBytes()), "</script>\n");
  for (const v1::PageSequence::Frame& frame : page_.frames())
    absl::StrAppend(&data, "<script type=\"text/plain\" class=\"sequence-frame\" data-name=\"",
                    EscapeHtml(frame.name()), "\" data-note=\"", EscapeHtml(frame.note()),
                    "\" data-center=\"",
                    Numbers({frame.center_mm(0), frame.center_mm(1), frame.center_mm(2)}), "\" data-step=\"",
                    absl::StrFormat("%.9g", frame.step_mm()), "\">", Base64(frame.bytes()), "</script>\n");
  return data;
}

SequenceView::SequenceView(DecimatedMesh mesh, std::vector<SequenceColoring> colorings,
                           const Viewpoint& viewpoint, double fps)
    : mesh_(std::move(mesh)), colorings_(std::move(colorings)), viewpoint_(viewpoint), fps_(fps) {}

void SequenceView::Add(const SequenceFrame& frame) {
  if (frame.vertices_mm.empty()) return;
  Eigen::Vector3d low = frame.vertices_mm[0].cast<double>(), high = low, mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : frame.vertices_mm) {
    low = low.cwiseMin(p.cast<double>()), high = high.cwiseMax(p.cast<double>());
    mean += p.cast<double>() / static_cast<double>(frame.vertices_mm.size());
  }
  const double longest = (high - low).maxCoeff(), step = longest > 0 ? longest / 65535 : 1;
  std::vector<uint16_t> positions;
  positions.reserve(3 * frame.vertices_mm.size());
  for (const Eigen::Vector3f& p : frame.vertices_mm) {
    const Eigen::Vector3d steps = (p.cast<double>() - low) / step;
    for (const double s : steps) positions.push_back(static_cast<uint16_t>(std::lround(s)));
    page_.set_radius_mm(std::max(page_.radius_mm(), (p.cast<double>() - mean).norm()));
  }
  std::string bytes = BytesOf(positions);
  for (const std::vector<uint8_t>& colors : frame.color_bytes) bytes += BytesOf(colors);
  v1::PageSequence::Frame& added = *page_.add_frames();
  added.set_name(frame.name);
  added.set_note(frame.note);
  // The centre is told from the low corner, so that the page never needs large numbers.
  for (const double mm : Eigen::Vector3d(mean - low)) added.add_center_mm(mm);
  added.set_step_mm(step);
  added.set_bytes(std::move(bytes));
  ++frames_;
}

std::string SequenceView::Section(const MeshPicture& still, const std::string& about) const {
  if (frames_ == 0) return "";
  std::string options, legends;
  for (const SequenceColoring& coloring : colorings_) {
    absl::StrAppend(&options, "<option", coloring.is_first_shown ? " selected" : "", " data-palette=\"",
                    Base64(PaletteBytes(coloring.palette)), "\">", EscapeHtml(coloring.name), "</option>");
    absl::StrAppend(&legends, "<div class=\"key\">", LegendHtml(coloring.key), "</div>\n");
  }
  std::string parts;
  size_t first_face = 0;
  for (const SequencePart& part : parts_) {
    absl::StrAppend(&parts, "<option data-first=\"", first_face, "\" data-faces=\"", part.faces, "\">",
                    EscapeHtml(part.name), "</option>");
    first_face += part.faces;
  }
  if (!parts.empty())
    parts = absl::StrCat("<label>Garments <select class=\"parts\"><option>all</option>", parts,
                         "</select></label>");
  const std::string head = absl::StrFormat(
      "<div class=\"sequence\" data-vertices=\"%d\" data-right=\"%s\" data-up=\"%s\" data-radius=\"%.9g\" "
      "data-fps=\"%g\">\n",
      mesh_.vertices.size(), Numbers(viewpoint_.right), Numbers(viewpoint_.up), page_.radius_mm(), fps_);
  const std::string controls = absl::StrFormat(
      "<div class=\"controls\"><button type=\"button\">Play</button><label>Frame <input type=\"range\" "
      "min=\"0\" max=\"%d\" value=\"0\"></label><output></output><label>Colours "
      "<select class=\"colors\">%s<option>cloth</option></select></label>%s</div>\n",
      frames_ - 1, options, parts);
  const std::string picture =
      still.bytes.empty()
          ? ""
          : absl::StrFormat(
                "<figure class=\"still\"><img width=\"%d\" height=\"%d\" alt=\"the sequence\" "
                "src=\"data:%s;base64,%s\"><figcaption>%s</figcaption></figure>\n",
                still.width_px, still.height_px, still.type, Base64(still.bytes), EscapeHtml(still.title));
  return weft::Section(
      "sequence", "In three dimensions",
      absl::StrCat(head, controls, legends,
                   "<canvas tabindex=\"0\" role=\"img\" aria-label=\"the garment in three dimensions; arrow "
                   "keys turn it, plus and minus zoom\"></canvas>\n",
                   picture,
                   "<p class=\"hint\">Drag to turn, with shift to move; wheel to zoom; double click ",
                   "to return.</p>\n<p>", about, "</p>\n</div>\n"));
}

}  // namespace weft
