// PLY per frame: the properties of mesh.ply, and those that an export adds.
#include "services/formats/files/mesh_file.h"
#include "services/results/export/sequence_writer.h"

namespace weft {
namespace {

constexpr size_t kHeaderBytes = 2048;

class PlyWriter : public FrameWriter {
 public:
  explicit PlyWriter(const ExportPlan& plan) : plan_(plan) {
    const ExportTopology& topology = plan.source.topology();
    ply_.comments = {"written by weft export; units and axes stand in export.json",
                     "state 0 inferred, 1 observed, 2 by two views, 3 bridged, 4 driven"};
    ply_.elements.resize(2);
    ply_.elements[1] =
        FaceElement(topology.faces, plan.Has(ExportAttribute::kUv) ? topology.texture : MeshTexture{});
  }

  absl::StatusOr<std::string> FileOf(const ExportMesh& mesh) override {
    PlyElement& vertex = ply_.elements[0];
    vertex = {"vertex", mesh.positions.size(), {}};
    AddPlyColumns({"x", "y", "z"}, PlyType::kFloat32, mesh.positions, vertex);
    if (plan_.Has(ExportAttribute::kVelocity))
      AddPlyColumns({"vx", "vy", "vz"}, PlyType::kFloat32, mesh.velocities, vertex);
    if (plan_.Has(ExportAttribute::kState)) Add("state", PlyType::kUint8, mesh.state, vertex);
    if (plan_.Has(ExportAttribute::kSigma)) Add("sigma", PlyType::kFloat32, mesh.sigma, vertex);
    if (plan_.Has(ExportAttribute::kViews)) Add("views", PlyType::kInt32, mesh.views, vertex);
    const ExportTopology& topology = plan_.source.topology();
    if (plan_.Has(ExportAttribute::kCoverage)) Add("coverage", PlyType::kFloat32, topology.coverage, vertex);
    if (plan_.Has(ExportAttribute::kUv)) AddTextureColumns(topology.texture, vertex);
    return SerializePly(ply_);
  }

  uint64_t MaxFileBytes() const override {
    const ExportTopology& topology = plan_.source.topology();
    constexpr uint64_t kVertex = 2 * 12 + 1 + 4 + 4 + 4 + 8, kFace = 1 + 12 + 1 + 24;
    return kHeaderBytes + kVertex * topology.vertices + kFace * topology.faces.size();
  }

 private:
  template <typename Value>
  static void Add(const char* name, PlyType type, const std::vector<Value>& values, PlyElement& vertex) {
    vertex.properties.push_back(PlyColumn(name, type, std::vector<double>(values.begin(), values.end())));
  }

  const ExportPlan& plan_;
  Ply ply_;
};

}  // namespace

std::unique_ptr<FrameWriter> MakePlyWriter(const ExportPlan& plan) {
  return std::make_unique<PlyWriter>(plan);
}

}  // namespace weft
