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

TEST(CheckSubmitRequest, DrivingNeedsAnAvatar) {
  v1::SubmitJobRequest request = WholeRequest();
  request.mutable_spec()->mutable_driving();
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "spec.driving.avatar");
  request.mutable_spec()->mutable_driving()->set_avatar("/avatars/shirt");
  EXPECT_EQ(FieldOf(CheckSubmitRequest(request)), "");
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

TEST(CheckFetches, NameTheFieldThatIsWrong) {
  const auto with = [](auto change) {
    v1::FetchResultRequest request;
    request.set_job_id("j");
    request.set_kind(v1::RESULT_KIND_MESH);
    request.set_frame("0001");
    change(request);
    return std::string(CheckFetchRequest(request).message());
  };
  EXPECT_EQ(with([](auto&) {}), "");
  EXPECT_EQ(with([](auto& request) { request.set_mesh("body"); }), "");
  EXPECT_EQ(with([](auto& request) { request.clear_job_id(); }), "job_id: must not be empty");
  EXPECT_EQ(with([](auto& request) { request.clear_kind(); }), "kind: 0 is no kind of result");
  EXPECT_EQ(with([](auto& request) { request.set_kind(static_cast<v1::ResultKind>(999)); }),
            "kind: 999 is no kind of result");
  EXPECT_EQ(with([](auto& request) { request.set_offset(-1); }),
            "offset: -1 is negative; count bytes from 0");
  EXPECT_EQ(with([](auto& request) { request.set_version("a\nb"); }),
            "version: holds a control character; remove it");
  EXPECT_EQ(with([](auto& request) { request.clear_frame(); }), "frame: must not be empty");
  for (const v1::ResultKind kind : {v1::RESULT_KIND_JOB, v1::RESULT_KIND_JOB_REPORT}) {
    EXPECT_EQ(with([&](auto& request) { request.set_kind(kind); }),
              "frame: is given for a file of the whole job; leave it empty");
    EXPECT_EQ(with([&](auto& request) { request.set_kind(kind), request.clear_frame(); }), "");
  }
  EXPECT_EQ(with([](auto& request) { request.set_kind(v1::RESULT_KIND_CLOUD), request.set_mesh("body"); }),
            "mesh: is given for another kind of result; leave it empty");
  EXPECT_EQ(with([](auto& request) { request.set_mesh("../body"); }).substr(0, 6), "mesh: ");
  EXPECT_EQ(with([](auto& request) { request.set_frame("a/b"); }),
            "frame: \"a/b\" has folders; give a name without folders");
}

TEST(CheckTexts, SayHowLongTheyMayBe) {
  const std::string name(255, 'n'), path(4096, 'p');
  const std::pair<absl::Status, std::string> cases[] = {
      {CheckPlainName("name", name), ""},
      {CheckPlainName("name", name + "n"), "name: has 256 bytes; at most 255 are allowed"},
      {CheckOneLine("words", path), ""},
      {CheckOneLine("words", path + "p"), "words: has 4097 bytes; at most 4096 are allowed"},
      {CheckPageToken(path + name), ""},
      {CheckPageToken(path + name + "t"), "page_token: has 4352 bytes; at most 4351 are allowed"},
      {CheckOwner(name), ""},
      {CheckOwner(name + "n"), "owner: has 256 bytes; at most 255 are allowed"},
      {CheckJobId(name), ""},
      {CheckJobId(name + "n"), "job_id: has 256 bytes; at most 255 are allowed"},
      {CheckTakeId(name), ""},
      {CheckTakeId(name + "n"),
       "take_id: \"" + name + "\" is no id of a take; `weft take list` shows the takes"},
      {CheckTakeId("a b"), "take_id: \"a b\" is no id of a take; `weft take list` shows the takes"},
      {CheckOwner("a\x1f"), "owner: holds a control character; remove it"},
      {CheckOwner("a b"), ""},
      {CheckOffset(0), ""},
      {CheckKey("short"),
       "idempotency_key: cannot be an id; give 8 to 64 of a-z, 0-9 and \"-\", for example a UUID"},
      {CheckPriority(101), "priority: 101 is out of range; give -100 to 100"},
      {LimitOf(-1).status(), "limit: -1 is negative; give 0 for the default"},
      {LimitOrAll(-1).status(), "limit: -1 is negative; give 0 for all"}};
  for (const auto& [status, words] : cases) EXPECT_EQ(status.message(), words);
  EXPECT_EQ(*LimitOf(1000), 1000);
  EXPECT_EQ(*LimitOf(1001), 1000);
  v1::DescribeTakeRequest request;
  request.set_name(name);
  request.set_notes(path);
  EXPECT_TRUE(CheckDescription(request).ok());
  request.set_notes(path + "n");
  EXPECT_EQ(CheckDescription(request).message(), "notes: has 4097 bytes; at most 4096 are allowed");
  request.set_name(name + "n");
  EXPECT_EQ(CheckDescription(request).message(), "name: has 256 bytes; at most 255 are allowed");
}

TEST(CheckSubmitRequest, SaysWhatToDoInstead) {
  const auto with = [](auto change) {
    v1::SubmitJobRequest request = WholeRequest();
    change(*request.mutable_spec());
    return std::string(CheckSubmitRequest(request).message());
  };
  const std::string live = "; give 1 to 1000000, or 0 for a take that has ended";
  EXPECT_EQ(with([](auto& spec) { spec.set_live_every(-1); }), "spec.live_every: -1 is out of range" + live);
  EXPECT_EQ(with([](auto& spec) { spec.set_live_every(1'000'001); }),
            "spec.live_every: 1000001 is out of range" + live);
  EXPECT_EQ(with([](auto& spec) { spec.set_live_every(1'000'000); }), "");
  const std::string ranges = "spec.live_every: is given with a range of frames; leave one of them out";
  EXPECT_EQ(with([](auto& spec) { spec.set_live_every(1), spec.set_frames("0:3"); }), ranges);
  EXPECT_EQ(with([](auto& spec) { spec.set_live_every(1), spec.set_first_frame(1); }), ranges);
  EXPECT_EQ(with([](auto& spec) { spec.set_live_every(1), spec.set_end_frame(1); }), ranges);
  EXPECT_EQ(with([](auto& spec) { spec.set_first_frame(-1); }),
            "spec.first_frame: -1 is negative; count from 0");
  EXPECT_EQ(with([](auto& spec) { spec.set_end_frame(-1); }),
            "spec.end_frame: -1 is negative; give 0 for all frames");
  EXPECT_EQ(with([](auto& spec) { spec.set_first_frame(3), spec.set_end_frame(3); }),
            "spec.end_frame: 3 is not beyond spec.first_frame (3); give a later one, or 0 for all frames");
  for (const char* bad : {"0123456789abcde", "0123456789abcdef0", "0123456789abcdeg"}) {
    const std::string fault = std::string(": \"") + bad + "\" is no hash; give 16 hex digits, or nothing";
    EXPECT_EQ(with([&](auto& spec) { spec.mutable_expected()->set_rig(bad); }), "spec.expected.rig" + fault);
    EXPECT_EQ(with([&](auto& spec) { spec.mutable_expected()->set_board(bad); }),
              "spec.expected.board" + fault);
    EXPECT_EQ(with([&](auto& spec) { spec.mutable_expected()->set_garment(bad); }),
              "spec.expected.garment" + fault);
  }
  EXPECT_EQ(with([](auto& spec) { spec.mutable_expected()->set_rig("0123456789ABCDEF"); }), "");
  EXPECT_EQ(with([](auto& spec) { spec.set_frames("a\nb"); }),
            "spec.frames: holds a control character; remove it");
  EXPECT_EQ(with([](auto& spec) { spec.mutable_options()->set_mosaic("a\nb"); }),
            "spec.options.mosaic: holds a control character; remove it");
  EXPECT_EQ(with([](auto& spec) { spec.mutable_options()->set_cloud_format("a\nb"); }),
            "spec.options.cloud_format: holds a control character; remove it");
  EXPECT_EQ(with([](auto& spec) { spec.clear_dump(); }), "spec.dump: must not be empty");
}

TEST(CheckPriorities, AreAHundredBothWays) {
  EXPECT_EQ(FieldOf(CheckPriority(100)), "");
  EXPECT_EQ(FieldOf(CheckPriority(-100)), "");
  EXPECT_EQ(FieldOf(CheckPriority(-101)), "priority");
}

}  // namespace
}  // namespace weft
