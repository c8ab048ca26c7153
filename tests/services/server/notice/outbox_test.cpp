#include "services/server/notice/outbox.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>

#include "base/host_clock.h"
#include "services/server/notice/notice_request.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

class OutboxTest : public ::testing::Test {
 protected:
  OutboxTest() {
    options_.folder = folder_ / "box";
    options_.first_pause = options_.longest_pause = std::chrono::milliseconds(1);
  }

  std::unique_ptr<Outbox> Open(Deliver deliver) {
    absl::StatusOr<std::unique_ptr<Outbox>> box = Outbox::Open(options_, std::move(deliver));
    EXPECT_TRUE(box.ok()) << box.status();
    return box.ok() ? *std::move(box) : nullptr;
  }
  std::vector<std::string> Kept() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(options_.folder))
      names.push_back(entry.path().filename());
    return names;
  }
  static void WaitUntil(const std::function<bool()>& reached) {
    for (int i = 0; i < 6000 && !reached(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_TRUE(reached());
  }

  TempFolder folder_;
  OutboxOptions options_;
};

TEST_F(OutboxTest, TriesAgainUntilItIsDelivered) {
  std::atomic<int> tries = 0;
  const auto box = Open([&](const std::string& path, const std::stop_token&) {
    EXPECT_EQ(ReadBytes(path), "body");
    return ++tries < 4 ? absl::UnavailableError("away") : absl::OkStatus();
  });
  ASSERT_TRUE(box->Put("one", "body").ok());
  WaitUntil([&] { return Kept().empty(); });
  EXPECT_EQ(tries, 4);
}

TEST_F(OutboxTest, OtherErrorsAreFinal) {
  std::atomic<int> tries = 0;
  const auto box = Open([&](const std::string&, const std::stop_token&) {
    ++tries;
    return absl::InternalError("exit status 1");
  });
  ASSERT_TRUE(box->Put("one", "body").ok());
  WaitUntil([&] { return Kept().empty(); });
  EXPECT_EQ(tries, 1);
}

TEST_F(OutboxTest, TheNextOneDeliversWhatWasInterrupted) {
  std::atomic<bool> begun = false;
  {
    const auto box = Open([&](const std::string&, const std::stop_token& stop) {
      begun = true;
      while (!stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return absl::CancelledError("stops");
    });
    ASSERT_TRUE(box->Put("one", "first").ok());
    ASSERT_TRUE(box->Put("one", "twice").ok());
    ASSERT_TRUE(box->Put("two", "second").ok());
    WaitUntil([&] { return begun.load(); });
  }
  EXPECT_THAT(Kept(), ::testing::UnorderedElementsAre("one.json", "two.json"));
  std::ofstream(options_.folder + "/three.json.tmp") << "half";
  std::mutex mutex;
  std::vector<std::string> bodies;
  const auto box = Open([&](const std::string& path, const std::stop_token&) {
    const std::lock_guard lock(mutex);
    bodies.push_back(ReadBytes(path));
    return absl::OkStatus();
  });
  WaitUntil([&] { return Kept().empty(); });
  EXPECT_THAT(bodies, ::testing::UnorderedElementsAre("first", "second"));
}

TEST_F(OutboxTest, OneIsGivenUpOnDemand) {
  options_.first_pause = options_.longest_pause = std::chrono::hours(1);
  std::atomic<int> tries = 0;
  const auto box = Open([&](const std::string&, const std::stop_token&) {
    ++tries;
    return absl::UnavailableError("away");
  });
  const int64_t before_ns = HostTime_ns();
  ASSERT_TRUE(box->Put("one", "body").ok());
  ASSERT_TRUE(box->Put("two", "body").ok());
  WaitUntil([&] { return tries == 2; });
  std::vector<std::string> names;
  for (const Outbox::Waits& waits : box->Waiting()) {
    names.push_back(waits.name);
    EXPECT_GE(waits.since_unix_ns, before_ns);
    EXPECT_LE(waits.since_unix_ns, HostTime_ns());
  }
  EXPECT_THAT(names, ::testing::ElementsAre("one.json", "two.json"));
  bool given_up = false;
  WaitUntil([&] { return given_up = given_up || box->GiveUp("one.json").ok(); });
  EXPECT_EQ(box->GiveUp("one.json").code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(Kept(), ::testing::ElementsAre("two.json"));
}

TEST_F(OutboxTest, OneThatIsBeingDeliveredIsNotGivenUp) {
  std::atomic<bool> begun = false, ends = false;
  const auto box = Open([&](const std::string&, const std::stop_token&) {
    begun = true;
    while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return absl::OkStatus();
  });
  ASSERT_TRUE(box->Put("one", "body").ok());
  WaitUntil([&] { return begun.load(); });
  EXPECT_EQ(box->GiveUp("one.json").code(), absl::StatusCode::kFailedPrecondition);
  ends = true;
  WaitUntil([&] { return Kept().empty(); });
}

TEST_F(OutboxTest, NoticesAreClosedToOthersAndNamedAfterTheirFiles) {
  options_.first_pause = options_.longest_pause = std::chrono::hours(1);
  const auto box =
      Open([](const std::string&, const std::stop_token&) { return absl::UnavailableError("away"); });
  ASSERT_TRUE(box->Put("one", "body").ok());
  struct stat file = {};
  ASSERT_EQ(stat((options_.folder + "/one.json").c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600u);
  EXPECT_EQ(box->GiveUp("two.json"),
            absl::FailedPreconditionError("it was delivered, or is being delivered"));
  // One whose file somebody removed is gone as well.
  std::filesystem::remove(options_.folder + "/one.json");
  bool given_up = false;
  WaitUntil([&] { return given_up = given_up || box->GiveUp("one.json").ok(); });
  EXPECT_TRUE(box->Waiting().empty());
  std::filesystem::remove_all(options_.folder);
  EXPECT_FALSE(box->Put("three", "body").ok());
  EXPECT_TRUE(box->Waiting().empty());
}

TEST_F(OutboxTest, WaitsTwiceAsLongAfterEachTry) {
  options_.first_pause = std::chrono::milliseconds(10);
  options_.longest_pause = std::chrono::milliseconds(40);
  std::mutex mutex;
  std::vector<std::chrono::steady_clock::time_point> tries;
  const auto box = Open([&](const std::string&, const std::stop_token&) {
    const std::lock_guard lock(mutex);
    tries.push_back(std::chrono::steady_clock::now());
    return tries.size() < 5 ? absl::UnavailableError("away") : absl::OkStatus();
  });
  ASSERT_TRUE(box->Put("one", "body").ok());
  WaitUntil([&] { return Kept().empty(); });
  for (const auto& [next, least_ms] : {std::pair(1, 10), {2, 20}, {3, 40}, {4, 40}})
    EXPECT_GE(tries[static_cast<size_t>(next)] - tries[static_cast<size_t>(next - 1)],
              std::chrono::milliseconds(least_ms));
}

TEST_F(OutboxTest, DeliversOneAfterTheOtherUnlessToldOtherwise) {
  std::atomic<int> inside = 0, most = 0, done = 0;
  const auto box = Open([&](const std::string&, const std::stop_token&) {
    most = std::max<int>(most, ++inside);
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
    --inside, ++done;
    return absl::OkStatus();
  });
  for (const char* name : {"a", "b", "c", "d"}) ASSERT_TRUE(box->Put(name, "").ok());
  WaitUntil([&] { return done == 4 && Kept().empty(); });
  EXPECT_EQ(most, 1);
}

// The one that waits longest is tried first.
TEST_F(OutboxTest, TakesUpWhatLiesThereSinceItWasWritten) {
  WriteBytes(options_.folder + "/old.json", "body");
  std::filesystem::last_write_time(options_.folder + "/old.json",
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(24));
  options_.first_pause = options_.longest_pause = std::chrono::hours(1);
  const auto box =
      Open([](const std::string&, const std::stop_token&) { return absl::UnavailableError("away"); });
  ASSERT_EQ(box->Waiting().size(), 1u);
  const int64_t hour_ns = int64_t{3600} * 1'000'000'000;
  EXPECT_LT(box->Waiting()[0].since_unix_ns, HostTime_ns() - 23 * hour_ns);
  EXPECT_GT(box->Waiting()[0].since_unix_ns, HostTime_ns() - 25 * hour_ns);
}

// RFC 4231, test case 2.
TEST(NoticeRequest, SignsAsTheStandardSays) {
  EXPECT_EQ(SignatureOf("Jefe", "what do ya want for nothing?"),
            "sha256=5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
}

}  // namespace
}  // namespace weft
