// Results of a small sheet side by side: what is paired, what is told, and why something is not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/files/json_file.h"
#include "services/results/evaluation/compare_jobs.h"
#include "tests/services/results/evaluation/sheet_on_disk.h"
#include "weft/v1/report.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// Two results of a sheet, as cheap as can be.
class CompareSheetsTest : public testing::Test {
 protected:
  using Positions = SheetOnDisk::Positions;
  static std::string Name(int frame) { return absl::StrFormat("%04d", frame); }

  void WriteMeshes(const std::string& result, int frames, double off_mm, bool with_states = true) {
    const std::vector<VertexState> states(with_states ? sheet_.rest().size() : 0, VertexState::kObserved);
    for (int f = 0; f < frames; ++f)
      sheet_.WriteResultMesh(Name(f), SheetOnDisk::Moved(sheet_.rest(), {off_mm * f, 0, 0}), states, result);
  }
  ComparisonRequest Request() {
    ComparisonRequest request;
    request.a = sheet_.Request();
    request.a.truth.clear();
    request.a.result = sheet_.folder / "a", request.against = sheet_.folder / "b";
    request.against_garment = request.a.garment;
    return request;
  }
  JobComparison Compared(const ComparisonRequest& request) {
    auto comparison = CompareJobs(request);
    EXPECT_TRUE(comparison.ok()) << comparison.status();
    return comparison.ok() ? *std::move(comparison) : JobComparison();
  }
  static std::vector<std::string> RemarksOf(const JobComparison& comparison) {
    std::vector<std::string> remarks;
    for (const EvaluationRemark& remark : comparison.remarks)
      remarks.push_back(remark.metric + ": " + remark.reason);
    return remarks;
  }

  SheetOnDisk sheet_;
};

TEST_F(CompareSheetsTest, DistancesAreOfEachFrameAndOfAll) {
  WriteMeshes("a", 5, 0);
  WriteMeshes("b", 3, 2);
  std::vector<std::string> calls;
  tbb::task_arena alone(1);  // so that there are several batches
  const auto comparison = alone.execute([&] {
    return CompareJobs(Request(),
                       [&](size_t done, size_t all) { calls.push_back(absl::StrCat(done, "/", all)); });
  });
  ASSERT_TRUE(comparison.ok()) << comparison.status();
  EXPECT_THAT(calls, testing::ElementsAre("1/3", "2/3", "3/3"));
  ASSERT_EQ(comparison->frames.size(), 3u);
  for (int f = 0; f < 3; ++f) {
    EXPECT_NEAR(comparison->frames[f].distance_mm->mean, 2 * f, 1e-5);
    EXPECT_EQ(*comparison->frames[f].beyond_sigmas_share, f == 0 ? 0 : 1);
  }
  const ErrorSummary total = *comparison->total.distance_mm;
  EXPECT_EQ(total.count, static_cast<int64_t>(3 * sheet_.rest().size()));
  for (const double mean : {total.mean, total.median, total.p95, total.p99}) EXPECT_NEAR(mean, 2, 1e-5);
  EXPECT_NEAR(total.max, 4, 1e-5);
  EXPECT_NEAR(*comparison->total.beyond_sigmas_share, 2 / 3.0, 1e-9);
  EXPECT_NEAR(comparison->maps.distance_mm[0], 2, 1e-5);
  EXPECT_EQ(comparison->maps.a_minus_b.visibility[0], 0);
  EXPECT_THAT(RemarksOf(*comparison),
              testing::ElementsAre("frames: 2 frames of one result alone were left out; 3 are compared",
                                   "significance: tests need four frames or more that both results have"));
}

TEST_F(CompareSheetsTest, FewDegreesOfFreedomAreTold) {
  WriteMeshes("a", 6, 0);
  WriteMeshes("b", 6, 0);
  EXPECT_THAT(
      RemarksOf(Compared(Request())),
      testing::ElementsAre("significance: frames resemble their neighbours, so 6 of them leave 1 degree of "
                           "freedom; a longer take shows smaller differences"));
}

TEST_F(CompareSheetsTest, MeshesWithoutSigmasAreComparedInMillimetres) {
  WriteMeshes("a", 4, 0, false);
  WriteMeshes("b", 4, 1);
  const JobComparison comparison = Compared(Request());
  EXPECT_TRUE(comparison.total.distance_mm);
  EXPECT_FALSE(comparison.total.beyond_sigmas_share);
  EXPECT_THAT(RemarksOf(comparison),
              testing::Contains("differences in sigmas: the meshes have no sigmas, or other vertices"));
}

TEST_F(CompareSheetsTest, OtherTemplatesAreComparedByCells) {
  WriteMeshes("a", 4, 0);
  const Template upper = sheet_.Sheet(6);
  ASSERT_TRUE(WriteTemplate(sheet_.folder / "upper", upper).ok());
  Positions of_b_mm = upper.rest.vertices_mm;
  for (size_t v = 0; v < 48; ++v) of_b_mm[v] = sheet_.rest()[v] + Eigen::Vector3d(0, 3, 0);
  for (int f = 0; f < 4; ++f)
    sheet_.WriteMeshWithFaces(Name(f), of_b_mm,
                              std::vector<VertexState>(of_b_mm.size(), VertexState::kObserved),
                              upper.rest.faces, "b");
  ComparisonRequest request = Request();
  request.against_garment = sheet_.folder / "upper";
  const JobComparison by_cell = Compared(request);
  EXPECT_THAT(RemarksOf(by_cell), testing::Contains(absl::StrCat(
                                      "vertex differences: the templates differ; 48 of ",
                                      sheet_.rest().size(), " vertices of A have their board cell in B")));
  EXPECT_EQ(by_cell.frames[0].distance_mm->count, 48);
  EXPECT_NEAR(by_cell.frames[0].distance_mm->max, 3, 1e-5);
  EXPECT_TRUE(by_cell.maps.a_minus_b.visibility.empty()) << "vertices differ";

  Template other = upper;
  other.board_hash = GenerateBoard(8, 8, 10, 2)->ContentHash();
  ASSERT_TRUE(WriteTemplate(sheet_.folder / "upper", other).ok());
  const JobComparison apart = Compared(request);
  EXPECT_THAT(RemarksOf(apart),
              testing::Contains("vertex differences: the templates have no cell of a board in common"));
  EXPECT_FALSE(apart.total.distance_mm);

  request.against_garment = sheet_.folder / "upper/mesh.ply";
  EXPECT_THAT(
      RemarksOf(Compared(request)),
      testing::Contains("vertex differences: the garments' meshes have other faces, and no board relates "
                        "their vertices"));
}

TEST_F(CompareSheetsTest, AMeshWithoutABoardIsComparedByItsFaces) {
  WriteMeshes("a", 4, 0);
  WriteMeshes("b", 4, 1);
  ComparisonRequest request = Request();
  request.against_garment = sheet_.folder / "take/template/mesh.ply";
  const JobComparison comparison = Compared(request);
  ASSERT_TRUE(comparison.total.distance_mm);
  EXPECT_NEAR(comparison.total.distance_mm->max, 3, 1e-5);
}

TEST_F(CompareSheetsTest, OtherImagesMakeTestsMeanNothing) {
  WriteMeshes("a", 4, 0);
  WriteMeshes("b", 4, 0);
  const auto fingerprint = [&](const std::string& result, const std::string& text) {
    v1::FrameReport report;
    report.set_images_fingerprint(text);
    ASSERT_TRUE(WriteJsonFile(sheet_.folder / (result + "/0000/report.json"), report).ok());
  };
  const std::string told =
      "significance: the images of frame 0000 are not the same in both results; pairs of frames assume that "
      "they are: "
      "compare results of one take";
  fingerprint("a", "11");
  EXPECT_THAT(RemarksOf(Compared(Request())), testing::Not(testing::Contains(told)));
  fingerprint("b", "11");
  EXPECT_THAT(RemarksOf(Compared(Request())), testing::Not(testing::Contains(told)));
  fingerprint("b", "22");
  EXPECT_THAT(RemarksOf(Compared(Request())), testing::Contains(told));
}

TEST_F(CompareSheetsTest, FramesWithoutAMeshHaveNoDistance) {
  WriteMeshes("a", 4, 0);
  WriteMeshes("b", 4, 1);
  std::filesystem::remove(sheet_.folder / "b/0002/mesh.ply");
  WriteBytes(sheet_.folder / "b/0002/report.json", "{}");
  const JobComparison comparison = Compared(Request());
  EXPECT_FALSE(comparison.frames[2].distance_mm);
  EXPECT_TRUE(comparison.frames[3].distance_mm);
  WriteBytes(sheet_.folder / "b/0002/mesh.ply", "no mesh");
  EXPECT_THAT(std::string(CompareJobs(Request()).status().message()), HasSubstr("b/0002/mesh.ply"));
}

TEST(ComparisonRequest, TheOtherResultIsNamed) {
  ComparisonRequest request;
  request.a.result = "/a";
  EXPECT_EQ(request.Validate().message(), "the folder of the result to compare with is empty");
  request.against = "/b";
  EXPECT_TRUE(request.Validate().ok());
  request.a.result.clear();
  EXPECT_EQ(request.Validate().message(), "the folder of the result is empty");
}

}  // namespace
}  // namespace weft
