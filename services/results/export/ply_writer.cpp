// PLY per frame: the properties of mesh.ply, and those that an export adds.
#include <utility>

#include "services/formats/files/ply.h"
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
    PlyElement& face = ply_.elements[1];
    face.name = "face";
    face.rows = topology.faces.size();
    PlyProperty indices = List("vertex_indices", PlyType::kInt32);
    for (const Face& corners : topology.faces) {
      for (const int v : corners) indices.values.push_back(v);
      indices.list_start.push_back(indices.values.size());
    }
    face.properties.push_back(std::move(indices));
    if (!plan.Has(ExportAttribute::kUv) || topology.texture.of_corner.empty()) return;
    PlyProperty uv = List("texcoord", PlyType::kFloat32);
    for (const auto& corners : topology.texture.of_corner) {
      for (const Eigen::Vector2f& place : corners) uv.values.insert(uv.values.end(), {place.x(), place.y()});
      uv.list_start.push_back(uv.values.size());
    }
    face.properties.push_back(std::move(uv));
  }

  absl::StatusOr<std::string> FileOf(const ExportMesh& mesh) override {
    PlyElement& vertex = ply_.elements[0];
    vertex = {"vertex", mesh.positions.size(), {}};
    AddVectors({"x", "y", "z"}, mesh.positions, vertex);
    if (plan_.Has(ExportAttribute::kVelocity)) AddVectors({"vx", "vy", "vz"}, mesh.velocities, vertex);
    if (plan_.Has(ExportAttribute::kState)) Add("state", PlyType::kUint8, mesh.state, vertex);
    if (plan_.Has(ExportAttribute::kSigma)) Add("sigma", PlyType::kFloat32, mesh.sigma, vertex);
    if (plan_.Has(ExportAttribute::kViews)) Add("views", PlyType::kInt32, mesh.views, vertex);
    const ExportTopology& topology = plan_.source.topology();
    if (plan_.Has(ExportAttribute::kCoverage)) Add("coverage", PlyType::kFloat32, topology.coverage, vertex);
    if (plan_.Has(ExportAttribute::kUv) && !topology.texture.empty()) {
      for (int axis = 0; axis < 2; ++axis) {
        std::vector<double> values;
        for (const Eigen::Vector2f& place : topology.texture.of_vertex) values.push_back(place[axis]);
        vertex.properties.push_back(PlyColumn(axis == 0 ? "s" : "t", PlyType::kFloat32, std::move(values)));
      }
    }
    return SerializePly(ply_);
  }

  uint64_t MaxFileBytes() const override {
    const ExportTopology& topology = plan_.source.topology();
    constexpr uint64_t kVertex = 2 * 12 + 1 + 4 + 4 + 4 + 8, kFace = 1 + 12 + 1 + 24;
    return kHeaderBytes + kVertex * topology.vertices + kFace * topology.faces.size();
  }

 private:
  static PlyProperty List(const char* name, PlyType type) {
    PlyProperty list = PlyColumn(name, type, {});
    list.is_list = true;
    list.list_start.push_back(0);
    return list;
  }
  template <typename Value>
  static void Add(const char* name, PlyType type, const std::vector<Value>& values, PlyElement& vertex) {
    vertex.properties.push_back(PlyColumn(name, type, std::vector<double>(values.begin(), values.end())));
  }
  static void AddVectors(const std::array<const char*, 3>& names, const std::vector<Eigen::Vector3f>& vectors,
                         PlyElement& vertex) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      values.reserve(vectors.size());
      for (const Eigen::Vector3f& vector : vectors) values.push_back(vector[axis]);
      vertex.properties.push_back(PlyColumn(names[axis], PlyType::kFloat32, std::move(values)));
    }
  }

  const ExportPlan& plan_;
  Ply ply_;
};

}  // namespace

std::unique_ptr<FrameWriter> MakePlyWriter(const ExportPlan& plan) {
  return std::make_unique<PlyWriter>(plan);
}

}  // namespace weft
