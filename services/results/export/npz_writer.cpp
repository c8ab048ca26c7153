// NumPy arrays in an uncompressed zip archive. Written by hand, since libarchive cannot go on with an archive
// that was interrupted, and the sizes of all members are known.
#include <zlib.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "services/results/export/sequence_writer.h"

namespace weft {
namespace {

template <typename Value>
void AppendRaw(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// The header of a .npy file, version 1.0. `type` as NumPy writes it, e.g. "<f4".
std::string NpyHeader(const std::string& type, const std::vector<size_t>& shape) {
  std::string dict = absl::StrCat("{'descr': '", type, "', 'fortran_order': False, 'shape': (",
                                  absl::StrJoin(shape, ", "), shape.size() == 1 ? ",), }" : "), }");
  constexpr size_t kPrefix = 10, kAlignment = 64;
  while ((kPrefix + dict.size() + 1) % kAlignment != 0) dict += ' ';
  dict += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  AppendRaw(header, static_cast<uint16_t>(dict.size()));
  return header + dict;
}

template <typename Value>
std::string BytesOf(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

struct NpzArray {
  std::string name;
  std::string type;
  std::vector<size_t> shape;
  size_t item_bytes = 0;
  std::string values;                                 // of arrays that do not depend on the frame
  std::function<std::string(const ExportMesh&)> row;  // of the others: what a frame adds
  bool is_velocity = false;

  uint64_t Bytes() const {
    uint64_t bytes = item_bytes;
    for (const size_t extent : shape) bytes *= extent;
    return NpyHeader(type, shape).size() + bytes;
  }
};

// A member of the archive, always with the sizes of 64 bits.
class ZipMember {
 public:
  ZipMember(std::string name, uint64_t bytes, uint64_t offset)
      : name_(std::move(name)), bytes_(bytes), offset_(offset) {}

  static constexpr size_t kCrcOffset = 14;
  uint64_t HeaderBytes() const { return 30 + name_.size() + 20; }
  uint64_t offset() const { return offset_; }
  uint64_t end() const { return offset_ + HeaderBytes() + bytes_; }

  std::string LocalHeader() const {
    std::string header;
    AppendRaw(header, uint32_t{0x04034b50});
    AppendCommon(header, 0);
    AppendRaw(header, uint16_t{20});  // of the extra field
    header += name_;
    AppendRaw(header, uint16_t{1});  // zip64
    AppendRaw(header, uint16_t{16});
    AppendRaw(header, bytes_);
    AppendRaw(header, bytes_);
    return header;
  }
  std::string CentralHeader(uint32_t crc) const {
    std::string header;
    AppendRaw(header, uint32_t{0x02014b50});
    AppendRaw(header, uint16_t{45});  // made by this version of zip
    AppendCommon(header, crc);
    AppendRaw(header, uint16_t{28});
    header.append(2 + 2 + 2 + 4, '\0');       // comment, disk, attributes
    AppendRaw(header, uint32_t{0xffffffff});  // the offset is in the extra field
    header += name_;
    AppendRaw(header, uint16_t{1});
    AppendRaw(header, uint16_t{24});
    AppendRaw(header, bytes_);
    AppendRaw(header, bytes_);
    AppendRaw(header, offset_);
    return header;
  }

 private:
  // From the version that is needed up to the length of the name.
  void AppendCommon(std::string& header, uint32_t crc) const {
    AppendRaw(header, uint16_t{45});
    AppendRaw(header, uint16_t{0});  // flags
    AppendRaw(header, uint16_t{0});  // stored
    AppendRaw(header, uint16_t{0});
    AppendRaw(header, uint16_t{0x21});  // 1980-01-01, so that the same input gives the same bytes
    AppendRaw(header, crc);
    AppendRaw(header, uint32_t{0xffffffff});
    AppendRaw(header, uint32_t{0xffffffff});
    AppendRaw(header, static_cast<uint16_t>(name_.size()));
  }

  std::string name_;
  uint64_t bytes_, offset_;
};

std::string ZipEnd(size_t members, uint64_t directory_offset, uint64_t directory_bytes) {
  std::string end;
  AppendRaw(end, uint32_t{0x06064b50});  // zip64 end of central directory
  AppendRaw(end, uint64_t{44});
  AppendRaw(end, uint16_t{45});
  AppendRaw(end, uint16_t{45});
  AppendRaw(end, uint32_t{0});
  AppendRaw(end, uint32_t{0});
  AppendRaw(end, uint64_t{members});
  AppendRaw(end, uint64_t{members});
  AppendRaw(end, directory_bytes);
  AppendRaw(end, directory_offset);
  AppendRaw(end, uint32_t{0x07064b50});  // its locator
  AppendRaw(end, uint32_t{0});
  AppendRaw(end, directory_offset + directory_bytes);
  AppendRaw(end, uint32_t{1});
  AppendRaw(end, uint32_t{0x06054b50});
  AppendRaw(end, uint32_t{0});
  AppendRaw(end, static_cast<uint16_t>(members));
  AppendRaw(end, static_cast<uint16_t>(members));
  AppendRaw(end, uint32_t{0xffffffff});
  AppendRaw(end, uint32_t{0xffffffff});
  AppendRaw(end, uint16_t{0});
  return end;
}

class NpzWriter : public SequenceWriter {
 public:
  explicit NpzWriter(const ExportPlan& plan) {
    AddConstants(plan);
    first_row_ = arrays_.size();
    const size_t frames = plan.samples.size(), vertices = plan.source.topology().vertices;
    const auto add = [&](const char* name, const char* type, std::vector<size_t> shape, size_t bytes,
                         auto row) {
      arrays_.push_back({name, type, std::move(shape), bytes, "", row, false});
    };
    add("positions", "<f4", {frames, vertices, 3}, 4,
        [](const ExportMesh& mesh) { return BytesOf(mesh.positions); });
    if (plan.Has(ExportAttribute::kVelocity)) {
      add("velocities", "<f4", {frames, vertices, 3}, 4,
          [](const ExportMesh& mesh) { return BytesOf(mesh.velocities); });
      arrays_.back().is_velocity = true;
    }
    if (plan.Has(ExportAttribute::kState))
      add("state", "|u1", {frames, vertices}, 1, [](const ExportMesh& mesh) { return BytesOf(mesh.state); });
    if (plan.Has(ExportAttribute::kSigma))
      add("sigma", "<f4", {frames, vertices}, 4, [](const ExportMesh& mesh) { return BytesOf(mesh.sigma); });
    if (plan.Has(ExportAttribute::kViews))
      add("views", "<i4", {frames, vertices}, 4, [](const ExportMesh& mesh) { return BytesOf(mesh.views); });
    uint64_t offset = 0;
    for (const NpzArray& array : arrays_) {
      members_.emplace_back(array.name + ".npy", array.Bytes(), offset);
      offset = members_.back().end();
    }
  }

  int passes() const override { return static_cast<int>(arrays_.size() - first_row_); }
  bool NeedsVelocities(int pass) const override { return arrays_[first_row_ + pass].is_velocity; }

  absl::Status Begin(ExportStream& out) override {
    for (size_t i = 0; i < first_row_; ++i) {
      BeginMember(i, out);
      AppendData(arrays_[i].values, out);
      EndMember(out);
      arrays_[i].values.clear();
    }
    return out.status();
  }

  absl::Status Add(int pass, size_t sample, const ExportMesh& mesh, ExportStream& out) override {
    const NpzArray& array = arrays_[first_row_ + pass];
    if (sample == 0) BeginMember(first_row_ + pass, out);
    AppendData(array.row(mesh), out);
    if (sample + 1 == array.shape.front()) EndMember(out);
    return out.status();
  }

  absl::Status Finish(ExportStream& out) override {
    const uint64_t directory = out.size();
    for (size_t i = 0; i < members_.size(); ++i) out.Append(members_[i].CentralHeader(crcs_[i]));
    out.Append(ZipEnd(members_.size(), directory, out.size() - directory));
    return out.status();
  }

  // Checksums of the members that have begun; the last one may be incomplete.
  std::vector<double> State() const override { return {crcs_.begin(), crcs_.end()}; }
  absl::Status Restore(const std::vector<double>& state) override {
    crcs_.clear();
    for (const double crc : state) crcs_.push_back(static_cast<uint32_t>(crc));
    if (crcs_.size() >= first_row_ && crcs_.size() <= members_.size()) return absl::OkStatus();
    return absl::DataLossError("the state of the archive does not fit its members");
  }

  uint64_t MaxFileBytes() const override {
    constexpr uint64_t kDirectoryEntry = 46 + 28 + 32, kEnd = 98;
    return members_.back().end() + members_.size() * kDirectoryEntry + kEnd;
  }

 private:
  void AddConstant(const char* name, std::string type, std::vector<size_t> shape, size_t bytes,
                   std::string values) {
    arrays_.push_back({name, std::move(type), std::move(shape), bytes, std::move(values), nullptr, false});
  }

  void AddConstants(const ExportPlan& plan) {
    const ExportTopology& topology = plan.source.topology();
    std::vector<int32_t> faces;
    for (const Face& face : topology.faces) faces.insert(faces.end(), face.begin(), face.end());
    AddConstant("faces", "<i4", {topology.faces.size(), 3}, 4, BytesOf(faces));
    if (plan.Has(ExportAttribute::kUv) && !topology.texture.empty()) {
      std::vector<Eigen::Vector2f> uv;
      for (size_t f = 0; f < topology.faces.size(); ++f)
        for (int k = 0; k < 3; ++k)
          uv.push_back(topology.texture.of_corner.empty() ? topology.texture.of_vertex[topology.faces[f][k]]
                                                          : topology.texture.of_corner[f][k]);
      AddConstant("uv", "<f4", {topology.faces.size(), 3, 2}, 4, BytesOf(uv));
    }
    if (plan.Has(ExportAttribute::kCoverage))
      AddConstant("coverage", "<f4", {topology.vertices}, 4, BytesOf(topology.coverage));
    if (plan.source.reduced()) {
      const std::vector<int>& kept = plan.source.reduced()->vertices;
      AddConstant("template_vertex", "<i4", {kept.size()}, 4,
                  BytesOf(std::vector<int32_t>(kept.begin(), kept.end())));
    }
    AddFrames(plan);
    const ExportTransform& transform = plan.source.transform();
    Eigen::Matrix<double, 4, 4, Eigen::RowMajor> export_from_world = Eigen::Matrix4d::Identity();
    export_from_world.topLeftCorner<3, 3>() = transform.unit_per_mm * transform.rotation;
    AddConstant("export_from_world", "<f8", {4, 4}, 8,
                BytesOf(std::vector<double>(export_from_world.data(), export_from_world.data() + 16)));
  }

  // Names as NumPy's fixed-width text of 32 bits a character, times, and which frames are bridged.
  void AddFrames(const ExportPlan& plan) {
    size_t longest = 1;
    for (const ExportSample& sample : plan.samples) longest = std::max(longest, sample.frame.size());
    std::string names;
    std::vector<double> times_s;
    std::vector<int32_t> indices;
    std::string bridged;
    for (const ExportSample& sample : plan.samples) {
      for (size_t i = 0; i < longest; ++i)
        AppendRaw(names, i < sample.frame.size() ? uint32_t{static_cast<uint8_t>(sample.frame[i])} : 0u);
      times_s.push_back(sample.time_s);
      indices.push_back(sample.index);
      const size_t frame = plan.source.meshes()[sample.mesh];
      bridged += plan.source.frames()[frame].bridged() ? '\1' : '\0';
    }
    const size_t frames = plan.samples.size();
    AddConstant("frames", absl::StrCat("<U", longest), {frames}, 4 * longest, std::move(names));
    AddConstant("index", "<i4", {frames}, 4, BytesOf(indices));
    if (plan.source.fps() > 0) AddConstant("times_s", "<f8", {frames}, 8, BytesOf(times_s));
    AddConstant("bridged", "|b1", {frames}, 1, std::move(bridged));
  }

  void BeginMember(size_t member, ExportStream& out) {
    out.Append(members_[member].LocalHeader());
    crcs_.push_back(0);
    AppendData(NpyHeader(arrays_[member].type, arrays_[member].shape), out);
  }
  void AppendData(const std::string& bytes, ExportStream& out) {
    crcs_.back() = static_cast<uint32_t>(
        crc32_z(crcs_.back(), reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
    out.Append(bytes);
  }
  void EndMember(ExportStream& out) {
    std::string crc;
    AppendRaw(crc, crcs_.back());
    out.Overwrite(members_[crcs_.size() - 1].offset() + ZipMember::kCrcOffset, crc);
  }

  std::vector<NpzArray> arrays_;
  std::vector<ZipMember> members_;  // [arrays]
  size_t first_row_ = 0;            // of the arrays that grow by frames
  std::vector<uint32_t> crcs_;      // of the members that have begun
};

}  // namespace

std::unique_ptr<SequenceWriter> MakeNpzWriter(const ExportPlan& plan) {
  return std::make_unique<NpzWriter>(plan);
}

}  // namespace weft
