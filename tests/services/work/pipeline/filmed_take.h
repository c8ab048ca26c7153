// A small take that was filmed and registered.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/formats/synthetic/take_writer.h"
#include "services/work/pipeline/registration.h"
#include "tests/capture/temp_folder.h"
#include "tests/simulation/tiny_take.h"

namespace weft {

inline constexpr int kFilmedFrames = 3, kFilming = 10;

// Filmed and registered once, for all tests; each changes copies.
struct FilmedTake {
  TempFolder folder;
  std::string take, out;
  std::vector<std::string> told;  // what the registration told
  std::vector<v1::FrameInfo> infos;
  std::map<std::string, std::vector<double>> shares;

  FilmedTake() {
    const std::string root = std::filesystem::canonical(folder.path()).string();
    take = root + "/take", out = root + "/out";
    SyntheticTake filmed = Tiny(1, kFilmedFrames, kFilming);
    const auto written = WriteSyntheticTake(filmed, *TakeFolder::Open(take, "test"));
    EXPECT_TRUE(written.ok()) << written.status();
  }
};

inline FilmedTake* filmed_take = nullptr;

class FilmedTakeTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    filmed_take = new FilmedTake;
    FilmedTake& filmed = *filmed_take;
    RegistrationEvents events;
    events.started = [&](const std::string& frame) { filmed.told.push_back("started " + frame); };
    events.advanced = [&](const std::string& frame, double share) { filmed.shares[frame].push_back(share); };
    events.finished = [&](const v1::FrameInfo& info) {
      filmed.told.push_back("finished " + info.frame());
      filmed.infos.push_back(info);
    };
    events.reads = [&](size_t index) {
      filmed.told.push_back("reads " + std::to_string(index));
      return absl::OkStatus();
    };
    const absl::Status status = Register(SpecOf(filmed.take), {0, 1, 2}, filmed.out, events, {.threads = 2});
    ASSERT_TRUE(status.ok()) << status;
  }
  static void TearDownTestSuite() { delete filmed_take; }

  static v1::RegistrationSpec SpecOf(const std::string& take) {
    v1::RegistrationSpec spec;
    spec.set_dump(take);
    spec.set_rig(take + "/rig.json");
    spec.set_board(take + "/board.json");
    spec.set_garment(take + "/template");
    spec.set_out("unused");
    return spec;
  }
  static absl::Status Register(const v1::RegistrationSpec& spec, const std::vector<size_t>& frames,
                               const std::string& out, const RegistrationEvents& events = {},
                               const RegistrationLimits& limits = {}, std::stop_token stop = {}) {
    const auto inputs = LoadInputs(spec);
    if (!inputs.ok()) return inputs.status();
    return RegisterFrames(**inputs, {0, 1, 2}, frames, spec.options(), out, limits, events, std::move(stop));
  }
  // Into a folder of its own; what it told last.
  v1::FrameInfo RegisterOne(const v1::RegistrationSpec& spec, const RegistrationLimits& limits = {},
                            size_t frame = 0) {
    v1::FrameInfo last;
    RegistrationEvents events;
    events.finished = [&](const v1::FrameInfo& info) { last = info; };
    const absl::Status status = Register(spec, {frame}, out_, events, limits);
    EXPECT_TRUE(status.ok()) << status;
    return last;
  }
  // A copy of the take whose pictures may be changed.
  std::string TakeOfOwn() {
    std::filesystem::copy(filmed_take->take, root_ + "/take", std::filesystem::copy_options::recursive);
    return root_ + "/take";
  }
  static v1::FrameReport ReportOf(const std::string& out, const std::string& frame = "0000") {
    v1::FrameReport report;
    EXPECT_TRUE(ReadJsonFile(out + "/" + frame + "/report.json", report).ok());
    return report;
  }
  v1::FrameReport Report() const { return ReportOf(out_); }
  static std::vector<std::string> StagesOf(const v1::FrameReport& report) {
    std::vector<std::string> stages;
    for (const v1::StageTime& stage : report.stages()) stages.push_back(stage.stage());
    return stages;
  }
  static std::string Filed(const std::string& name) { return ReadBytes(filmed_take->out + "/" + name); }
  std::string Bytes(const std::string& name) const { return ReadBytes(out_ + "/0000/" + name); }

  const TempFolder temp_;
  const std::string root_ = std::filesystem::canonical(temp_.path()).string(), out_ = root_ + "/out";
};

}  // namespace weft
