// weft take start, stop, watch, list, pin, delete, restore, empty-trash: what is asked of a daemon, and what
// it answers in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Notes every call, and answers what it was told.
class ToldTakes final : public v1::Takes::Service {
 public:
  std::vector<std::string> asked;
  v1::RecordedTake answer;
  std::vector<v1::RecordedTake> watched;
  v1::ListTakesResponse list;
  v1::StartTakeRequest started;

 private:
  using Context = grpc::ServerContext;
  template <typename Request>
  grpc::Status Answer(const std::string& call, const Request& request, v1::RecordedTake* out) {
    asked.push_back(call + " " + TextOf(request));
    *out = answer;
    return grpc::Status::OK;
  }
  grpc::Status StartTake(Context*, const v1::StartTakeRequest* request, v1::RecordedTake* out) override {
    started = *request;
    *out = answer;
    return grpc::Status::OK;
  }
  grpc::Status StopTake(Context*, const v1::StopTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("stop", *request, out);
  }
  grpc::Status PinTake(Context*, const v1::PinTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("pin", *request, out);
  }
  grpc::Status DescribeTake(Context*, const v1::DescribeTakeRequest* request,
                            v1::RecordedTake* out) override {
    return Answer("describe", *request, out);
  }
  grpc::Status DeleteTake(Context*, const v1::DeleteTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("delete", *request, out);
  }
  grpc::Status RestoreTake(Context*, const v1::RestoreTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("restore", *request, out);
  }
  grpc::Status ListTakes(Context*, const v1::ListTakesRequest* request, v1::ListTakesResponse* out) override {
    asked.push_back("list " + TextOf(*request));
    *out = list;
    return grpc::Status::OK;
  }
  grpc::Status EmptyTrash(Context*, const v1::EmptyTrashRequest* request,
                          v1::EmptyTrashResponse* out) override {
    asked.push_back("empty " + TextOf(*request));
    out->set_takes(3);
    out->set_bytes(1'234'000'000);
    return grpc::Status::OK;
  }
  grpc::Status WatchTake(Context*, const v1::WatchTakeRequest* request,
                         grpc::ServerWriter<v1::RecordedTake>* out) override {
    asked.push_back("watch " + TextOf(*request));
    for (const v1::RecordedTake& take : watched) out->Write(take);
    return grpc::Status::OK;
  }
};

class CommandTakeRemote : public ::testing::Test {
 protected:
  CommandTakeRemote() {
    setenv("TZ", "UTC", 1);
    tzset();
    unsetenv("WEFT_LEASE");
    WriteBytes(folder_ / "session.json",
               R"({"cameras": [{"id": "c01", "gige": {"device": "192.168.1.7"}}]})");
  }
  AloudRun Take(std::vector<std::string> words) const {
    words.insert(words.end(), {"--server", daemon_.address()});
    return RunAloud(AddRemoteTakeCommands, std::move(words));
  }

  ToldTakes takes_;
  AnsweringDaemon daemon_{{&takes_}};
  const TempFolder folder_;
};

constexpr char kFull[] = R"(
  id: "t1" folder: "/takes/t1" timecode: "10:00:00:00"
  keeping { pinned: true slate: "12A" name: "walk" deleted_because: "asked for" }
  state { phase: RECORDER_PHASE_RECORDING elapsed_s: 61.7 sets_recorded: 1234 sets_dropped: 5 frames_missing: 6789
          disk_minutes_left: 90.4 message: "a cable" })";

TEST_F(CommandTakeRemote, ATakeIsALine) {
  takes_.answer = FromText<v1::RecordedTake>(kFull);
  EXPECT_EQ(
      Take({"pin", "t1"}).out,
      "t1  recording      62 s  1,234 sets, 5 dropped, 6,789 frames missing, disk for 90 min  12A  walk  "
      "10:00:00:00  pinned  (a cable)  (in the trash: asked for)\n");
  // How long the disk lasts is told of a take that is recorded alone, and where it is known.
  takes_.answer.mutable_state()->set_disk_minutes_left(0);
  EXPECT_THAT(Take({"pin", "t1"}).out, HasSubstr("missing, disk for 0 min  12A"));
  takes_.answer.mutable_state()->set_disk_minutes_left(-1);
  EXPECT_THAT(Take({"pin", "t1"}).out, HasSubstr("missing  12A"));
  takes_.answer =
      FromText<v1::RecordedTake>(R"(id: "t2" state { phase: RECORDER_PHASE_ENDED disk_minutes_left: 3 })");
  EXPECT_EQ(Take({"pin", "t2"}).out, "t2  ended           0 s  0 sets, 0 dropped, 0 frames missing\n");
  takes_.answer.clear_state();
  EXPECT_THAT(Take({"pin", "t2"}).out, testing::StartsWith("t2  starting   "));
}

TEST_F(CommandTakeRemote, CallsNameTheTakeAndAnswerIt) {
  takes_.answer = FromText<v1::RecordedTake>(R"(id: "t1" state { phase: RECORDER_PHASE_ENDED })");
  const std::string said = "t1  ended           0 s  0 sets, 0 dropped, 0 frames missing\n";
  EXPECT_EQ(Take({"pin", "t1"}).out, said);
  EXPECT_EQ(Take({"pin", "--off", "t1"}).out, said);
  EXPECT_EQ(Take({"delete", "t1"}).out, said);
  EXPECT_EQ(Take({"restore", "t1"}).out, said);
  EXPECT_EQ(Take({"empty-trash"}).out, "3 takes removed, 1.23 GB\n");
  EXPECT_EQ(Take({"empty-trash", "t1"}).out, "3 takes removed, 1.23 GB\n");
  EXPECT_THAT(takes_.asked,
              ElementsAre("pin take_id: \"t1\" pinned: true", "pin take_id: \"t1\"", "delete take_id: \"t1\"",
                          "restore take_id: \"t1\"", "empty ", "empty take_id: \"t1\""));
  EXPECT_EQ(TextOf(FromJson<v1::RecordedTake>(Take({"pin", "t1", "--json"}).out)), TextOf(takes_.answer));
  EXPECT_EQ(FromJson<v1::EmptyTrashResponse>(Take({"empty-trash", "--json"}).out).takes(), 3);
}

TEST_F(CommandTakeRemote, ListsTakesWithTheirIds) {
  *takes_.list.add_takes() = FromText<v1::RecordedTake>(kFull);
  *takes_.list.add_takes() = FromText<v1::RecordedTake>(R"(id: "t2" state { phase: RECORDER_PHASE_FAILED })");
  takes_.list.add_warnings("t3 cannot be read");
  const AloudRun run = Take({"list", "--limit", "7", "--trash", "--search", "12A walk"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(
      run.out,
      "t1  recording      62 s  1,234 sets, 5 dropped, 6,789 frames missing, disk for 90 min  12A  walk  "
      "10:00:00:00  pinned  (a cable)  (in the trash: asked for)\n"
      "t2  failed          0 s  0 sets, 0 dropped, 0 frames missing\n");
  EXPECT_EQ(run.err, "weft: warning: t3 cannot be read\n");
  EXPECT_THAT(takes_.asked, ElementsAre("list limit: 7 trash: true words: \"12A walk\""));
  const AloudRun json = Take({"list", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::ListTakesResponse>(json.out)), TextOf(takes_.list));
  EXPECT_EQ(json.err, "");
  EXPECT_EQ(takes_.asked[1], "list limit: 20");
}

TEST_F(CommandTakeRemote, SaysWhereThereAreNone) {
  EXPECT_EQ(Take({"list"}).out, "no takes at " + daemon_.address() + "\n");
  EXPECT_EQ(Take({"list", "--trash"}).out, "no takes in the trash at " + daemon_.address() + "\n");
  EXPECT_EQ(Take({"list", "--search", "x"}).out, "no takes with these words at " + daemon_.address() + "\n");
}

// 2026-01-31 10:45:00 UTC.
constexpr char kEvents[] = R"(
  id: "t1" folder: "/takes/t1" state { phase: RECORDER_PHASE_ENDED warnings: "the clock drifts" }
  events { event: "note" cause: "a note" noticed_unix_ns: 1769856300000000000 }
  events { event: "missing" first_set: 3 last_set: 3 camera: "c01" cause: "a packet" noticed_unix_ns: 1769856301000000000 }
  events { event: "dropped" first_set: 4 last_set: 9 cause: "the disk" noticed_unix_ns: 1769856302000000000 }
  events { event: "end" cause: "stopped" })";

TEST_F(CommandTakeRemote, AWatchTellsEventsAndTheEnd) {
  takes_.watched = {FromText<v1::RecordedTake>(kEvents)};
  const AloudRun run = Take({"watch", "t1"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.err,
            "10:45:00  a note\n"
            "10:45:01  set 3 missing  camera c01: a packet\n"
            "10:45:02  set 4 to 9 dropped  the disk\n"
            "weft: warning: the clock drifts\n");
  EXPECT_EQ(run.out,
            "ended           0 s  0 sets, 0 dropped, 0 frames missing\n"
            "take     /takes/t1\n");
  EXPECT_THAT(takes_.asked, ElementsAre("watch take_id: \"t1\""));
  const AloudRun json = Take({"watch", "t1", "--json"});
  EXPECT_EQ(json.err, "");
  EXPECT_EQ(TextOf(FromJson<v1::RecordedTake>(json.out)), TextOf(takes_.watched[0]));
  const CommandRun quiet = RunCommand(AddRemoteTakeCommands, {"watch", "t1", "--server", daemon_.address()});
  EXPECT_EQ(quiet.out, "");
}

TEST_F(CommandTakeRemote, StopWaitsUntilItIsClosedAndTellsAFailure) {
  takes_.watched = {FromText<v1::RecordedTake>(
      R"(id: "t1" folder: "/t" state { phase: RECORDER_PHASE_FAILED message: "the disk is full" })")};
  const AloudRun run = Take({"stop", "t1"});
  EXPECT_EQ(run.status, absl::InternalError("take t1: the disk is full"));
  EXPECT_THAT(run.out, HasSubstr("(the disk is full)\ntake     /t\n"));
  EXPECT_THAT(takes_.asked, ElementsAre("stop take_id: \"t1\"", "watch take_id: \"t1\""));
}

TEST_F(CommandTakeRemote, StartSendsTheSessionAndWaitsForTheFirstSets) {
  takes_.answer = FromText<v1::RecordedTake>(R"(id: "t1" state { phase: RECORDER_PHASE_STARTING })");
  takes_.watched = {takes_.answer, FromText<v1::RecordedTake>(kFull)};
  const AloudRun run =
      Take({"start", "--session", folder_ / "session.json", "--seconds", "12.5", "--no-disk-test"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "t1\n");
  EXPECT_EQ(TextOf(takes_.started.recording()),
            "session { cameras { id: \"c01\" gige { device: \"192.168.1.7\" } } } seconds: 12.5 "
            "no_disk_test: true");
  EXPECT_EQ(takes_.started.lease(), "");
  const std::string key = takes_.started.idempotency_key();
  EXPECT_NE(key, "");
  const AloudRun json = Take({"start", "--lease", "l1", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::RecordedTake>(json.out)), TextOf(takes_.watched[1]))
      << "its state as it records";
  EXPECT_EQ(takes_.started.lease(), "l1");
  EXPECT_EQ(TextOf(takes_.started.recording()), "");
  EXPECT_NE(takes_.started.idempotency_key(), key);
}

TEST_F(CommandTakeRemote, StartTellsWhyNothingIsRecorded) {
  takes_.answer = FromText<v1::RecordedTake>(R"(id: "t1" state { phase: RECORDER_PHASE_STARTING })");
  const auto start = [&](const std::string& state) {
    takes_.watched = {FromText<v1::RecordedTake>("id: \"t1\" state { " + state + " }")};
    return Take({"start", "--lease", "l1"});
  };
  const AloudRun absent =
      start("phase: RECORDER_PHASE_FAILED message: \"c01 is away\" error_code: \"NOT_FOUND\"");
  EXPECT_EQ(absent.status, absl::NotFoundError("take t1: c01 is away"));
  EXPECT_EQ(absent.out, "t1\n");
  EXPECT_EQ(start("phase: RECORDER_PHASE_FAILED error_code: \"INTERNAL\"").status,
            absl::InternalError("take t1: its recorder ended"));
  EXPECT_EQ(start("phase: RECORDER_PHASE_ENDED message: \"no frames\" error_code: \"INTERNAL\"").status,
            absl::InternalError("take t1: no frames"));
  // A short one has ended meanwhile, and one that failed later was recorded.
  EXPECT_TRUE(start("phase: RECORDER_PHASE_ENDED").status.ok());
  EXPECT_TRUE(start("phase: RECORDER_PHASE_FAILED message: \"full\" sets_recorded: 1").status.ok());
  takes_.watched = {FromText<v1::RecordedTake>(
      "id: \"t1\" state { phase: RECORDER_PHASE_FAILED message: \"gone\" error_code: \"NOT_FOUND\" }")};
  const AloudRun json = Take({"start", "--lease", "l1", "--json"});
  EXPECT_EQ(json.status, absl::NotFoundError("take t1: gone"));
  EXPECT_EQ(FromJson<v1::RecordedTake>(json.out).state().message(), "gone");
}

TEST_F(CommandTakeRemote, StartNeedsEitherASessionOrALease) {
  const std::string said =
      "give either --session FILE, or the --lease that `weft session open` printed (or WEFT_LEASE)";
  EXPECT_EQ(Take({"start"}).status, absl::InvalidArgumentError(said));
  EXPECT_EQ(Take({"start", "--session", folder_ / "session.json", "--lease", "l1"}).status,
            absl::InvalidArgumentError(said));
  EXPECT_EQ(Take({"start", "--session", folder_ / "none.json"}).status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(takes_.started.idempotency_key(), "");
}

TEST_F(CommandTakeRemote, DescribeKeepsWhatIsNotGiven) {
  *takes_.list.add_takes() =
      FromText<v1::RecordedTake>(R"(id: "t10" keeping { slate: "other" notes: "other" })");
  *takes_.list.add_takes() =
      FromText<v1::RecordedTake>(R"(id: "t1" keeping { slate: "12A" notes: "wet" name: "walk" })");
  takes_.answer = takes_.list.takes(1);
  const auto describe = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "describe");
    words.insert(words.end(), {"--server", daemon_.address()});
    takes_.asked.clear();
    return RunAloud(AddTakeDescribeCommands, words);
  };
  const AloudRun run = describe({"take:t1", "--name", "run"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "t1  12A  walk\n");
  EXPECT_THAT(takes_.asked,
              ElementsAre("list limit: 100 words: \"t1\"",
                          "describe take_id: \"t1\" slate: \"12A\" notes: \"wet\" name: \"run\""));
  describe({"t1", "--slate", "12B"});
  EXPECT_EQ(takes_.asked[1], "describe take_id: \"t1\" slate: \"12B\" notes: \"wet\"");
  const AloudRun json = describe({"t1", "--notes", "", "--json"});
  EXPECT_EQ(takes_.asked[1], "describe take_id: \"t1\" slate: \"12A\"");
  EXPECT_EQ(TextOf(FromJson<v1::RecordedTake>(json.out)), TextOf(takes_.answer));
}

}  // namespace
}  // namespace weft
