#include "services/work/animation/cloth_take.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "services/work/animation/training_takes.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/moving_take.h"
#include "tests/services/work/animation/tube_set.h"
#include "tests/services/work/animation/tube_template.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

// Sources can only be moved.
std::vector<ClothSource> OneOf(ClothSource source) {
  std::vector<ClothSource> out;
  out.push_back(std::move(source));
  return out;
}

class Sources : public testing::Test {
 protected:
  // A take without pictures, whose frames are as many mm off the rest along x.
  std::string WriteTake(const std::string& name, int frames) {
    return WriteMovingTake(folder_ / name, tube_, frames, [&](int frame) { return Moved(frame); });
  }

  std::vector<Eigen::Vector3d> Moved(double mm) const {
    std::vector<Eigen::Vector3d> out = tube_.rest.vertices_mm;
    for (Eigen::Vector3d& p : out) p.x() += mm;
    return out;
  }

  // Frames with these states: 'd'one, 'f'ailed.
  std::string WriteResults(const std::string& states) {
    const std::string path = folder_ / "result";
    v1::Job job;
    job.mutable_inputs()->set_garment(tube_.ContentHash());
    fs::create_directories(path);
    EXPECT_TRUE(WriteJsonFile(path + "/job.json", job).ok());
    for (size_t k = 0; k < states.size(); ++k) {
      const std::string frame = path + "/000" + std::to_string(k);
      fs::create_directories(frame);
      v1::FrameReport report;
      report.set_state(states[k] == 'd' ? v1::FRAME_STATE_DONE : v1::FRAME_STATE_FAILED);
      EXPECT_TRUE(WriteJsonFile(frame + "/report.json", report).ok());
      EXPECT_TRUE(WriteMesh(frame + "/mesh.ply", {Moved(static_cast<double>(k)), tube_.rest.faces}).ok());
    }
    return path;
  }

  const Template tube_ = TubeTemplate();
  TempFolder folder_;
};

TEST_F(Sources, TakeWithoutPictures) {
  auto source = OpenClothSource(WriteTake("walk", 3), 0);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_EQ(source->takes.size(), 1u);
  ClothTake& take = source->takes[0];
  EXPECT_EQ(take.frames(), 3);
  EXPECT_EQ(take.fps(), 50);
  EXPECT_EQ(take.FramesHash()->size(), 16u);
  const auto frame = take.Read(2);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_NEAR((frame->vertices_mm[7] - Moved(2)[7]).norm(), 0, 0.03);
  const auto shared = TemplateOfSources(OneOf(*std::move(source)), "");
  ASSERT_TRUE(shared.ok()) << shared.status();
  EXPECT_EQ(shared->garment.ContentHash(), tube_.ContentHash());
}

TEST_F(Sources, ResultsAreCutWhereFramesFailed) {
  auto source = OpenClothSource(WriteResults("ddfdd"), 24);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_EQ(source->takes.size(), 2u);
  EXPECT_EQ(source->takes[0].frames(), 2);
  EXPECT_EQ(source->takes[1].fps(), 24);
  EXPECT_NEAR((source->takes[1].Read(0)->vertices_mm[0] - Moved(3)[0]).norm(), 0, 1e-4);
  EXPECT_FALSE(source->takes[1].Read(2).ok());
  EXPECT_THAT(std::string(TemplateOfSources(OneOf(*std::move(source)), "").status().message()),
              HasSubstr("--template"));
}

TEST_F(Sources, OfAnotherTemplateAreRefusedWithBothNames) {
  const std::vector<ClothSource> sources = OneOf(*OpenClothSource(WriteTake("walk", 2), 0));
  Template other = tube_;
  other.rest.vertices_mm[0].x() += 1;
  ASSERT_TRUE(WriteTemplate(folder_ / "other", other).ok());
  const absl::Status status = TemplateOfSources(sources, folder_ / "other").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("walk"), HasSubstr("other"), HasSubstr(tube_.ContentHash()),
                    HasSubstr(other.ContentHash())));
}

TEST_F(Sources, DrivenResultsAreNotLearntFrom) {
  const std::string path = WriteResults("dd");
  v1::Job job;
  job.mutable_driven()->set_avatar("shirt.avatar");
  ASSERT_TRUE(WriteJsonFile(path + "/job.json", job).ok());
  const absl::Status status = OpenClothSource(path, 0).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("driven by the avatar shirt.avatar"));
}

TEST_F(Sources, NothingIsRefusedWithWhatWouldDo) {
  EXPECT_THAT(std::string(OpenClothSource(folder_ / "nothing", 0).status().message()),
              AllOf(HasSubstr("nothing"), HasSubstr("weft register"), HasSubstr("weft simulate")));
  fs::create_directories(folder_ / "begun/truth");
  std::ofstream(folder_ / "begun/truth/frames.bin.part") << "weftseq1";
  EXPECT_THAT(std::string(OpenClothSource(folder_ / "begun", 0).status().message()),
              HasSubstr("not complete"));
}

TEST_F(Sources, AnotherReaderIsOfTheSameTake) {
  auto source = OpenClothSource(WriteTake("walk", 3), 0);
  ASSERT_TRUE(source.ok()) << source.status();
  ClothTake& take = source->takes[0];
  take.split = "train";
  take.body.stature = 1.25;
  auto again = take.OpenAgain();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->name(), take.name());
  EXPECT_EQ(again->template_hash(), tube_.ContentHash());
  EXPECT_EQ(again->frames(), 3);
  EXPECT_EQ(again->fps(), 50);
  EXPECT_EQ(again->split, "train");
  EXPECT_EQ(again->motion, folder_ / "walk");
  EXPECT_EQ(again->folder, folder_ / "walk");
  EXPECT_EQ(again->body.stature, 1.25);
  EXPECT_EQ(again->Read(1)->time_ns, 20'000'000);
  EXPECT_EQ(*again->FramesHash(), *take.FramesHash());
  auto meshes = OpenClothSource(WriteResults("dd"), 25)->takes[0].OpenAgain();
  ASSERT_TRUE(meshes.ok()) << meshes.status();
  EXPECT_THAT(meshes->frame_names(), testing::ElementsAre("0000", "0001"));
  EXPECT_EQ(meshes->fps(), 25);
  EXPECT_EQ(meshes->Read(1)->time_ns, 40'000'000);
  EXPECT_EQ(*meshes->FramesHash(), "");
}

TEST_F(Sources, ResultsAreNamedAfterTheirFirstFrame) {
  const std::string path = WriteResults("fddfd");
  auto source = OpenClothSource(path, 0);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_EQ(source->takes.size(), 2u);
  EXPECT_EQ(source->takes[0].name(), path);
  EXPECT_EQ(source->takes[1].name(), path + " from 0004");
  EXPECT_EQ(source->takes[1].motion, path);
  EXPECT_EQ(source->takes[0].fps(), 30) << "as usual";
  EXPECT_EQ(source->takes[0].template_hash(), tube_.ContentHash());
  EXPECT_EQ(source->takes[0].folder, "") << "of no simulated take";
  EXPECT_FALSE(source->is_dataset);
  const absl::Status beyond = source->takes[0].Read(2).status();
  EXPECT_EQ(beyond.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(beyond.message(), path + ": holds frames 0 to 1, not 2");
  EXPECT_EQ(source->takes[0].Read(-1).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(OpenClothSource(WriteResults("fffff"), 0).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(Sources, OnlyWhatWasRegisteredFromItsOwnImagesCounts) {
  const std::string path = WriteResults("dddd");
  v1::FrameReport report;
  report.set_state(v1::FRAME_STATE_DEGRADED);
  ASSERT_TRUE(WriteJsonFile(path + "/0001/report.json", report).ok());
  report.set_state(v1::FRAME_STATE_CANCELLED);
  ASSERT_TRUE(WriteJsonFile(path + "/0002/report.json", report).ok());
  fs::remove(path + "/0003/mesh.ply");
  auto source = OpenClothSource(path, 0);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_EQ(source->takes.size(), 1u);
  EXPECT_THAT(source->takes[0].frame_names(), testing::ElementsAre("0000", "0001"));
}

TEST_F(Sources, ATemplateThatIsGivenGoesBeforeThoseOfTheSources) {
  std::vector<ClothSource> sources = OneOf(*OpenClothSource(WriteTake("walk", 2), 0));
  EXPECT_EQ(TemplateOfSources(sources, "")->path, folder_ / "walk/template");
  ASSERT_TRUE(WriteTemplate(folder_ / "same", tube_).ok());
  EXPECT_EQ(TemplateOfSources(sources, folder_ / "same")->path, folder_ / "same");
  EXPECT_EQ(TemplateOfSources({}, "").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(Sources, ATakeWithPicturesHasAMeshForEachFrame) {
  const std::string path = folder_ / "filmed";
  ASSERT_TRUE(WriteTemplate(path + "/template", tube_).ok());
  for (const char* frame : {"0000", "0001"}) {
    fs::create_directories(path + "/truth/" + frame);
    ASSERT_TRUE(
        WriteMesh(path + "/truth/" + frame + "/mesh.ply", {Moved(frame[3] - '0'), tube_.rest.faces}).ok());
  }
  auto source = OpenClothSource(path, 40);
  ASSERT_TRUE(source.ok()) << source.status();
  ASSERT_EQ(source->takes.size(), 1u);
  ClothTake& take = source->takes[0];
  EXPECT_EQ(take.name(), path);
  EXPECT_EQ(take.folder, path);
  EXPECT_EQ(take.fps(), 40);
  EXPECT_EQ(take.template_hash(), tube_.ContentHash());
  EXPECT_EQ(source->garment, path + "/template");
  EXPECT_NEAR(take.Read(1)->vertices_mm[0].x() - take.Read(0)->vertices_mm[0].x(), 1, 1e-4);
}

TEST_F(Sources, ADataSetHasItsCompleteTakesButThoseOfChaos) {
  const std::string set = WriteTubeSet(folder_ / "set");
  const auto source = OpenClothSource(set, 0);
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_TRUE(source->is_dataset);
  EXPECT_EQ(source->garment, set + "/takes/train-walk-1/template");
  std::vector<std::string> takes;
  for (const ClothTake& take : source->takes) {
    takes.push_back(take.split + " " + take.motion + " " + std::to_string(take.frames()));
    EXPECT_EQ(take.body.stature, 1.25);
    EXPECT_EQ(take.fps(), 50);
    EXPECT_TRUE(take.name().starts_with(set + "/" + take.split + "-" + take.motion + "-")) << take.name();
    EXPECT_TRUE(take.folder.starts_with(set + "/takes/" + take.split + "-")) << take.folder;
  }
  EXPECT_THAT(takes, testing::ElementsAre("train walk 30", "validate walk 12", "train twist 30",
                                          "test-known walk 30", "test-unseen reach 4"));
  v1::Dataset dataset;
  ASSERT_TRUE(ReadJsonFile(set + "/dataset.json", dataset).ok());
  for (v1::DatasetTake& take : *dataset.mutable_takes()) take.clear_frames_hash();
  ASSERT_TRUE(WriteJsonFile(set + "/dataset.json", dataset).ok());
  EXPECT_EQ(OpenClothSource(set, 0).status(),
            absl::NotFoundError(
                set + ": no take of the data set is complete; `weft dataset make` goes on with it"));
}

// Of a data set train is learnt from and validate held out, and no test is ever read.
TEST_F(Sources, TrainingTakesWhatIsForIt) {
  const std::string set = WriteTubeSet(folder_ / "set");
  const auto takes_of = [](const std::vector<std::string>& sources,
                           const std::vector<std::string>& held_out) {
    auto takes = TrainingTakes::Open(sources, held_out, "", 0);
    std::vector<std::string> out;
    EXPECT_TRUE(takes.ok()) << takes.status();
    if (!takes.ok()) return out;
    const TrainingFrames frames = takes->Frames();
    for (int t = 0; t < takes->size(); ++t) {
      const TrainingTake& take = frames.takes[static_cast<size_t>(t)];
      out.push_back(std::filesystem::path(take.name).filename().string() +
                    (takes->is_held_out(t) ? " held out" : ""));
      EXPECT_EQ(take.held_out, takes->is_held_out(t));
      EXPECT_EQ(take.frames, takes->take(t).frames());
      EXPECT_EQ(take.fps, 50);
      EXPECT_EQ(take.motion, takes->take(t).motion);
      EXPECT_EQ(*frames.read(t, 1), takes->take(t).Read(1)->vertices_mm);
    }
    return out;
  };
  EXPECT_THAT(takes_of({set}, {}),
              testing::ElementsAre("train-walk-1", "validate-walk-3 held out", "train-twist-2"));
  const std::string walk = WavingTakes::Get().walk, held = WavingTakes::Get().held;
  EXPECT_THAT(takes_of({walk}, {set}), testing::ElementsAre("walk", "validate-walk-3 held out"));
  EXPECT_THAT(takes_of({walk}, {held}), testing::ElementsAre("walk", "held held out"));
  const auto other = TrainingTakes::Open({walk}, {WriteTake("other", 2)}, "", 0);
  EXPECT_EQ(other.status().code(), absl::StatusCode::kFailedPrecondition) << "of another template";
}

}  // namespace
}  // namespace weft
