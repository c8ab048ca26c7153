#include "services/server/daemon/work/known_inputs.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <thread>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Two frames of two cameras, a rig, a board and a template.
class KnownInputsTest : public ::testing::Test {
 protected:
  KnownInputsTest() {
    for (const std::string frame : {"dump/0000", "dump/0001"}) {
      fs::create_directories(folder_ / frame);
      for (const char* camera : {"/a.png", "/b.png"}) WriteBytes(folder_ / (frame + camera), "x");
    }
    fs::create_directories(folder_ / "files");
    WriteBytes(folder_ / "files/rig.json", "{}");
    WriteBytes(folder_ / "files/board.json", "{}");
    fs::create_directories(folder_ / "shirt");
    WriteBytes(folder_ / "shirt/template.json", "{}");
    spec_.set_dump(folder_ / "dump");
    spec_.set_rig(folder_ / "files/rig.json");
    spec_.set_board(folder_ / "files/board.json");
    spec_.set_garment(folder_ / "shirt");
    // The kernel's clock for files ticks every few milliseconds.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }

  absl::StatusOr<LoadedInputs> Get(const v1::RegistrationSpec& spec) {
    return known_.Get(spec, caller_, [this](const v1::RegistrationSpec&) -> absl::StatusOr<LoadedInputs> {
      ++loads_;
      return LoadedInputs{{"0000", "0001"}, {}, {"camera c has no images"}};
    });
  }
  // Whether they are read again.
  bool Reads(const v1::RegistrationSpec& spec) {
    const int before = loads_;
    EXPECT_EQ(Get(spec)->warnings.size(), 1u);
    return loads_ > before;
  }

  TempFolder folder_;
  v1::RegistrationSpec spec_;
  KnownInputs known_{[] { return std::time(nullptr) + 60; }};
  std::string caller_ = "user anna";
  std::atomic<int> loads_ = 0;
};

TEST_F(KnownInputsTest, AreReadOnceForEqualJobs) {
  EXPECT_TRUE(Reads(spec_));
  EXPECT_FALSE(Reads(spec_));
  spec_.set_out(folder_ / "out");
  EXPECT_FALSE(Reads(spec_));
  spec_.set_first_frame(1);
  EXPECT_TRUE(Reads(spec_));
  EXPECT_FALSE(Reads(spec_));
}

TEST_F(KnownInputsTest, AreReadAgainAfterEveryChangeOfFilesAndNames) {
  const std::function<void()> changes[] = {
      [&] { WriteBytes(folder_ / "dump/0001/c.png", "x"); },
      [&] { fs::remove(folder_ / "dump/0001/b.png"); },
      [&] { fs::rename(folder_ / "dump/0001/a.png", folder_ / "dump/0001/d.png"); },
      [&] { fs::remove_all(folder_ / "dump/0001"); },
      [&] { fs::create_directories(folder_ / "dump/0002"); },
      [&] { WriteBytes(folder_ / "files/rig.json", "[]"); },
      [&] { WriteBytes(folder_ / "files/new.json", "{}"); },
      [&] { fs::rename(folder_ / "files/new.json", folder_ / "files/board.json"); },
      [&] { WriteBytes(folder_ / "shirt/template.json", "[]"); },
      [&] { fs::last_write_time(folder_ / "shirt/template.json", fs::file_time_type::clock::now()); },
      [&] {
        fs::rename(folder_ / "shirt", folder_ / "coat");
        fs::copy(folder_ / "coat", folder_ / "shirt");
      },
  };
  for (size_t i = 0; i < std::size(changes); ++i) {
    Get(spec_).IgnoreError();
    EXPECT_FALSE(Reads(spec_)) << i;
    changes[i]();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(Reads(spec_)) << i;
  }
}

TEST_F(KnownInputsTest, AreReadEachTimeWhereLinksLeadElsewhere) {
  EXPECT_TRUE(Reads(spec_));
  fs::create_symlink(folder_ / "files/rig.json", folder_ / "dump/0001/c.png");
  EXPECT_TRUE(Reads(spec_));
  EXPECT_TRUE(Reads(spec_));
}

TEST_F(KnownInputsTest, AreReadEachTimeWhileTheyAreNew) {
  KnownInputs known;
  int loads = 0;
  for (int k = 0; k < 2; ++k) {
    EXPECT_TRUE(
        known.Get(spec_, caller_, [&](const v1::RegistrationSpec&) { return ++loads, LoadedInputs(); }).ok());
  }
  EXPECT_EQ(loads, 2);
}

TEST_F(KnownInputsTest, AreReadAgainAfterAnError) {
  const absl::Status status = known_
                                  .Get(spec_, caller_,
                                       [](const v1::RegistrationSpec&) -> absl::StatusOr<LoadedInputs> {
                                         return absl::NotFoundError("no rig");
                                       })
                                  .status();
  EXPECT_EQ(status.message(), "no rig");
  EXPECT_TRUE(Reads(spec_));
}

TEST_F(KnownInputsTest, AreReadByFewCallsAtATime) {
  std::atomic<int> reading = 0, most = 0, reads = 0;
  const auto load = [&](const v1::RegistrationSpec&) {
    const int now = ++reading;
    for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
    }
    ++reads;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    --reading;
    return LoadedInputs();
  };
  std::vector<std::jthread> calls;
  for (int i = 0; i < 12; ++i) {
    v1::RegistrationSpec spec = spec_;
    spec.set_first_frame(i);
    const std::string caller = "user " + std::to_string(i % 4);
    calls.emplace_back([&, spec, caller] { EXPECT_TRUE(known_.Get(spec, caller, load).ok()); });
  }
  calls.clear();
  EXPECT_EQ(reads, 12);
  EXPECT_LE(most, 4);
}

// Inputs that somebody made slow to read keep nobody else waiting.
TEST_F(KnownInputsTest, OneCallerDoesNotKeepOthersWaiting) {
  std::promise<void> over;
  const auto slow = [end = over.get_future().share()](const v1::RegistrationSpec&) {
    end.wait();
    return LoadedInputs();
  };
  std::vector<std::jthread> calls;
  for (int i = 0; i < 5; ++i) {
    v1::RegistrationSpec spec = spec_;
    spec.set_first_frame(i);
    calls.emplace_back([this, spec, &slow] { EXPECT_TRUE(known_.Get(spec, "user mallory", slow).ok()); });
  }
  EXPECT_TRUE(Reads(spec_));
  over.set_value();
}

}  // namespace
}  // namespace weft
