// Items that go to a daemon over a network, and jobs that name them.
#include "services/tools/client/library_client.h"

#include "services/work/items/sha256.h"
#include "tests/services/server/daemon/cutting_proxy.h"
#include "tests/services/server/daemon/daemon_fixture.h"

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

  absl::StatusOr<v1::LibraryItem> UploadRig(const std::string& bytes) {
    WriteBytes(folder_ / "local/rig.json", bytes);
    const auto files = ListLocalItem(v1::ITEM_KIND_RIG, folder_ / "local/rig.json");
    if (!files.ok()) return files.status();
    return LibraryClient(*client_).Upload(v1::ITEM_KIND_RIG, "lab", *files);
  }
  v1::SubmitJobRequest RequestWithRig(const std::vector<std::string>& frames, const std::string& rig) {
    v1::SubmitJobRequest request = MakeRequest(frames);
    request.mutable_spec()->set_rig(rig);
    return request;
  }
};

TEST_F(DaemonLibrary, GivesJobsWhatTheyName) {
  StartDaemon();
  const auto item = UploadRig("{}");
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
  ASSERT_TRUE(UploadRig("{}").ok());
  const auto job = client_->Submit(RequestWithRig({"hang"}, "library:lab@1"));
  ASSERT_TRUE(job.ok()) << job.status();
  LibraryClient library(*client_);
  const absl::Status refused = library.Delete(v1::ITEM_KIND_RIG, "lab").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr(job->id()));
  ASSERT_TRUE(client_->Cancel(job->id()).ok());
  EXPECT_TRUE(library.Delete(v1::ITEM_KIND_RIG, "lab").value().content_deleted());
}

TEST_F(DaemonLibrary, GetsUploadsThatBreakOff) {
  StartDaemon();
  CuttingProxy proxy(daemon_->address());
  // No connection carries the whole file, so it arrives only if each goes on where the last one ended.
  proxy.CutAfterSent(3 << 20);
  Connect(proxy.address());
  const auto item = UploadRig(std::string(8 << 20, 'x'));
  ASSERT_TRUE(item.ok()) << item.status();
  EXPECT_EQ(item->bytes(), 8 << 20);
  EXPECT_GE(proxy.connections(), 3);
  Connect(daemon_->address());
  EXPECT_EQ(LibraryClient(*client_).List(v1::ITEM_KIND_RIG).value().items_size(), 1);
}

TEST_F(DaemonLibrary, TakesTheSameFilesFromTwoClientsAtOnce) {
  StartDaemon();
  WriteBytes(folder_ / "local/rig.json", std::string(16 << 20, 'x'));
  const auto files = ListLocalItem(v1::ITEM_KIND_RIG, folder_ / "local/rig.json");
  ASSERT_TRUE(files.ok()) << files.status();
  absl::StatusOr<v1::LibraryItem> items[2];
  {
    std::vector<std::jthread> clients;
    for (auto& item : items) {
      clients.emplace_back([&] { item = LibraryClient(*client_).Upload(v1::ITEM_KIND_RIG, "lab", *files); });
    }
  }
  for (const auto& item : items) {
    ASSERT_TRUE(item.ok()) << item.status();
    EXPECT_EQ(item->names_size(), 1);
  }
  EXPECT_EQ(items[0]->id(), items[1]->id());
}

TEST_F(DaemonLibrary, GivesItsItemsBack) {
  StartDaemon();
  const std::string bytes(3 << 20, 'x');
  ASSERT_TRUE(UploadRig(bytes).ok());
  CuttingProxy proxy(daemon_->address());
  proxy.CutAfter(2 << 20);
  Connect(proxy.address());
  LibraryClient library(*client_);
  const auto item = library.Get(v1::ITEM_KIND_RIG, "lab");
  ASSERT_TRUE(item.ok()) << item.status();
  const absl::Status status = library.Fetch(*item, folder_ / "back/again");
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(ReadBytes(folder_ / "back/again/rig.json"), bytes);
  EXPECT_GE(proxy.connections(), 2);
  daemon_.reset();
  EXPECT_TRUE(library.Fetch(*item, folder_ / "back/again").ok());  // all is there
}

TEST_F(DaemonLibrary, ListsComeInPagesAndFilesByTheirPaths) {
  StartDaemon();
  for (const char* bytes : {"{}", "[]"}) ASSERT_TRUE(UploadRig(bytes).ok());
  v1::Library::Stub stub(client_->channel());
  v1::ListItemsRequest list;
  list.set_kind(v1::ITEM_KIND_RIG);
  list.set_limit(1);
  for (int pages = 0; pages < 2; ++pages) {
    grpc::ClientContext context;
    v1::ListItemsResponse response;
    ASSERT_TRUE(stub.ListItems(&context, list, &response).ok());
    EXPECT_EQ(response.items_size(), 1);
    EXPECT_EQ(response.damaged_size(), 0);
    EXPECT_EQ(response.next_page_token().empty(), pages == 1);
    list.set_page_token(response.next_page_token());
  }
  const auto fetched = [&](const v1::FetchFileRequest& request) {
    grpc::ClientContext context;
    v1::FileChunk chunk;
    const auto reader = stub.FetchFile(&context, request);
    return reader->Read(&chunk) ? chunk.data() : std::string(reader->Finish().error_message());
  };
  v1::FetchFileRequest fetch;
  fetch.set_kind(v1::ITEM_KIND_RIG);
  fetch.set_item("lab@1");
  fetch.set_path("rig.json");
  EXPECT_EQ(fetched(fetch), "{}");
  fetch.set_item("lab");
  EXPECT_EQ(fetched(fetch), "[]");
  fetch.set_path("../rig.json");
  EXPECT_EQ(fetched(fetch), "path: the item has no file \"../rig.json\"");
  fetch.set_offset(-1);
  EXPECT_EQ(fetched(fetch), "offset: must not be negative");
  grpc::ClientContext context, of_upload;
  list.set_limit(-1);
  v1::ListItemsResponse response;
  EXPECT_EQ(stub.ListItems(&context, list, &response).error_message(),
            "limit: -1 is negative; give 0 for all");
  v1::BeginUploadResponse begun;
  const auto writer = stub.BeginUpload(&of_upload, &begun);
  writer->WritesDone();
  EXPECT_EQ(writer->Finish().error_message(), "the call has no message");
  const auto deleted = LibraryClient(*client_).Delete(v1::ITEM_KIND_RIG, "lab@1");
  ASSERT_TRUE(deleted.ok()) << deleted.status();
  EXPECT_TRUE(deleted->content_deleted());
  EXPECT_EQ(deleted->item().bytes(), 2);
}

TEST_F(DaemonLibrary, TakesManifestsBeyondTheLimitOfAMessage) {
  StartDaemon();
  LocalItem files;
  WriteBytes(folder_ / "empty", "");
  const std::string hash = Sha256().Hex();
  for (int i = 0; i < 20'000; ++i) {
    v1::ItemFile& file = *files.manifest.add_files();
    file.set_path(absl::StrCat("cam", i % 10, "/", i, ".png"));
    file.set_sha256(hash);
    files.paths.push_back(folder_ / "empty");
  }
  ASSERT_GT(files.manifest.ByteSizeLong(), size_t{1} << 20);
  files.manifest.mutable_files(0)->set_sha256("none");
  const absl::Status status = LibraryClient(*client_).Upload(v1::ITEM_KIND_DUMP, "many", files).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("cam0/0.png"));
}

}  // namespace
}  // namespace weft
