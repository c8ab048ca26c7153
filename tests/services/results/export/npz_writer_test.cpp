// NumPy's arrays in a zip archive. Truth is Python's zipfile, which checks every checksum, and struct.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// What a Python program prints of a file.
std::string OutputOf(const std::string& program, const std::string& file) {
  FILE* python = popen(("python3 '" + program + "' '" + file + "' 2>&1").c_str(), "r");
  std::string text;
  for (int c = fgetc(python); c != EOF; c = fgetc(python)) text += static_cast<char>(c);
  EXPECT_EQ(pclose(python), 0) << text;
  return text;
}

// What Python finds in the archive: "name dtype shape values" a line, in the archive's order.
std::string ArraysOf(const SmallResult& result, const std::string& file) {
  WriteBytes(
      result.folder / "show.py",
      "import ast, struct, sys, zipfile\n"
      "archive = zipfile.ZipFile(sys.argv[1])\n"
      "assert archive.testzip() is None\n"
      "for name in archive.namelist():\n"
      "  data = archive.read(name)\n"
      "  assert data[:8] == b'\\x93NUMPY\\x01\\x00', name\n"
      "  size, = struct.unpack('<H', data[8:10])\n"
      "  assert (10 + size) % 64 == 0 and data[9 + size:10 + size] == b'\\n', name\n"
      "  head = ast.literal_eval(data[10:10 + size].decode())\n"
      "  kind, body = head['descr'], data[10 + size:]\n"
      "  codes = {'<f4': 'f', '<f8': 'd', '<i4': 'i', '|u1': 'B', '|b1': '?'}\n"
      "  if kind in codes: values = [v for v, in struct.iter_unpack('<' + codes[kind], body)]\n"
      "  else: values = [body[i:i + 4 * int(kind[2:])].decode('utf-32-le') for i in range(0, len(body), 4 "
      "* int(kind[2:]))]\n"
      "  print(name, kind, head['shape'], head['fortran_order'], [round(v, 6) + 0.0 if isinstance(v, float) "
      "else v for v in values])\n");
  return OutputOf(result.folder / "show.py", file);
}

TEST(NpzWriterTest, EveryArrayHasItsShapeTypeAndValues) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kNpz,
                                 {ExportAttribute::kState, ExportAttribute::kSigma, ExportAttribute::kViews,
                                  ExportAttribute::kCoverage});
  const auto writer = MakeNpzWriter(plan);
  const std::string file = result.folder / "garment.npz";
  EXPECT_LE(Written(*writer, plan, file).size(), writer->MaxFileBytes());
  const std::string text = ArraysOf(result, file);
  EXPECT_THAT(text, HasSubstr("faces.npy <i4 (2, 3) False [0, 1, 2, 0, 2, 3]\n"));
  EXPECT_THAT(text, HasSubstr("coverage.npy <f4 (4,) False [0.0, 1.0, 1.0, 1.0]\n"));
  EXPECT_THAT(text, HasSubstr("frames.npy <U4 (3,) False ['0000', '0001', '0002']\n"));
  EXPECT_THAT(text, HasSubstr("index.npy <i4 (3,) False [0, 1, 2]\n"));
  EXPECT_THAT(text, HasSubstr("times_s.npy <f8 (3,) False [0.0, 0.1, 0.2]\n"));
  EXPECT_THAT(text, HasSubstr("bridged.npy |b1 (3,) False [False, False, False]\n"));
  EXPECT_THAT(text, HasSubstr("positions.npy <f4 (3, 4, 3) False [0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 100.0, "
                              "50.0, 0.0, 0.0, 50.0, 0.0, 0.0, 0.0, 10.0, "));
  EXPECT_THAT(text, HasSubstr("state.npy |u1 (3, 4) False [0, 2, 1, 1, 0, 2, 1, 1, 0, 2, 1, 1]\n"));
  EXPECT_THAT(text, HasSubstr("sigma.npy <f4 (3, 4) False [1.5, 0.5, 0.25, 0.25, 1.5, "));
  EXPECT_THAT(text, HasSubstr("views.npy <i4 (3, 4) False [0, 2, 3, 3, 0, 2, 3, 3, 0, 2, 3, 3]\n"));
  EXPECT_THAT(text, Not(HasSubstr("velocities.npy")));
  EXPECT_THAT(text, Not(HasSubstr("uv.npy")));
}

// Rows of export_from_world: metres, and y downwards becomes z upwards.
TEST(NpzWriterTest, TellsHowTheWorldBecameTheExport) {
  SmallResult result;
  result.request.unit = LengthUnit::kMetre;
  result.request.up = UpAxis::kZ;
  result.request.world_up = std::string("-y");
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kNpz, {});
  Written(*MakeNpzWriter(plan), plan, result.folder / "garment.npz");
  EXPECT_THAT(
      ArraysOf(result, result.folder / "garment.npz"),
      HasSubstr("export_from_world.npy <f8 (4, 4) False [0.001, 0.0, 0.0, 0.0, 0.0, 0.0, 0.001, 0.0, 0.0, "
                "-0.001, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]\n"));
}

TEST(NpzWriterTest, CornersHaveTheirPlacesAndVelocitiesTheirPass) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan =
      PlanOf(*source, ExportFormat::kNpz, {ExportAttribute::kUv, ExportAttribute::kVelocity});
  const auto writer = MakeNpzWriter(plan);
  ASSERT_EQ(writer->passes(), 2);
  EXPECT_FALSE(writer->NeedsVelocities(0));
  EXPECT_TRUE(writer->NeedsVelocities(1));
  Written(*writer, plan, result.folder / "garment.npz");
  const std::string text = ArraysOf(result, result.folder / "garment.npz");
  EXPECT_THAT(text, HasSubstr("uv.npy <f4 (2, 3, 2) False [0.0, 0.0, 1.0, 0.0, 1.0, 0.5, 0.0, 0.0, 1.0, 0.5, "
                              "0.0, 0.5]\n"));
  EXPECT_THAT(text, HasSubstr("velocities.npy <f4 (3, 4, 3) False [0.0, 0.0, 100.0, "));
}

TEST(NpzWriterTest, BridgedFramesAreMarked) {
  const SmallResult result;
  v1::FrameReport report;
  report.set_state(v1::FRAME_STATE_FAILED);
  report.mutable_temporal()->set_bridged(true);
  result.WriteReport(1, report);
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kNpz, {});
  Written(*MakeNpzWriter(plan), plan, result.folder / "garment.npz");
  EXPECT_THAT(ArraysOf(result, result.folder / "garment.npz"),
              HasSubstr("bridged.npy |b1 (3,) False [False, True, False]\n"));
}

// The archive itself: stored members of 1980 that need version 4.5 for their sizes, one after another.
TEST(NpzWriterTest, MembersFollowEachOtherAsTheirHeadersSay) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kNpz, {ExportAttribute::kState});
  const std::string file = result.folder / "garment.npz";
  const auto writer = MakeNpzWriter(plan);
  const std::string bytes = Written(*writer, plan, file);
  WriteBytes(
      result.folder / "list.py",
      "import sys, zipfile\n"
      "archive = zipfile.ZipFile(sys.argv[1])\n"
      "for i in archive.infolist():\n"
      "  print(i.filename, i.header_offset, i.file_size, i.compress_size, i.compress_type, i.flag_bits, "
      "i.date_time[:3], i.create_version, i.extract_version, i.create_system, i.internal_attr, "
      "i.external_attr, i.volume, len(i.comment))\n"
      "print(archive.start_dir, archive.comment)\n");
  EXPECT_EQ(OutputOf(result.folder / "list.py", file), R"(faces.npy 0 152 152 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
frames.npy 211 176 176 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
index.npy 447 140 140 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
times_s.npy 646 152 152 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
bridged.npy 859 131 131 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
export_from_world.npy 1051 256 256 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
positions.npy 1378 272 272 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
state.npy 1713 140 140 0 0 (1980, 1, 1) 45 45 0 0 0 0 0
1912 b''
)");
  // Each member's local header repeats its sizes.
  EXPECT_EQ(ValueAt<uint32_t>(bytes, 0), 0x04034b50u);
  EXPECT_EQ(ValueAt<uint16_t>(bytes, 4), 45);
  EXPECT_EQ(bytes.substr(30, 9), "faces.npy");
  EXPECT_EQ(ValueAt<uint64_t>(bytes, 43), 152u);
  EXPECT_EQ(ValueAt<uint64_t>(bytes, 51), 152u);
  // The end of the archive, with the counts of its members and where its directory is.
  const size_t end = bytes.size() - 98;
  EXPECT_EQ(ValueAt<uint32_t>(bytes, end), 0x06064b50u);
  EXPECT_EQ(ValueAt<uint64_t>(bytes, end + 4), 44u);
  const uint64_t members = ValueAt<uint64_t>(bytes, end + 24);
  EXPECT_EQ(members, 8u);
  EXPECT_EQ(ValueAt<uint64_t>(bytes, end + 32), members);
  EXPECT_EQ(ValueAt<uint64_t>(bytes, end + 40) + ValueAt<uint64_t>(bytes, end + 48), end);
  EXPECT_EQ(ValueAt<uint64_t>(bytes, end + 64), end) << "by its locator";
  EXPECT_EQ(ValueAt<uint16_t>(bytes, end + 84), members);
  EXPECT_EQ(ValueAt<uint16_t>(bytes, end + 86), members);
  EXPECT_EQ(writer->MaxFileBytes(), ValueAt<uint64_t>(bytes, end + 48) + 106 * members + 98);
}

TEST(NpzWriterTest, AReducedMeshNamesItsVerticesAndSeamsHaveCorners) {
  SmallResult result;
  MeshTexture texture = SmallResult::Texture();
  texture.of_corner = {{Eigen::Vector2f(0, 0), {1, 0}, {1, 0.5F}},
                       {Eigen::Vector2f(0, 0.75F), {1, 0.5F}, {0, 0.5F}}};
  for (int frame = 0; frame < SmallResult::kFrames; ++frame)
    ASSERT_TRUE(
        WriteRegisteredMesh(result.MeshFile(frame), SmallResult::MeshAt(frame), SmallResult::Faces(), texture)
            .ok());
  result.request.max_vertices = 100;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kNpz, {ExportAttribute::kUv});
  Written(*MakeNpzWriter(plan), plan, result.folder / "garment.npz");
  const std::string text = ArraysOf(result, result.folder / "garment.npz");
  EXPECT_THAT(text, HasSubstr("template_vertex.npy <i4 (4,) False [0, 1, 2, 3]\n"));
  EXPECT_THAT(
      text,
      HasSubstr("uv.npy <f4 (2, 3, 2) False [0.0, 0.0, 1.0, 0.0, 1.0, 0.5, 0.0, 0.75, 1.0, 0.5, 0.0, 0.5]"));
}

TEST(NpzWriterTest, RefusesAStateThatIsNotOfItsMembers) {
  const SmallResult result;
  auto source = result.Source();
  ASSERT_TRUE(source.ok()) << source.status();
  const ExportPlan plan = PlanOf(*source, ExportFormat::kNpz, {});
  const auto writer = MakeNpzWriter(plan);
  Written(*writer, plan, result.folder / "garment.npz");
  const std::vector<double> state = writer->State();
  const auto other = MakeNpzWriter(plan);
  EXPECT_TRUE(other->Restore(state).ok());
  EXPECT_EQ(other->State(), state);
  EXPECT_TRUE(other->Restore(std::vector<double>(state.size() - 1)).ok()) << "but the last one has begun";
  EXPECT_EQ(other->Restore(std::vector<double>(state.size() - 2)).code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(other->Restore({}).code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(other->Restore(std::vector<double>(state.size() + 1)).code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace weft
