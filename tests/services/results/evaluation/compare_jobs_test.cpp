#include "services/results/evaluation/compare_jobs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cmath>
#include <filesystem>
#include <random>

#include "absl/strings/str_format.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/options/presets.h"
#include "services/formats/synthetic/take_writer.h"
#include "services/results/evaluation/comparison_report.h"
#include "services/results/evaluation/comparison_sequence.h"
#include "services/results/evaluation/comparison_text.h"
#include "services/results/report/sequence_view.h"
#include "simulation/take_presets.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/report/page_data.h"
#include "weft/v1/comparison.pb.h"
#include "weft/v1/page_reports.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const ComparedMeasure* Find(const std::vector<ComparedMeasure>& measures, const std::string& name) {
  for (const ComparedMeasure& compared : measures)
    if (compared.measure->name == name) return &compared;
  return nullptr;
}

// `frames` frames whose geodesic distortion and jitter are `mm` plus noise of `noise_mm`.
JobEvaluation Evaluation(int frames, double mm, double noise_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  JobEvaluation out;
  for (int f = 0; f < frames; ++f) {
    EvaluatedFrame frame;
    frame.frame = absl::StrFormat("%04d", f);
    frame.metrics.distortion_mm = mm + noise_mm * noise(random);
    ErrorSummary jitter;
    jitter.count = 10, jitter.mean = mm + noise_mm * noise(random);
    frame.metrics.jitter_observed_mm = jitter;
    out.frames.push_back(frame);
  }
  return out;
}

TEST(CompareMeasures, DifferencesBeyondTheirNoiseAreSignificant) {
  const auto measures = CompareMeasures(Evaluation(40, 1.0, 0.05, 1), Evaluation(40, 1.2, 0.05, 2));
  const ComparedMeasure* distortion = Find(measures, "geodesic_distortion_mm");
  ASSERT_TRUE(distortion && distortion->test);
  EXPECT_EQ(distortion->frames, 40u);
  EXPECT_NEAR(distortion->a - distortion->b, -0.2, 0.05);
  EXPECT_LT(distortion->p_adjusted, 0.01);
  EXPECT_EQ(distortion->outcome, ComparisonOutcome::kABetter);
  // Less jitter may be too much smoothing.
  EXPECT_EQ(Find(measures, "jitter_observed_mm")->outcome, ComparisonOutcome::kALower);
}

TEST(CompareMeasures, NoiseIsNoDifference) {
  int called_different = 0;
  for (unsigned seed = 0; seed < 100; ++seed)
    for (const ComparedMeasure& compared :
         CompareMeasures(Evaluation(40, 1, 0.05, 2 * seed), Evaluation(40, 1, 0.05, 2 * seed + 1)))
      called_different += compared.outcome != ComparisonOutcome::kNoDifference;
  EXPECT_LE(called_different, 10);  // of 200; 5 % of the comparisons may have one
}

TEST(CompareMeasures, FewFramesAreNotTestedAndMissingOnesNotPaired) {
  JobEvaluation a = Evaluation(3, 1, 0, 1), b = Evaluation(3, 2, 0, 1);
  EXPECT_EQ(Find(CompareMeasures(a, b), "geodesic_distortion_mm")->outcome, ComparisonOutcome::kNotTested);
  b.frames[1].metrics.distortion_mm.reset();
  a.frames[1].metrics.distortion_mm = 1000;
  const auto measures = CompareMeasures(a, b);
  EXPECT_EQ(Find(measures, "geodesic_distortion_mm")->frames, 2u);
  EXPECT_EQ(Find(measures, "geodesic_distortion_mm")->a, 1);
  EXPECT_EQ(Find(measures, "coverage"), nullptr);
}

TEST(DifferencesOf, NamesPresetOptionAndRig) {
  v1::Job a, b;
  for (const auto& [job, preset] : {std::pair{&a, "best"}, {&b, "paper"}}) {
    v1::RegistrationOptions asked;
    asked.set_preset(preset);
    const auto options = EffectiveOptions(asked);
    ASSERT_TRUE(options.ok()) << options.status();
    *job->mutable_spec()->mutable_options() = *options;
    job->mutable_spec()->set_rig("rig.json");
    job->mutable_inputs()->set_rig(std::string(preset) + "-hash");
  }
  const std::vector<JobDifference> differences = DifferencesOf(a, b);
  const auto find = [&](const std::string& what) {
    return std::find_if(differences.begin(), differences.end(),
                        [&](const JobDifference& d) { return d.what == what; });
  };
  ASSERT_NE(find("preset"), differences.end());
  EXPECT_EQ(find("preset")->b, "paper");
  ASSERT_NE(find("rig"), differences.end());
  EXPECT_EQ(find("rig")->a, "rig.json (best-hash)");
  EXPECT_TRUE(std::any_of(differences.begin(), differences.end(),
                          [](const JobDifference& d) { return d.what.find('.') != std::string::npos; }));
  EXPECT_TRUE(DifferencesOf(a, a).empty());
}

// Two results of a tiny take: as good as the truth, and beside it by some mm along x.
class CompareJobsTest : public testing::Test {
 protected:
  static constexpr int kFrames = 5;
  static constexpr double kShift_mm = 0.5;

  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    SyntheticTakeOptions options = *SyntheticPreset("tiny", 5);
    options.performance.frames = kFrames;
    auto take = SyntheticTake::Make(options);
    ASSERT_TRUE(take.ok()) << take.status();
    const auto take_folder = TakeFolder::Open(*folder_ / "take", "test");
    ASSERT_TRUE(take_folder.ok()) << take_folder.status();
    ASSERT_TRUE(WriteSyntheticTake(*take, *take_folder).ok());
    WriteResult("true", 0, kFrames);
    WriteResult("shifted", kShift_mm, kFrames);
    WriteResult("short", kShift_mm, kFrames - 1);
  }
  static void TearDownTestSuite() { delete folder_; }

  static void WriteResult(const std::string& result, double shift_mm, int frames) {
    for (int f = 0; f < frames; ++f) {
      const std::string name = absl::StrFormat("%04d", f);
      const auto truth = ReadMesh(*folder_ / ("take/truth/" + name + "/mesh.ply"));
      ASSERT_TRUE(truth.ok()) << truth.status();
      RegisteredMesh mesh;
      mesh.vertices_mm = truth->vertices_mm;
      for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex.x() += shift_mm * (1 + 0.1 * (f % 2));
      mesh.state.assign(mesh.vertices_mm.size(), VertexState::kObserved);
      mesh.sigma_mm.assign(mesh.vertices_mm.size(), 0.1f);
      mesh.views.assign(mesh.vertices_mm.size(), 4);
      std::filesystem::create_directories(*folder_ / (result + "/" + name));
      ASSERT_TRUE(
          WriteRegisteredMesh(*folder_ / (result + "/" + name + "/mesh.ply"), mesh, truth->faces).ok());
    }
  }

  static ComparisonRequest Request(const std::string& a, const std::string& b) {
    ComparisonRequest request;
    request.a.result = *folder_ / a, request.against = *folder_ / b;
    request.a.truth = *folder_ / "take/truth";
    request.a.garment = request.against_garment = *folder_ / "take/template";
    request.a.quick = true;
    return request;
  }

  static TempFolder* folder_;
};
TempFolder* CompareJobsTest::folder_ = nullptr;

TEST_F(CompareJobsTest, ErrorsAgainstTheTruthAndDistancesAreThoseOfTheShift) {
  const auto comparison = CompareJobs(Request("true", "shifted"));
  ASSERT_TRUE(comparison.ok()) << comparison.status();
  const ComparedMeasure* error = Find(comparison->measures, "mesh_visible_mean_mm");
  ASSERT_TRUE(error && error->test);
  EXPECT_EQ(error->outcome, ComparisonOutcome::kABetter);
  EXPECT_NEAR(error->b - error->a, 1.04 * kShift_mm, 1e-3);
  ASSERT_TRUE(comparison->total.distance_mm);
  EXPECT_NEAR(comparison->total.distance_mm->mean, 1.04 * kShift_mm, 1e-3);
  // Of sqrt(2) 0.1 mm.
  EXPECT_EQ(*comparison->total.beyond_sigmas_share, 1);
  EXPECT_NEAR(comparison->maps.distance_sigmas[7], 1.04 * kShift_mm / (0.1 * std::sqrt(2)), 1e-2);
  EXPECT_NEAR(comparison->maps.a_minus_b.error_mm[7], -1.04 * kShift_mm, 1e-3);
  EXPECT_EQ(comparison->maps.a_minus_b.visibility[7], 0);
  EXPECT_THAT(ComparisonTable(*comparison),
              AllOf(HasSubstr("A is better"), HasSubstr("vertices are 0.520 mm")));
}

TEST_F(CompareJobsTest, AResultIsNotBetterThanItself) {
  const auto comparison = CompareJobs(Request("shifted", "shifted"));
  ASSERT_TRUE(comparison.ok()) << comparison.status();
  for (const ComparedMeasure& compared : comparison->measures)
    EXPECT_EQ(compared.outcome,
              compared.frames < 4 ? ComparisonOutcome::kNotTested : ComparisonOutcome::kNoDifference)
        << compared.measure->name;
  EXPECT_EQ(comparison->total.distance_mm->max, 0);
}

TEST_F(CompareJobsTest, FilesHoldTheSameNumbersAndPlots) {
  const auto comparison = CompareJobs(Request("true", "shifted"));
  ASSERT_TRUE(comparison.ok()) << comparison.status();
  ASSERT_TRUE(WriteComparison(*folder_ / "out", *comparison).ok());
  v1::Comparison read;
  ASSERT_TRUE(ReadJsonFile(*folder_ / "out/comparison.json", read).ok());
  EXPECT_EQ(read.frames_size(), kFrames);
  EXPECT_NEAR(read.meshes().distance_mm().mean(), comparison->total.distance_mm->mean, 1e-9);
  for (const char* name : {"measures.csv", "frames.csv", "cameras.csv", "vertices.csv", "report.html",
                           "plots/mesh_visible_mean_mm.svg", "plots/distance_mm.svg", "maps/distance_mm.svg",
                           "maps/error_difference_mm.svg"})
    EXPECT_TRUE(std::filesystem::exists(*folder_ / ("out/" + std::string(name)))) << name;
  const auto page = ReadWholeFile(*folder_ / "out/report.html");
  ASSERT_TRUE(page.ok());
  EXPECT_EQ(MemberOf<v1::Comparison>(*page, "comparison").SerializeAsString(), read.SerializeAsString());
  EXPECT_GT(MemberOf<v1::PageMaps>(*page, "maps").maps_size(), 1);
  const auto shown = MemberOf<v1::ComparisonPage>(*page, "page");
  EXPECT_THAT(shown.headline(), HasSubstr("A is better"));
  EXPECT_EQ(shown.decimals_size(), read.measures_size());
  EXPECT_EQ(shown.without_mesh_size(), kFrames);
  for (const v1::ComparisonPage::Plot& plot : shown.plots()) {
    ASSERT_EQ(plot.series_size(), 2) << plot.title();
    EXPECT_EQ(plot.series(1).values_size(), kFrames) << plot.title();
  }
  const auto csv = ReadWholeFile(*folder_ / "out/measures.csv");
  EXPECT_THAT(*csv, HasSubstr("\nmesh_visible_mean_mm,mm,5,"));
}

TEST_F(CompareJobsTest, DistancesAreSeenInThreeDimensions) {
  const auto comparison = CompareJobs(Request("true", "shifted"));
  ASSERT_TRUE(comparison.ok()) << comparison.status();
  std::vector<std::string> notes;
  EXPECT_FALSE(ComparisonSequence(*comparison, notes)) << "nothing tells the frames of the job";
  const std::string a = *folder_ / "true";
  ASSERT_TRUE(WriteJsonFile(a + "/job.json", v1::Job()).ok());
  for (int frame = 0; frame < kFrames; ++frame) {
    v1::FrameReport report;
    report.set_state(v1::FRAME_STATE_DONE);
    ASSERT_TRUE(WriteJsonFile(absl::StrFormat("%s/%04d/report.json", a, frame), report).ok());
  }
  const auto meshes = ComparisonSequence(*comparison, notes);
  std::filesystem::remove(a + "/job.json");
  for (int frame = 0; frame < kFrames; ++frame)
    std::filesystem::remove(absl::StrFormat("%s/%04d/report.json", a, frame));
  ASSERT_TRUE(meshes);
  EXPECT_EQ(meshes->frames_size(), kFrames);
  EXPECT_TRUE(notes.empty());
  // The last bytes of a frame are its distances, all of them kShift_mm.
  const std::string& bytes = meshes->frames(0).bytes();
  const auto kept = static_cast<size_t>(meshes->vertices());
  ASSERT_EQ(bytes.size(), 9 * kept);
  const std::string distances = bytes.substr(8 * kept);
  const uint8_t color = PaletteIndex(kShift_mm, {0, 0.6});  // the next round number
  EXPECT_TRUE(distances == std::string(kept, static_cast<char>(color)));
  EXPECT_EQ(meshes->colorings(2).name(), "distance of A and B");
  EXPECT_TRUE(meshes->colorings(2).first_shown());
  EXPECT_FALSE(meshes->still().bytes().empty());
  const std::string page = MakeComparisonReport(*comparison, &*meshes, notes);
  EXPECT_EQ(MemberOf<v1::PageSequence>(page, "meshes").frames(0).bytes(), bytes);
}

TEST_F(CompareJobsTest, TheRangeOfSigmaIsThatOfTheFirstMesh) {
  const auto comparison = CompareJobs(Request("true", "shifted"));
  ASSERT_TRUE(comparison.ok()) << comparison.status();
  const std::string a = *folder_ / "true";
  ASSERT_TRUE(WriteJsonFile(a + "/job.json", v1::Job()).ok());
  for (const char* frame : {"0001", "0002", "later"}) {
    v1::FrameReport report;
    report.set_state(v1::FRAME_STATE_DONE);
    std::filesystem::create_directories(a + "/" + frame);
    ASSERT_TRUE(WriteJsonFile(a + "/" + frame + "/report.json", report).ok());
  }
  std::vector<std::string> notes;
  const auto meshes = ComparisonSequence(*comparison, notes);
  ASSERT_TRUE(meshes);
  EXPECT_EQ(meshes->frames_size(), 2) << "of the frames that were compared";
  EXPECT_NEAR(meshes->colorings(1).key().scale().high(), 0.1, 1e-6);
  EXPECT_DOUBLE_EQ(meshes->colorings(2).key().scale().high(), 0.6);
  EXPECT_EQ(meshes->colorings(2).key().scale().label(), "distance");
  EXPECT_EQ(meshes->colorings(2).key().scale().unit(), "mm");
  EXPECT_EQ(meshes->still().title(), "Mean distance over the frames, on the template");

  JobComparison other = *comparison;
  other.maps.distance_mm.clear();
  EXPECT_FALSE(ComparisonSequence(other, notes)->has_still());
  other.total.distance_mm.reset();
  EXPECT_FALSE(ComparisonSequence(other, notes)) << "vertices have no counterpart";
  other = *comparison;
  std::swap(other.b.shape.faces.front(), other.b.shape.faces.back());
  EXPECT_FALSE(ComparisonSequence(other, notes)) << "other faces";
  std::filesystem::remove(a + "/job.json");
  for (const char* frame : {"0001", "0002"}) std::filesystem::remove(a + "/" + frame + "/report.json");
  std::filesystem::remove_all(a + "/later");
}

TEST_F(CompareJobsTest, FramesOfOneResultAloneAreLeftOut) {
  // Without a truth, frames are those of the results.
  ComparisonRequest request = Request("true", "short");
  request.a.truth.clear();
  const auto comparison = CompareJobs(request);
  ASSERT_TRUE(comparison.ok()) << comparison.status();
  EXPECT_EQ(comparison->a.frames.size(), static_cast<size_t>(kFrames - 1));
  EXPECT_EQ(comparison->b.frames.size(), static_cast<size_t>(kFrames - 1));
  EXPECT_THAT(ComparisonTable(*comparison), HasSubstr("1 frame of one result alone"));
}

TEST_F(CompareJobsTest, ResultsOfOtherFramesAreRefused) {
  std::filesystem::create_directories(*folder_ / "other/later");
  std::filesystem::copy(*folder_ / "true/0000/mesh.ply", *folder_ / "other/later/mesh.ply",
                        std::filesystem::copy_options::overwrite_existing);
  ComparisonRequest request = Request("true", "other");
  request.a.truth.clear();
  const auto comparison = CompareJobs(request);
  EXPECT_EQ(comparison.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(comparison.status().message(), AllOf(HasSubstr("other"), HasSubstr("no frame in common")));
  request.against = *folder_ / "nowhere";
  EXPECT_EQ(CompareJobs(request).status().code(), absl::StatusCode::kNotFound);
}

// Outcomes of measures that are constant apart from each other in all frames.
TEST(CompareMeasures, OutcomesFollowWhatIsBetter) {
  using enum ComparisonOutcome;
  JobEvaluation low, high;
  for (int f = 0; f < 6; ++f) {
    for (auto* side : {&low, &high}) {
      EvaluatedFrame& frame = side->frames.emplace_back();
      const double add = side == &low ? 0 : 0.5;
      frame.metrics.coverage = 0.25 + add;
      frame.metrics.distortion_mm = 1 + add;
      frame.metrics.two_view_share = 0.25 + add;
      frame.metrics.jitter_of_truth_mm = ErrorSummary{.count = 1, .mean = 1 + add};
      frame.metrics.error_change_mm = ErrorSummary{.count = 1, .mean = 1};
      frame.metrics.error_change_mm_s = ErrorSummary{.count = 1, .mean = 30};
    }
  }
  const auto outcomes = [](const JobEvaluation& a, const JobEvaluation& b) {
    std::string text;
    for (const ComparedMeasure& compared : CompareMeasures(a, b))
      text += std::string(compared.measure->name) + " " + OutcomeText(compared.outcome) +
              absl::StrFormat(" %g\n", compared.p_adjusted);
    return text;
  };
  EXPECT_EQ(outcomes(low, high),
            "coverage B is better 0\ntwo_view_share A is lower 0\ngeodesic_distortion_mm A is better 0\n"
            "error_change_mm no significant difference 1\nerror_change_mm_s no significant difference 1\n");
  low.fps = high.fps = 30;
  EXPECT_EQ(outcomes(high, low),
            "coverage A is better 0\ntwo_view_share A is higher 0\ngeodesic_distortion_mm B is better 0\n"
            "error_change_mm_s no significant difference 1\n");
  low.fps = 0;
  EXPECT_THAT(outcomes(high, low), HasSubstr("error_change_mm no"));
}

}  // namespace
}  // namespace weft
