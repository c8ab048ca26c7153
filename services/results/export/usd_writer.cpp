// USD as text: one Mesh, attributes as time samples. USD keeps all samples of an attribute together, so each
// attribute is a pass over the frames.
#include "absl/strings/str_cat.h"
#include "services/results/export/number_text.h"
#include "services/results/export/sequence_writer.h"

namespace weft {
namespace {

// "(x, y, z)" or "(u, v)".
template <typename Vector>
void AppendTuple(std::string& text, const Vector& vector) {
  text += '(';
  for (int axis = 0; axis < vector.size(); ++axis) {
    if (axis > 0) text += ", ";
    AppendNumber(text, vector[axis]);
  }
  text += ')';
}

void AppendItem(std::string& text, float value) { AppendNumber(text, value); }
void AppendItem(std::string& text, int value) { AppendNumber(text, value); }
void AppendItem(std::string& text, uint8_t value) { AppendNumber(text, static_cast<int>(value)); }
template <int kSize>
void AppendItem(std::string& text, const Eigen::Matrix<float, kSize, 1>& value) {
  AppendTuple(text, value);
}

template <typename Items>
void AppendItems(std::string& text, const Items& items) {
  text += '[';
  bool is_first = true;
  for (const auto& item : items) {
    if (!is_first) text += ", ";
    is_first = false;
    AppendItem(text, item);
  }
  text += ']';
}

// An attribute with time samples.
struct UsdAttribute {
  const char* declaration;
  size_t longest;  // of an item, as text
  bool is_primvar;
  bool is_velocity;
  void (*append)(std::string& text, const ExportMesh& mesh);
};

constexpr size_t kLongestTuple = 3 * kLongestFloat + 6;  // with "(, , )"

constexpr UsdAttribute kPoints = {
    "point3f[] points", kLongestTuple, false, false,
    [](std::string& text, const ExportMesh& mesh) { AppendItems(text, mesh.positions); }};
constexpr UsdAttribute kVelocities = {
    "vector3f[] velocities", kLongestTuple, false, true,
    [](std::string& text, const ExportMesh& mesh) { AppendItems(text, mesh.velocities); }};
constexpr UsdAttribute kStates = {
    "int[] primvars:state", 1, true, false,
    [](std::string& text, const ExportMesh& mesh) { AppendItems(text, mesh.state); }};
constexpr UsdAttribute kSigmas = {
    "float[] primvars:sigma", kLongestFloat, true, false,
    [](std::string& text, const ExportMesh& mesh) { AppendItems(text, mesh.sigma); }};
constexpr UsdAttribute kViewCounts = {
    "int[] primvars:views", 4, true, false,
    [](std::string& text, const ExportMesh& mesh) { AppendItems(text, mesh.views); }};

class UsdWriter : public SequenceWriter {
 public:
  explicit UsdWriter(const ExportPlan& plan) : plan_(plan), attributes_({kPoints}) {
    if (plan.Has(ExportAttribute::kVelocity)) attributes_.push_back(kVelocities);
    if (plan.Has(ExportAttribute::kState)) attributes_.push_back(kStates);
    if (plan.Has(ExportAttribute::kSigma)) attributes_.push_back(kSigmas);
    if (plan.Has(ExportAttribute::kViews)) attributes_.push_back(kViewCounts);
  }

  int passes() const override { return static_cast<int>(attributes_.size()); }
  bool NeedsVelocities(int pass) const override { return attributes_[pass].is_velocity; }

  absl::Status Begin(ExportStream& out) override {
    out.Append(Head());
    return out.status();
  }

  absl::Status Add(int pass, size_t sample, const ExportMesh& mesh, ExportStream& out) override {
    const UsdAttribute& attribute = attributes_[pass];
    std::string text;
    text.reserve(mesh.positions.size() * attribute.longest / 2);
    if (sample == 0) {
      // With a value of its own, the first frame's: three.js reads no declaration that has none.
      if (attribute.is_primvar) {
        absl::StrAppend(&text, "    ", attribute.declaration, " = ");
        attribute.append(text, mesh);
        text += " (\n        interpolation = \"vertex\"\n    )\n";
      }
      absl::StrAppend(&text, "    ", attribute.declaration, ".timeSamples = {\n");
    }
    absl::StrAppend(&text, "        ", plan_.samples[sample].index, ": ");
    attribute.append(text, mesh);
    text += ",\n";
    if (sample + 1 == plan_.samples.size()) text += "    }\n";
    out.Append(text);
    return out.status();
  }

  absl::Status Finish(ExportStream& out) override {
    out.Append("}\n");
    return out.status();
  }

  uint64_t MaxFileBytes() const override {
    uint64_t per_vertex = 0;
    for (const UsdAttribute& attribute : attributes_) per_vertex += attribute.longest + 2;
    const ExportTopology& topology = plan_.source.topology();
    constexpr uint64_t kFaceBytes = 3 + 3 * 12 + 3 * (2 * kLongestFloat + 6);
    return 4096 + (plan_.samples.size() + 1) * (per_vertex * topology.vertices + 64 * attributes_.size()) +
           topology.faces.size() * kFaceBytes + topology.vertices * (kLongestFloat + 2);
  }

 private:
  std::string Head() const {
    const ExportTransform& transform = plan_.source.transform();
    std::string text = "#usda 1.0\n(\n    defaultPrim = \"garment\"\n    doc = \"written by weft export\"\n";
    absl::StrAppend(&text, "    startTimeCode = ", plan_.samples.front().index,
                    "\n    endTimeCode = ", plan_.samples.back().index, "\n    metersPerUnit = ");
    AppendNumber(text, 1e-3 / transform.unit_per_mm);
    for (const char* rate : {"framesPerSecond", "timeCodesPerSecond"}) {
      absl::StrAppend(&text, "\n    ", rate, " = ");
      AppendNumber(text, plan_.source.fps());
    }
    absl::StrAppend(&text, "\n    upAxis = \"", transform.up == UpAxis::kY ? "Y" : "Z", "\"\n)\n\n",
                    "def Mesh \"garment\"\n{\n");
    const ExportTopology& topology = plan_.source.topology();
    text +=
        "    uniform token subdivisionScheme = \"none\"\n    uniform bool doubleSided = 1\n    float3[] "
        "extent = ";
    AppendItems(text,
                std::array{Eigen::Vector3f(topology.bounds.min()), Eigen::Vector3f(topology.bounds.max())});
    text += "\n    int[] faceVertexCounts = ";
    AppendItems(text, std::vector<int>(topology.faces.size(), 3));
    text += "\n    int[] faceVertexIndices = ";
    std::vector<int> indices;
    for (const Face& face : topology.faces) indices.insert(indices.end(), face.begin(), face.end());
    AppendItems(text, indices);
    text += '\n';
    if (plan_.Has(ExportAttribute::kUv) && !topology.texture.empty()) {
      text += "    texCoord2f[] primvars:st = ";
      AppendItems(text, CornersUv(topology));
      text += " (\n        interpolation = \"faceVarying\"\n    )\n";
    }
    if (plan_.Has(ExportAttribute::kCoverage)) {
      text += "    float[] primvars:coverage = ";
      AppendItems(text, topology.coverage);
      text += " (\n        interpolation = \"vertex\"\n    )\n";
    }
    return text;
  }

  static std::vector<Eigen::Vector2f> CornersUv(const ExportTopology& topology) {
    std::vector<Eigen::Vector2f> uv;
    for (size_t f = 0; f < topology.faces.size(); ++f)
      for (int k = 0; k < 3; ++k)
        uv.push_back(topology.texture.of_corner.empty() ? topology.texture.of_vertex[topology.faces[f][k]]
                                                        : topology.texture.of_corner[f][k]);
    return uv;
  }

  const ExportPlan& plan_;
  std::vector<UsdAttribute> attributes_;
};

}  // namespace

std::unique_ptr<SequenceWriter> MakeUsdWriter(const ExportPlan& plan) {
  return std::make_unique<UsdWriter>(plan);
}

}  // namespace weft
