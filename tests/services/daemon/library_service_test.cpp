// Items that go to a daemon over a network, and jobs that name them.
#include "services/client/library_client.h"
#include "tests/services/daemon/cutting_proxy.h"
#include "tests/services/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class DaemonLibrary : public DaemonTest {
 protected:
  DaemonLibrary() {
    options_.check_item = [](v1::ItemKind, const v1::ItemManifest&, const std::string&) {
      return absl::OkStatus();
    };
  }

  absl::StatusOr<v1::LibraryItem> UploadRig(const std::string& server, const std::string& bytes) {
    WriteBytes(folder_ / "local/rig.json", bytes);
    const auto files = ListLocalItem(v1::ITEM_KIND_RIG, folder_ / "local/rig.json");
    if (!files.ok()) return files.status();
    return LibraryClient(server).Upload(v1::ITEM_KIND_RIG, "lab", *files);
  }
  v1::SubmitJobRequest RequestWithRig(const std::vector<std::string>& frames, const std::string& rig) {
    v1::SubmitJobRequest request = MakeRequest(frames);
    request.mutable_spec()->set_rig(rig);
    return request;
  }
};

TEST_F(DaemonLibrary, GivesJobsWhatTheyName) {
  StartDaemon();
  const auto item = UploadRig(daemon_->address(), "{}");
  ASSERT_TRUE(item.ok()) << item.status();
  const auto job = client_->Submit(RequestWithRig({"a"}, "library:lab"));
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->items().rig(), item->id());
  EXPECT_EQ(ReadBytes(job->spec().rig()), "{}");
  EXPECT_EQ(WaitForEnd(job->id()).state(), v1::JOB_STATE_DONE);
  const absl::Status unknown = client_->Submit(RequestWithRig({"a"}, "library:hall")).status();
  EXPECT_EQ(unknown.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(unknown.message()),
              HasSubstr("spec.rig: the library has no rig \"hall\"; it has lab@1"));
}

TEST_F(DaemonLibrary, KeepsWhatAnUnfinishedJobUses) {
  StartDaemon();
  ASSERT_TRUE(UploadRig(daemon_->address(), "{}").ok());
  const auto job = client_->Submit(RequestWithRig({"hang"}, "library:lab@1"));
  ASSERT_TRUE(job.ok()) << job.status();
  LibraryClient library(daemon_->address());
  const absl::Status refused = library.Delete(v1::ITEM_KIND_RIG, "lab").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr(job->id()));
  ASSERT_TRUE(client_->Cancel(job->id()).ok());
  EXPECT_TRUE(library.Delete(v1::ITEM_KIND_RIG, "lab").value().content_deleted());
}

TEST_F(DaemonLibrary, GetsUploadsThatBreakOff) {
  StartDaemon();
  CuttingProxy proxy(daemon_->address());
  const std::string bytes(8 << 20, 'x');
  std::atomic<bool> done = false;
  std::jthread cutting([&] {
    for (int k = 0; k < 3 && !done; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      proxy.Cut();
    }
  });
  const auto item = UploadRig(proxy.address(), bytes);
  done = true;
  ASSERT_TRUE(item.ok()) << item.status();
  EXPECT_EQ(item->bytes(), 8 << 20);
  EXPECT_EQ(LibraryClient(daemon_->address()).List(v1::ITEM_KIND_RIG).value().items_size(), 1);
}

}  // namespace
}  // namespace weft
