// Wavefront OBJ per frame: v, vt and f.
#include "services/results/export/number_text.h"
#include "services/results/export/sequence_writer.h"
#include "services/results/export/split_vertices.h"

namespace weft {
namespace {

constexpr char kObjHeader[] = "# written by weft export; units and axes stand in export.json\no garment\n";

class ObjWriter : public FrameWriter {
 public:
  explicit ObjWriter(const ExportPlan& plan) : vertices_(plan.source.topology().vertices) {
    const ExportTopology& topology = plan.source.topology();
    const bool has_uv = plan.Has(ExportAttribute::kUv) && !topology.texture.empty();
    const SplitMesh split =
        SplitAtSeams(vertices_, topology.faces, has_uv ? topology.texture : MeshTexture{});
    for (const Eigen::Vector2f& uv : split.uv) {
      tail_ += "vt ";
      AppendNumber(tail_, uv.x());
      tail_ += ' ';
      AppendNumber(tail_, uv.y());
      tail_ += '\n';
    }
    for (size_t f = 0; f < topology.faces.size(); ++f) {
      tail_ += 'f';
      for (size_t k = 0; k < topology.faces[f].size(); ++k) {
        tail_ += ' ';
        AppendNumber(tail_, topology.faces[f][k] + 1);
        if (!has_uv) continue;
        tail_ += '/';
        AppendNumber(tail_, split.faces[f][k] + 1);
      }
      tail_ += '\n';
    }
  }

  absl::StatusOr<std::string> FileOf(const ExportMesh& mesh) override {
    std::string file = kObjHeader;
    file.reserve(MaxFileBytes());
    for (const Eigen::Vector3f& position : mesh.positions) {
      file += 'v';
      for (const float coordinate : position) {
        file += ' ';
        AppendNumber(file, coordinate);
      }
      file += '\n';
    }
    file += tail_;
    return file;
  }

  uint64_t MaxFileBytes() const override {
    return sizeof kObjHeader + vertices_ * (2 + 3 * (1 + kLongestFloat)) + tail_.size();
  }

 private:
  size_t vertices_;
  std::string tail_;  // what all frames have in common
};

}  // namespace

std::unique_ptr<FrameWriter> MakeObjWriter(const ExportPlan& plan) {
  return std::make_unique<ObjWriter>(plan);
}

}  // namespace weft
