#include "services/results/report/sequence_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/results/report/picture_data.h"

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

void AddColor(const Eigen::Vector3f& color, std::string& palette) {
  for (const float c : color) palette += static_cast<char>(std::lround(255 * std::clamp(c, 0.0f, 1.0f)));
}

}  // namespace

v1::PageSequence::Coloring ColoringByState() {
  const std::vector<VertexState> states = {VertexState::kObserved, VertexState::kTwoView,
                                           VertexState::kInferred, VertexState::kBridged,
                                           VertexState::kDriven};
  v1::PageSequence::Coloring coloring;
  coloring.set_name("state");
  *coloring.mutable_key() = StateKey(states);
  for (int i = 0; i <= kNoValue; ++i) {
    const bool is_state = std::ranges::find(states, static_cast<VertexState>(i)) != states.end();
    AddColor(is_state ? StateColor(static_cast<VertexState>(i)) : UnknownColor(),
             *coloring.mutable_palette());
  }
  return coloring;
}

v1::PageSequence::Coloring ColoringByValue(const std::string& name, const std::string& label,
                                           const std::string& unit, const ScalarRange& range) {
  v1::PageSequence::Coloring coloring;
  coloring.set_name(name);
  *coloring.mutable_key() = ScaleKey(range, label, unit);
  for (int i = 0; i < kNoValue; ++i) AddColor(MapColor(i / 254.0), *coloring.mutable_palette());
  AddColor(UnknownColor(), *coloring.mutable_palette());
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

v1::PageSequence BeginSequence(const DecimatedMesh& mesh, const Viewpoint& viewpoint) {
  v1::PageSequence sequence;
  sequence.set_vertices(static_cast<int>(mesh.vertices.size()));
  std::vector<uint16_t> faces;
  for (const Face& face : mesh.faces)
    for (const int v : face) faces.push_back(static_cast<uint16_t>(v));
  sequence.set_faces(BytesOf(faces));
  sequence.mutable_right()->Assign(viewpoint.right.begin(), viewpoint.right.end());
  sequence.mutable_up()->Assign(viewpoint.up.begin(), viewpoint.up.end());
  return sequence;
}

void AddFrame(const SequenceFrame& frame, v1::PageSequence& sequence) {
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
    sequence.set_radius_mm(std::max(sequence.radius_mm(), (p.cast<double>() - mean).norm()));
  }
  std::string bytes = BytesOf(positions);
  for (const std::vector<uint8_t>& colors : frame.color_bytes) bytes += BytesOf(colors);
  v1::PageSequence::Frame& added = *sequence.add_frames();
  added.set_name(frame.name);
  added.set_note(frame.note);
  // The centre is told from the low corner, so that the page never needs large numbers.
  for (const double mm : Eigen::Vector3d(mean - low)) added.add_center_mm(mm);
  added.set_step_mm(step);
  added.set_bytes(std::move(bytes));
}

}  // namespace weft
