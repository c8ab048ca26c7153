// A small take from its pictures to driven meshes, by everything that driving consists of.
#include "services/work/animation/drive_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/rig_file.h"
#include "services/work/animation/driver_memory.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "services/work/pipeline/frame_folder.h"
#include "tests/animation/recorded.h"
#include "tests/services/work/animation/driven_take.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using DriveFramesTest = DrivenTakeTest;

TEST_F(DriveFramesTest, MeshesLieOnTheTruth) {
  for (const char* frame : {"0000", "0001", "0002"}) {
    const auto mesh = ReadRegisteredMesh(driven_take->out + "/" + frame + "/mesh.ply");
    const auto truth = ReadMesh(driven_take->take + "/truth/" + frame + "/mesh.ply");
    ASSERT_TRUE(mesh.ok() && truth.ok()) << mesh.status() << truth.status();
    double sum_mm = 0;
    for (size_t v = 0; v < mesh->vertices_mm.size(); ++v)
      sum_mm += (mesh->vertices_mm[v] - truth->vertices_mm[v]).norm();
    EXPECT_LT(sum_mm / static_cast<double>(mesh->vertices_mm.size()), 2) << frame;
  }
}

TEST_F(DriveFramesTest, ReportsSayWhatTheDriverKnew) {
  const auto inputs = LoadDriveInputs(SpecOf(driven_take->take));
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  const StageKeys keys = DriveKeys(SpecOf(driven_take->take), **inputs);
  ASSERT_EQ(keys.size(), 2);
  EXPECT_EQ(keys[0].stage(), "decode");
  EXPECT_EQ(keys[0].version(), AlgorithmVersion(Stage::kDecode));
  EXPECT_EQ(keys[1].stage(), "drive");
  EXPECT_EQ(keys[1].version(), kDriveVersion);
  std::string memory;
  for (const char* frame : {"0000", "0001", "0002"}) {
    const v1::FrameReport report = ReportOf(driven_take->out, frame);
    EXPECT_EQ(report.frame(), frame);
    EXPECT_EQ(report.state(), kDone);
    EXPECT_EQ(report.reason(), "");
    EXPECT_TRUE(AreEqual(report.keys(), keys));
    EXPECT_EQ(report.inputs().garment(), (*inputs)->garment.ContentHash());
    EXPECT_EQ(report.inputs().rig(), (*inputs)->rig.ContentHash());
    EXPECT_TRUE(report.options().frames_alone());
    EXPECT_FALSE(report.images_fingerprint().empty());
    EXPECT_FALSE(report.weft_version().empty());
    EXPECT_EQ(report.views_used(), kCameras);
    EXPECT_EQ(report.views_missing(), 0);
    ASSERT_EQ(report.views_size(), kCameras);
    EXPECT_GT(report.views(2).centers(), 50);
    EXPECT_GT(report.views(2).bias().observations(), 20);
    EXPECT_EQ(report.driven().started_anew(), memory.empty());
    EXPECT_EQ(report.driven().follows(), MemoryChecksum(memory));
    EXPECT_NE(report.driven().memory(), memory);
    EXPECT_GT(report.driven().rays(), 200);
    EXPECT_LT(report.driven().rejected_rays(), report.driven().rays());
    EXPECT_GT(report.driven().residual_px(), 0);
    EXPECT_LT(report.driven().residual_px(), 5);
    EXPECT_GT(report.driven().median_sigma_mm(), 0);
    EXPECT_EQ(report.mesh().vertices(), static_cast<int>((*inputs)->garment.rest.vertices_mm.size()));
    EXPECT_EQ(report.stages(0).stage(), "decode");
    EXPECT_GE(report.stages_size(), 2);
    EXPECT_GT(report.total_ms(), 0);
    EXPECT_EQ(report.threads(), 2);
    ASSERT_EQ(report.files_size(), 1);
    EXPECT_EQ(report.files(0).name(), "mesh.ply");
    memory = report.driven().memory();
  }
}

TEST_F(DriveFramesTest, CompleteFramesAreKept) {
  BeginWithAll();
  const Told told = DriveAll(SpecOf(driven_take->take));
  EXPECT_THAT(told.lines, ElementsAre("reused 0000", "reused 0001", "reused 0002"));
  EXPECT_EQ(told.infos[1].state(), kDone);
  // The driver goes on from what it knew then.
  fs::remove_all(out_ + "/0002");
  EXPECT_THAT(DriveAll(SpecOf(driven_take->take)).lines,
              ElementsAre("reused 0000", "reused 0001", "started 0002", "finished 0002"));
  EXPECT_TRUE(Mesh(out_, "0002") == Mesh(driven_take->out, "0002"));
}

TEST_F(DriveFramesTest, FramesBeforeTheAskedOnesAreDrivenAndNotTold) {
  EXPECT_THAT(DriveAll(SpecOf(driven_take->take), {2}).lines, ElementsAre("started 0002", "finished 0002"));
  for (const char* frame : {"0000", "0001", "0002"})
    EXPECT_TRUE(Mesh(out_, frame) == Mesh(driven_take->out, frame)) << frame;
  fs::remove_all(out_);
  EXPECT_THAT(DriveAll(SpecOf(driven_take->take), {0}).lines, ElementsAre("started 0000", "finished 0000"));
  EXPECT_FALSE(fs::exists(out_ + "/0001"));
  EXPECT_THAT(DriveAll(SpecOf(driven_take->take), {}).lines, IsEmpty());
}

TEST_F(DriveFramesTest, AFrameThatWasSetAsideIsPassedOver) {
  BeginWithAll();
  fs::remove_all(out_ + "/0001");
  fs::remove_all(out_ + "/0002");
  fs::create_directories(out_ + "/0001");
  v1::FrameReport aside;
  aside.set_frame("0001"), aside.set_state(v1::FRAME_STATE_FAILED), aside.set_set_aside(true);
  ASSERT_TRUE(FrameFolder::Open(out_, "0001", ConfinedFolder::IfMissing::kMake)->Commit(aside).ok());
  DriveAll(SpecOf(driven_take->take), {2});
  EXPECT_TRUE(ReportOf(out_, "0001").set_aside());
  EXPECT_EQ(ReportOf(out_, "0002").driven().follows(),
            MemoryChecksum(ReportOf(out_, "0000").driven().memory()));
  EXPECT_THAT(Incomplete({kDone, v1::FRAME_STATE_FAILED, kDone}, driven_take->take), IsEmpty());
  EXPECT_THAT(DriveAll(SpecOf(driven_take->take), {1}).lines, ElementsAre("started 0001", "finished 0001"));
}

TEST_F(DriveFramesTest, OtherPicturesAreDrivenAgainAndWhatFollowsThem) {
  BeginWithAll();
  const std::string take = TakeOfOwn();
  fs::copy_file(take + "/0002/c01.png", take + "/0001/c01.png", fs::copy_options::overwrite_existing);
  // The copies have times of their own, so that all are other pictures.
  EXPECT_THAT(DriveAll(SpecOf(take)).lines, ElementsAre("started 0000", "finished 0000", "started 0001",
                                                        "finished 0001", "started 0002", "finished 0002"));
  EXPECT_THAT(DriveAll(SpecOf(take)).lines, ElementsAre("reused 0000", "reused 0001", "reused 0002"));
  WriteBytes(take + "/0001/c01.png", "no picture");
  const Told told = DriveAll(SpecOf(take));
  EXPECT_THAT(told.lines,
              ElementsAre("reused 0000", "started 0001", "finished 0001", "started 0002", "finished 0002"));
  EXPECT_EQ(told.infos[1].state(), v1::FRAME_STATE_DEGRADED);
  EXPECT_EQ(told.infos[1].reason(), "1 of 3 cameras have no usable image");
  EXPECT_EQ(ReportOf(out_, "0001").views_missing(), 1);
  EXPECT_EQ(ReportOf(out_, "0001").views_used(), 2);
}

TEST_F(DriveFramesTest, AFrameInTheDarkIsLostAndTheNextFoundAnew) {
  const std::string take = TakeOfOwn();
  for (const char* camera : {"c00", "c01", "c02"}) WriteBytes(take + "/0001/" + camera + ".png", "dark");
  const Told told = DriveAll(SpecOf(take));
  EXPECT_EQ(told.infos[1].state(), v1::FRAME_STATE_FAILED);
  EXPECT_THAT(told.infos[1].reason(), HasSubstr("; 3 of 3 cameras have no usable image"));
  EXPECT_FALSE(fs::exists(out_ + "/0001/mesh.ply"));
  EXPECT_EQ(ReportOf(out_, "0001").mesh().vertices(), 0);
  EXPECT_EQ(ReportOf(out_, "0001").driven().median_sigma_mm(), 0);
  EXPECT_EQ(told.infos[2].state(), kDone);
  EXPECT_THAT(Incomplete({kDone, v1::FRAME_STATE_FAILED, kDone}, take), IsEmpty());
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}, take),
              ElementsAre("0001: is in another state than its report says"));
  EXPECT_THAT(DriveAll(SpecOf(take)).lines, ElementsAre("reused 0000", "reused 0001", "reused 0002"));
}

TEST_F(DriveFramesTest, SomeCamerasOfTheRig) {
  v1::RegistrationSpec spec = SpecOf(driven_take->take);
  spec.mutable_driving()->add_cameras("c02");
  spec.mutable_driving()->add_cameras("c00");
  spec.mutable_options()->set_write_observations(true);
  BeginWithAll();
  EXPECT_THAT(DriveAll(spec, {0}).lines, ElementsAre("started 0000", "finished 0000"));
  const v1::FrameReport report = ReportOf(out_, "0000");
  ASSERT_EQ(report.views_size(), 2);
  EXPECT_EQ(report.views(0).camera(), "c00");
  EXPECT_EQ(report.views(1).camera(), "c02");
  EXPECT_EQ(report.unknown_cameras_size(), 0);
  EXPECT_EQ(report.inputs().rig(), ReportOf(driven_take->out, "0000").inputs().rig()) << "of all its cameras";
  const auto images = ReadObservations(out_ + "/0000/observations.csv");
  ASSERT_TRUE(images.ok()) << images.status();
  ASSERT_EQ(images->size(), 2u);
  EXPECT_EQ((*images)[1].image, "c02");
  EXPECT_EQ(static_cast<int>((*images)[1].observations.size()),
            report.views(1).centers() + report.views(1).corners());
  const auto inputs = LoadDriveInputs(spec);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  const v1::DrivenJob driven = DescribeDriving(spec, **inputs);
  EXPECT_EQ(driven.avatar(), driven_take->avatar);
  EXPECT_EQ(driven.avatar_checksum(), ChecksumOfAvatar((*inputs)->avatar.about));
  EXPECT_THAT(driven.cameras(), ElementsAre("c00", "c02"));
}

TEST_F(DriveFramesTest, ObservationsThatAreAskedForLaterAreWritten) {
  BeginWithAll();
  v1::RegistrationSpec spec = SpecOf(driven_take->take);
  spec.mutable_options()->set_write_observations(true);
  EXPECT_THAT(DriveAll(spec, {0}).lines, ElementsAre("started 0000", "finished 0000"));
  EXPECT_TRUE(fs::exists(out_ + "/0000/observations.csv"));
  EXPECT_TRUE(Mesh(out_, "0000") == Mesh(driven_take->out, "0000"));
  EXPECT_THAT(DriveAll(spec, {0}).lines, ElementsAre("reused 0000"));
}

TEST_F(DriveFramesTest, IncompleteFramesAreFound) {
  BeginWithAll();
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}, driven_take->take), IsEmpty());
  Change("0001", [](v1::FrameReport& report) { report.mutable_driven()->set_follows("0123"); });
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}, driven_take->take),
              ElementsAre("0001: does not follow the frame before it"));
  EXPECT_THAT(Incomplete({v1::FRAME_STATE_WAITING, kDone, kDone}, driven_take->take), IsEmpty())
      << "nobody knows what it follows";
  WriteBytes(out_ + "/0000/mesh.ply", "damaged");
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}, driven_take->take),
              ElementsAre("0000: is not as this job wrote it"));
  Change("0002", [](v1::FrameReport& report) { report.set_images_fingerprint("others"); });
  fs::remove_all(out_ + "/0000");
  EXPECT_THAT(Incomplete({kDone, kDone, kDone}, driven_take->take),
              ElementsAre("0000: is not as this job wrote it", "0002: is not as this job wrote it*"));
  fs::remove_all(out_);
  EXPECT_EQ(Incomplete({kDone, kDone, kDone}, driven_take->take).size(), 3u);
}

TEST_F(DriveFramesTest, KeysDifferWhereResultsMay) {
  v1::RegistrationSpec spec = SpecOf(driven_take->take);
  const auto inputs = LoadDriveInputs(spec);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  const StageKeys keys = DriveKeys(spec, **inputs);
  EXPECT_TRUE(AreEqual(keys, DriveKeys(spec, **inputs, DrivePace::kEveryFrame)));
  EXPECT_FALSE(AreEqual(keys, DriveKeys(spec, **inputs, DrivePace::kLive)));
  spec.mutable_driving()->set_fps(25);
  EXPECT_FALSE(AreEqual(keys, DriveKeys(spec, **inputs)));
  spec = SpecOf(driven_take->take);
  (*inputs)->rig.cameras.pop_back();
  EXPECT_FALSE(AreEqual(keys, DriveKeys(spec, **inputs)));
}

TEST_F(DriveFramesTest, StopsBeforeAndWithinAFrame) {
  std::stop_source stop;
  Told told;
  stop.request_stop();
  const absl::Status status = Drive(SpecOf(driven_take->take), {0}, out_, told, 1, stop.get_token());
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_THAT(told.lines, IsEmpty());
  EXPECT_FALSE(fs::exists(out_ + "/0000"));
}

TEST_F(DriveFramesTest, ARigInMetresIsRefusedWithBothNames) {
  Rig rig = *ReadRig(driven_take->take + "/rig.json");
  for (CameraModel& camera : rig.cameras) camera.translation_mm /= 1000;
  ASSERT_TRUE(WriteRig(root_ + "/metres.json", rig).ok());
  v1::RegistrationSpec spec = SpecOf(driven_take->take);
  spec.set_rig(root_ + "/metres.json");
  Told told;
  const absl::Status status = Drive(spec, {0}, out_, told);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("metres.json"), HasSubstr("in metres"),
                                                   HasSubstr(driven_take->take + "/template")));
}

TEST_F(DriveFramesTest, FramesHaveTheTimesOfTheirTakeOrThoseAskedFor) {
  v1::RegistrationSpec spec = SpecOf(driven_take->take);
  const auto inputs = LoadDriveInputs(spec);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  auto list = ListDriveFrames(spec, **inputs);
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_THAT(list->Names(), ElementsAre("0000", "0001", "0002"));
  ASSERT_EQ(list->time_ns.size(), 3u);
  EXPECT_EQ(list->time_ns[0], 0);
  EXPECT_EQ(list->time_ns[2], 66'666'667) << "30 a second";
  spec.mutable_driving()->set_fps(10);
  spec.set_first_frame(1);
  list = ListDriveFrames(spec, **inputs);
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_THAT(list->Names(), ElementsAre("0001", "0002"));
  EXPECT_THAT(list->time_ns, ElementsAre(100'000'000, 200'000'000));
  spec.set_end_frame(9);
  EXPECT_EQ(ListDriveFrames(spec, **inputs).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE((*inputs)->warnings.empty());
}

TEST_F(DriveFramesTest, InputsThatDoNotBelongTogetherAreRefused) {
  const auto why_not = [](auto&& change) {
    v1::RegistrationSpec spec = SpecOf(driven_take->take);
    change(spec);
    return std::string(LoadDriveInputs(spec).status().message());
  };
  EXPECT_EQ(why_not([](auto&) {}), "");
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_driving()->clear_avatar(); }),
              HasSubstr("spec.driving.avatar is empty"));
  EXPECT_THAT(why_not([](auto& spec) { spec.clear_out(); }), HasSubstr("spec.out is empty"));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_driving()->set_fps(-1); }), HasSubstr("--fps"));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_driving()->set_fps(INFINITY); }), HasSubstr("--fps"));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_driving()->add_cameras("front"); }), HasSubstr("front"));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_expected()->set_board("0123"); }),
              HasSubstr("the board has hash"));
  EXPECT_THAT(why_not([](auto& spec) { spec.mutable_options()->set_preset("fastest"); }),
              HasSubstr("fastest"));
}

TEST(EffectiveDriveOptions, AreThoseOfTheDecodingAlone) {
  v1::RegistrationOptions asked;
  asked.set_write_observations(true);
  const auto options = EffectiveDriveOptions(asked);
  ASSERT_TRUE(options.ok()) << options.status();
  EXPECT_TRUE(options->frames_alone());
  EXPECT_TRUE(options->single_pass());
  EXPECT_TRUE(options->write_observations());
  EXPECT_TRUE(options->pipeline().has_decode());
  EXPECT_FALSE(options->pipeline().has_alignment());
  EXPECT_FALSE(options->pipeline().has_triangulation());
  asked.set_preset("fastest");
  EXPECT_FALSE(EffectiveDriveOptions(asked).ok());
}

// All that a report tells of a driven frame, but for what differs from run to run and from version to
// version.
std::string DrivenReportText(v1::FrameReport report) {
  report.clear_stages(), report.clear_total_ms(), report.clear_weft_version(),
      report.clear_images_fingerprint();
  report.clear_keys(), report.clear_options(), report.clear_files();
  report.mutable_driven()->clear_memory(), report.mutable_driven()->clear_follows();
  for (v1::ViewReport& view : *report.mutable_views()) {
    view.clear_read_ms(), view.clear_lattice_ms(), view.clear_colors_ms(), view.clear_growth_ms();
    view.clear_refinement_ms();
  }
  return *ToJson(report, JsonZeros::kOmitted);
}

TEST_F(DriveFramesTest, ReportsStayAsTheyAre) {
  ExpectRecorded(DrivenReportText(ReportOf(driven_take->out, "0001")));
  const std::string take = TakeOfOwn();
  for (const char* camera : {"c00", "c02"}) WriteBytes(take + "/0000/" + camera + ".png", "dark");
  v1::RegistrationSpec spec = SpecOf(take);
  DriveAll(spec, {0});
  v1::FrameReport report = ReportOf(out_, "0000");
  for (v1::ViewReport& view : *report.mutable_views())  // which name the folder
    if (!view.missing_reason().empty()) view.set_missing_reason("missing");
  ExpectRecorded(DrivenReportText(report), ".one-camera");
}

TEST_F(DriveFramesTest, PicturesOfOtherCamerasAreWarnedOf) {
  const std::string take = TakeOfOwn();
  fs::copy_file(take + "/0000/c01.png", take + "/0000/spare.png");
  v1::RegistrationSpec spec = SpecOf(take);
  const auto inputs = LoadDriveInputs(spec);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  ASSERT_TRUE(ListDriveFrames(spec, **inputs).ok());
  ASSERT_EQ((*inputs)->warnings.size(), 1u);
  EXPECT_THAT((*inputs)->warnings[0], HasSubstr("spare"));
  DriveAll(spec, {0});
  EXPECT_THAT(ReportOf(out_, "0000").unknown_cameras(), ElementsAre("spare"));
  // Those that are left out on purpose are no strangers.
  for (const char* camera : {"c00", "c01", "c02"}) spec.mutable_driving()->add_cameras(camera);
  (*inputs)->warnings.clear();
  ASSERT_TRUE(ListDriveFrames(spec, **inputs).ok());
  EXPECT_THAT((*inputs)->warnings, IsEmpty());
  fs::remove_all(out_);
  DriveAll(spec, {0});
  EXPECT_THAT(ReportOf(out_, "0000").unknown_cameras(), IsEmpty());
}

}  // namespace
}  // namespace weft
