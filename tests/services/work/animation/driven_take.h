// A small take with pictures, an avatar that has learnt the garment's motion, and what it makes of the take.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/formats/synthetic/take_writer.h"
#include "services/work/animation/drive_frames.h"
#include "services/work/animation/driven_frame.h"
#include "services/work/animation/train_avatar.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/moving_take.h"
#include "tests/simulation/tiny_take.h"

namespace weft {

inline constexpr int kDriven = 3, kCameras = 3, kLearntOf = 14;

// Made once for all tests of a suite; each changes copies.
struct DrivenTake {
  TempFolder folder;
  std::string root = std::filesystem::canonical(folder.path()).string();
  std::string take = root + "/take", avatar = root + "/tiny.avatar", out = root + "/out";

  DrivenTake() {
    SyntheticTake filmed = Tiny(1, kDriven, kCameras);
    EXPECT_TRUE(WriteSyntheticTake(filmed, *TakeFolder::Open(take, "test")).ok());
    SyntheticTake moving = Tiny(1, kLearntOf, kCameras);
    AvatarRequest request;
    request.sources = {WriteMovingTake(root + "/cloth", moving.garment(), kLearntOf,
                                       [&](int) { return moving.NextCloth()->vertices_mm; })};
    request.garment = take + "/template";
    request.training = {.components = 4, .calibration_frames = 2};
    request.out = avatar;
    const auto trained = TrainAvatar(request, {}, {});
    EXPECT_TRUE(trained.ok()) << trained.status();
  }
};

inline DrivenTake* driven_take = nullptr;

class DrivenTakeTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    driven_take = new DrivenTake;
    Told told;
    const absl::Status status = Drive(SpecOf(driven_take->take), {0, 1, 2}, driven_take->out, told);
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_THAT(told.lines, testing::ElementsAre("started 0000", "finished 0000", "started 0001",
                                                 "finished 0001", "started 0002", "finished 0002"));
  }
  static void TearDownTestSuite() { delete driven_take; }

  struct Told {
    std::vector<std::string> lines;
    std::vector<v1::FrameInfo> infos;
  };
  static v1::RegistrationSpec SpecOf(const std::string& take) {
    v1::RegistrationSpec spec;
    spec.set_dump(take);
    spec.set_rig(take + "/rig.json");
    spec.set_board(take + "/board.json");
    spec.set_garment(take + "/template");
    spec.set_out("unused");
    spec.mutable_driving()->set_avatar(driven_take->avatar);
    *spec.mutable_options() = *EffectiveDriveOptions({});
    return spec;
  }
  static absl::Status Drive(const v1::RegistrationSpec& spec, const std::vector<size_t>& asked,
                            const std::string& out, Told& told, int threads = 2, std::stop_token stop = {}) {
    const auto inputs = LoadDriveInputs(spec);
    if (!inputs.ok()) return inputs.status();
    const auto list = ListDriveFrames(spec, **inputs);
    if (!list.ok()) return list.status();
    RegistrationEvents events;
    events.started = [&](const std::string& frame) { told.lines.push_back("started " + frame); };
    events.finished = [&](const v1::FrameInfo& info) {
      told.lines.push_back((info.reused() ? "reused " : "finished ") + info.frame());
      told.infos.push_back(info);
    };
    return DriveFrames(spec, **inputs, *list, asked, out, threads, events, stop);
  }
  Told DriveAll(const v1::RegistrationSpec& spec, const std::vector<size_t>& asked = {0, 1, 2}) {
    Told told;
    const absl::Status status = Drive(spec, asked, out_, told);
    EXPECT_TRUE(status.ok()) << status;
    return told;
  }
  void BeginWithAll() {
    std::filesystem::copy(driven_take->out, out_, std::filesystem::copy_options::recursive);
  }
  std::string TakeOfOwn() {
    std::filesystem::copy(driven_take->take, root_ + "/take", std::filesystem::copy_options::recursive);
    return root_ + "/take";
  }
  static v1::FrameReport ReportOf(const std::string& out, const std::string& frame) {
    v1::FrameReport report;
    EXPECT_TRUE(ReadJsonFile(out + "/" + frame + "/report.json", report).ok());
    return report;
  }
  static std::string Mesh(const std::string& out, const std::string& frame) {
    return ReadBytes(out + "/" + frame + "/mesh.ply");
  }
  void Change(const std::string& frame, const std::function<void(v1::FrameReport&)>& change) {
    v1::FrameReport report = ReportOf(out_, frame);
    change(report);
    ASSERT_TRUE(WriteJsonFile(out_ + "/" + frame + "/report.json", report).ok());
  }
  // "0001: why", with a star where its inputs changed.
  std::vector<std::string> Incomplete(const std::vector<v1::FrameState>& states, const std::string& take) {
    v1::Job job;
    *job.mutable_spec() = SpecOf(take);
    job.mutable_spec()->set_out(out_);
    const auto inputs = LoadDriveInputs(job.spec());
    const auto list = ListDriveFrames(job.spec(), **inputs);
    std::vector<v1::FrameInfo> infos(states.size());
    for (size_t k = 0; k < states.size(); ++k)
      infos[k].set_frame("000" + std::to_string(k)), infos[k].set_state(states[k]);
    const auto found = FindIncompleteDriven(**inputs, *list, job, infos);
    EXPECT_TRUE(found.ok()) << found.status();
    std::vector<std::string> lines;
    for (const IncompleteFrame& frame : *found)
      lines.push_back(infos[frame.position].frame() + ": " + frame.why + (frame.inputs_changed ? "*" : ""));
    return lines;
  }

  const TempFolder temp_;
  const std::string root_ = std::filesystem::canonical(temp_.path()).string(), out_ = root_ + "/out";
  static constexpr v1::FrameState kDone = v1::FRAME_STATE_DONE;
};

}  // namespace weft
