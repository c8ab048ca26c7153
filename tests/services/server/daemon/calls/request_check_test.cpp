#include "services/server/daemon/calls/request_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "services/server/rpc/error_detail.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

// The field that a status names; empty: it is OK.
std::string FieldOf(const absl::Status& status) {
  if (status.ok()) return "";
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  const auto detail = DetailOf(status);
  return detail ? detail->field() : "no detail";
}

v1::SubmitJobRequest WholeRequest() {
  v1::SubmitJobRequest request;
  v1::RegistrationSpec& spec = *request.mutable_spec();
  spec.set_dump("/takes/a");
  spec.set_rig("/rig.json");
  spec.set_board("/board.png");
  spec.set_garment("/shirt");
  spec.set_out("/results/a");
  return request;
}

TEST(CheckSubmitRequest, NamesTheFieldThatIsWrong) {
  EXPECT_EQ(FieldOf(CheckSubmitRequest({})), "spec");
  EXPECT_EQ(FieldOf(CheckSubmitRequest(WholeRequest())), "");
  const auto with = [](auto change) {
    v1::SubmitJobRequest request = WholeRequest();
    change(request, *request.mutable_spec());
    return FieldOf(CheckSubmitRequest(request));
  };
  EXPECT_EQ(with([](auto&, auto& spec) { spec.clear_rig(); }), "spec.rig");
  EXPECT_EQ(with([](auto&, auto& spec) { spec.set_dump("/a\nb"); }), "spec.dump");
  EXPECT_EQ(with([](auto&, auto& spec) { spec.set_out(std::string(4097, 'x')); }), "spec.out");
  EXPECT_EQ(with([](auto&, auto& spec) { spec.set_first_frame(-1); }), "spec.first_frame");
  EXPECT_EQ(with([](auto&, auto& spec) { spec.set_end_frame(-1); }), "spec.end_frame");
  EXPECT_EQ(with([](auto&, auto& spec) { spec.mutable_expected()->set_rig("0123"); }), "spec.expected.rig");
  EXPECT_EQ(with([](auto&, auto& spec) { spec.mutable_options()->set_preset("none"); }),
            "spec.options.preset");
  EXPECT_EQ(with([](auto& request, auto&) { request.set_out_probe("a/b"); }), "out_probe");
  EXPECT_EQ(with([](auto& request, auto&) { request.set_priority(101); }), "priority");
  EXPECT_EQ(with([](auto& request, auto&) { request.set_idempotency_key("short"); }), "idempotency_key");
}

TEST(CheckSubmitRequest, NamesTheFieldOfWorkThatIsWrong) {
  v1::WorkKindInfo info;
  info.set_name("fold");
  info.set_start(v1::WORK_START_JOB);
  v1::WorkInputInfo& input = *info.add_inputs();
  input.set_name("mesh");
  input.set_is_required(true);
  AddKindInfo(info);
  v1::SubmitJobRequest request;
  v1::WorkSpec& work = *request.mutable_spec()->mutable_work();
  for (const char* unknown : {"", "knit", "take verify", "register"}) {
    work.set_kind(unknown);
    EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.work.kind") << unknown;
  }
  work.set_kind("fold");
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.work.inputs");
  v1::NamedValue& mesh = *work.add_inputs();
  mesh.set_name("mesh");
  mesh.set_value("/mesh.ply");
  request.mutable_spec()->mutable_driving();
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.work");
  request.mutable_spec()->clear_driving();
  request.mutable_spec()->set_live_every(1);
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.work");
  request.mutable_spec()->clear_live_every();
  // No program here can do it.
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.work.kind");
}

TEST(CheckSubmitRequest, TakesRangesThatHoldAFrameAndNoneOfLiveJobs) {
  v1::SubmitJobRequest request = WholeRequest();
  v1::RegistrationSpec& spec = *request.mutable_spec();
  spec.set_first_frame(3);
  spec.set_end_frame(3);
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.end_frame");
  spec.set_end_frame(4);
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "");
  spec.set_live_every(1);
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.live_every");
  spec.clear_first_frame();
  spec.clear_end_frame();
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "");
  spec.set_live_every(1'000'001);
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.live_every");
}

TEST(CheckLimits, HaveDefaultsAndAMost) {
  EXPECT_EQ(*LimitOf(0), 100);
  EXPECT_EQ(*LimitOf(1), 1);
  EXPECT_EQ(*LimitOf(5000), 1000);
  EXPECT_EQ(FieldOf(LimitOf(-1).status()), "limit");
  EXPECT_EQ(*LimitOrAll(0), 0);
  EXPECT_EQ(*LimitOrAll(5000), 5000);
  EXPECT_EQ(FieldOf(LimitOrAll(-1).status()), "limit");
}

TEST(CheckKeys, AreFitForTheNameOfAFolder) {
  EXPECT_EQ(FieldOf(CheckKey("")), "");
  EXPECT_EQ(FieldOf(CheckKey("abcd-123")), "");
  EXPECT_EQ(FieldOf(CheckKey(std::string(64, 'a'))), "");
  for (const std::string& key : {std::string("abc-123"), std::string(65, 'a'), std::string("ABCD-1234"),
                                 std::string("../../../etc"), std::string("abcd 1234")})
    EXPECT_EQ(FieldOf(CheckKey(key)), "idempotency_key") << key;
}

TEST(CheckNames, LeadIntoNoOtherFolder) {
  EXPECT_EQ(FieldOf(CheckPlainName("name", "")), "");
  EXPECT_EQ(FieldOf(CheckPlainName("name", "..a")), "");
  for (const char* name : {".", "..", "a/b", "/", "a\x7f"})
    EXPECT_EQ(FieldOf(CheckPlainName("name", name)), "name") << name;
  EXPECT_EQ(FieldOf(CheckJobId("")), "job_id");
  EXPECT_EQ(FieldOf(CheckTakeId("20260101-a")), "");
  EXPECT_EQ(FieldOf(CheckTakeId("")), "take_id");
  EXPECT_EQ(FieldOf(CheckOffset(-1)), "offset");
}

TEST(CheckDescriptions, HaveLinesInNotesAlone) {
  v1::DescribeTakeRequest request;
  request.set_notes("first\nsecond");
  EXPECT_EQ(FieldOf(CheckDescription(request)), "");
  request.set_slate("1\n2");
  EXPECT_EQ(FieldOf(CheckDescription(request)), "slate");
  request.set_slate("12A");
  request.set_notes("bell\a");
  EXPECT_EQ(FieldOf(CheckDescription(request)), "notes");
}

TEST(CheckRehearsals, TakeNumbersInTheirRange) {
  v1::RehearseRetentionRequest request;
  request.set_ahead_days(36500);
  EXPECT_EQ(FieldOf(CheckRehearsal(request)), "");
  request.set_ahead_days(36501);
  EXPECT_EQ(FieldOf(CheckRehearsal(request)), "ahead_days");
  request.set_ahead_days(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(FieldOf(CheckRehearsal(request)), "ahead_days");
  request.set_ahead_days(1);
  request.mutable_rules()->set_keep_takes_days(-1);
  EXPECT_EQ(FieldOf(CheckRehearsal(request)), "rules.keep_takes_days");
}

TEST(CheckPriorities, AreAHundredBothWays) {
  EXPECT_EQ(FieldOf(CheckPriority(100)), "");
  EXPECT_EQ(FieldOf(CheckPriority(-100)), "");
  EXPECT_EQ(FieldOf(CheckPriority(-101)), "priority");
}

}  // namespace
}  // namespace weft
