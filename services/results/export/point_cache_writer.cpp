// Point caches: MDD of LightWave (big-endian, with times) and PC2 of Maya and 3ds Max (little-endian).
#include <bit>

#include "services/results/export/sequence_writer.h"

namespace weft {
namespace {

static_assert(std::endian::native == std::endian::little);

// The bytes of a value of 32 bits, the most significant first.
template <typename Value>
void AppendBigEndian(std::string& bytes, Value value) {
  static_assert(sizeof value == sizeof(uint32_t));
  const uint32_t swapped = __builtin_bswap32(std::bit_cast<uint32_t>(value));
  bytes.append(reinterpret_cast<const char*>(&swapped), sizeof swapped);
}

uint64_t PointBytes(const ExportPlan& plan) {
  return sizeof(Eigen::Vector3f) * plan.source.topology().vertices * plan.samples.size();
}

class MddWriter : public SequenceWriter {
 public:
  explicit MddWriter(const ExportPlan& plan) : plan_(plan) {}

  absl::Status Begin(ExportStream& out) override {
    std::string header;
    AppendBigEndian(header, static_cast<int32_t>(plan_.samples.size()));
    AppendBigEndian(header, static_cast<int32_t>(plan_.source.topology().vertices));
    for (const ExportSample& sample : plan_.samples)
      AppendBigEndian(header, static_cast<float>(sample.time_s));
    out.Append(header);
    return out.status();
  }
  absl::Status Add(int, size_t, const ExportMesh& mesh, ExportStream& out) override {
    std::string bytes;
    bytes.reserve(sizeof(Eigen::Vector3f) * mesh.positions.size());
    for (const Eigen::Vector3f& position : mesh.positions)
      for (const float coordinate : position) AppendBigEndian(bytes, coordinate);
    out.Append(bytes);
    return out.status();
  }
  absl::Status Finish(ExportStream& out) override { return out.status(); }
  uint64_t MaxFileBytes() const override {
    return 2 * sizeof(int32_t) + sizeof(float) * plan_.samples.size() + PointBytes(plan_);
  }

 private:
  const ExportPlan& plan_;
};

struct Pc2Header {
  char magic[12] = {'P', 'O', 'I', 'N', 'T', 'C', 'A', 'C', 'H', 'E', '2', '\0'};
  int32_t version = 1;
  int32_t points = 0;
  float first_frame = 0;
  float sample_rate = 1;  // samples per frame
  int32_t samples = 0;
};
static_assert(sizeof(Pc2Header) == 32);

class Pc2Writer : public SequenceWriter {
 public:
  explicit Pc2Writer(const ExportPlan& plan) : plan_(plan) {}

  absl::Status Begin(ExportStream& out) override {
    Pc2Header header;
    header.points = static_cast<int32_t>(plan_.source.topology().vertices);
    header.samples = static_cast<int32_t>(plan_.samples.size());
    out.AppendValues(&header, 1);
    return out.status();
  }
  absl::Status Add(int, size_t, const ExportMesh& mesh, ExportStream& out) override {
    out.AppendValues(mesh.positions.data(), mesh.positions.size());
    return out.status();
  }
  absl::Status Finish(ExportStream& out) override { return out.status(); }
  uint64_t MaxFileBytes() const override { return sizeof(Pc2Header) + PointBytes(plan_); }

 private:
  const ExportPlan& plan_;
};

}  // namespace

std::unique_ptr<SequenceWriter> MakeMddWriter(const ExportPlan& plan) {
  return std::make_unique<MddWriter>(plan);
}
std::unique_ptr<SequenceWriter> MakePc2Writer(const ExportPlan& plan) {
  return std::make_unique<Pc2Writer>(plan);
}

}  // namespace weft
