// NumPy's arrays in a zip archive. Truth is Python's zipfile, which checks every checksum, and struct.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/services/results/export/small_result.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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
  FILE* python = popen(("python3 '" + (result.folder / "show.py") + "' '" + file + "' 2>&1").c_str(), "r");
  std::string text;
  for (int c = fgetc(python); c != EOF; c = fgetc(python)) text += static_cast<char>(c);
  EXPECT_EQ(pclose(python), 0) << text;
  return text;
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
  EXPECT_EQ(other->Restore({}).code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(other->Restore(std::vector<double>(state.size() + 1)).code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace weft
