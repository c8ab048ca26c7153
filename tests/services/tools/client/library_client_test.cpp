#include "services/tools/client/library_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/server/rpc/grpc_status.h"
#include "services/server/rpc/retry_after.h"
#include "services/work/items/sha256.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr size_t kPiece = 256 << 10;

class AnsweringLibrary final : public v1::Library::Service {
 public:
  std::function<grpc::Status(v1::BeginUploadResponse*)> begin;
  std::function<grpc::Status(v1::LibraryItem*)> finish;
  AnswerFunction<v1::ListItemsRequest, v1::ListItemsResponse> list;
  StreamFunction<v1::FetchFileRequest, v1::FileChunk> fetch;
  std::vector<v1::BeginUploadRequest> manifests;  // messages
  std::vector<v1::WriteFileRequest> pieces;
  std::vector<std::string> asked;

 private:
  using Context = grpc::ServerContext;
  grpc::Status BeginUpload(Context*, grpc::ServerReader<v1::BeginUploadRequest>* in,
                           v1::BeginUploadResponse* out) override {
    for (v1::BeginUploadRequest message; in->Read(&message);) manifests.push_back(message);
    return begin(out);
  }
  grpc::Status WriteFile(Context*, grpc::ServerReader<v1::WriteFileRequest>* in,
                         v1::WriteFileResponse*) override {
    for (v1::WriteFileRequest piece; in->Read(&piece);) pieces.push_back(piece);
    return grpc::Status::OK;
  }
  grpc::Status FinishUpload(Context*, const v1::FinishUploadRequest* request,
                            v1::LibraryItem* item) override {
    asked.push_back("finish " + request->upload_id());
    return finish(item);
  }
  grpc::Status ListItems(Context*, const v1::ListItemsRequest* request, v1::ListItemsResponse* out) override {
    return AnswerBy(list, *request, out);
  }
  grpc::Status GetItem(Context*, const v1::GetItemRequest* request, v1::LibraryItem* item) override {
    asked.push_back("get " + request->item());
    item->set_kind(request->kind());
    return grpc::Status::OK;
  }
  grpc::Status DeleteItem(Context*, const v1::DeleteItemRequest* request,
                          v1::DeleteItemResponse* out) override {
    asked.push_back("delete " + request->item());
    out->mutable_item()->set_kind(request->kind());
    return grpc::Status::OK;
  }
  grpc::Status FetchFile(Context*, const v1::FetchFileRequest* request,
                         grpc::ServerWriter<v1::FileChunk>* out) override {
    asked.push_back(
        absl::StrCat(request->item(), " ", request->path(), " ", request->offset(), " ", request->version()));
    return AnswerBy(fetch, *request, out);
  }
};

class LibraryClientTest : public ::testing::Test {
 protected:
  LibraryClientTest() {
    library_.finish = [](v1::LibraryItem* item) {
      item->set_id("ready");
      return grpc::Status::OK;
    };
  }
  // Two files: one of two pieces and a bit, and one of three bytes.
  LocalItem Item() {
    LocalItem item;
    for (const auto& [name, text] :
         {std::pair<std::string, std::string>{"a/large", std::string(2 * kPiece + 5, 'x')},
          {"small", "abc"}}) {
      WriteBytes(folder_ / name, text);
      v1::ItemFile& file = *item.manifest.add_files();
      file.set_path(name);
      file.set_bytes(static_cast<int64_t>(text.size()));
      file.set_sha256(Sha256().Add(text).Hex());
      item.paths.push_back(folder_ / name);
    }
    return item;
  }
  // The daemon has this many bytes of each file.
  void Begin(const std::vector<int64_t>& received) {
    library_.begin = [received](v1::BeginUploadResponse* out) {
      out->set_upload_id("u1");
      out->mutable_received_bytes()->Assign(received.begin(), received.end());
      return grpc::Status::OK;
    };
  }
  absl::StatusOr<v1::LibraryItem> Upload(const LocalItem& item) {
    return client_.Upload(v1::ITEM_KIND_BOARD, "print", item,
                          [this](uint64_t done, uint64_t all) { progress_.emplace_back(done, all); });
  }
  // An item of one file, "abcde".
  static v1::LibraryItem Stored(const std::string& path = "deep/file") {
    v1::LibraryItem item;
    item.set_kind(v1::ITEM_KIND_BOARD);
    item.set_id("f00");
    v1::ItemFile& file = *item.mutable_manifest()->add_files();
    file.set_path(path);
    file.set_bytes(5);
    file.set_sha256(Sha256().Add("abcde").Hex());
    return item;
  }
  std::string Out(const std::string& name = "deep/file") const { return folder_ / ("out/" + name); }

  AnsweringLibrary library_;
  AnsweringDaemon daemon_{{&library_}};
  LibraryClient client_{daemon_.client()};
  const TempFolder folder_;
  std::vector<std::pair<uint64_t, uint64_t>> progress_;
};

TEST_F(LibraryClientTest, SendsFilesInPieces) {
  Begin({0, 0});
  const auto item = Upload(Item());
  ASSERT_TRUE(item.ok()) << item.status();
  EXPECT_EQ(item->id(), "ready");
  ASSERT_EQ(library_.manifests.size(), 1u);
  EXPECT_EQ(library_.manifests[0].kind(), v1::ITEM_KIND_BOARD);
  EXPECT_EQ(library_.manifests[0].name(), "print");
  EXPECT_EQ(library_.manifests[0].manifest().SerializeAsString(), Item().manifest.SerializeAsString());
  std::vector<std::string> pieces;
  for (const v1::WriteFileRequest& piece : library_.pieces)
    pieces.push_back(
        absl::StrCat(piece.upload_id(), " ", piece.path(), " ", piece.offset(), " ", piece.data().size()));
  EXPECT_THAT(pieces, ElementsAre("u1 a/large 0 262144", "u1 a/large 262144 262144", "u1 a/large 524288 5",
                                  "u1 small 0 3"));
  EXPECT_EQ(library_.pieces[3].data(), "abc");
  EXPECT_THAT(library_.asked, ElementsAre("finish u1"));
  const uint64_t all = 2 * kPiece + 8;
  EXPECT_THAT(progress_,
              ElementsAre(std::pair<uint64_t, uint64_t>(0, all), std::pair<uint64_t, uint64_t>(kPiece, all),
                          std::pair<uint64_t, uint64_t>(2 * kPiece, all),
                          std::pair<uint64_t, uint64_t>(2 * kPiece + 5, all),
                          std::pair<uint64_t, uint64_t>(all, all)));
}

TEST_F(LibraryClientTest, SendsNothingThatTheDaemonHas) {
  Begin({static_cast<int64_t>(kPiece), 3});
  ASSERT_TRUE(Upload(Item()).ok());
  ASSERT_EQ(library_.pieces.size(), 2u);
  EXPECT_EQ(library_.pieces[0].offset(), static_cast<int64_t>(kPiece));
  EXPECT_EQ(library_.pieces[1].path(), "a/large");
  EXPECT_EQ(progress_.front().first, kPiece + 3);
  library_.pieces.clear();
  Begin({static_cast<int64_t>(2 * kPiece + 5), 3});
  ASSERT_TRUE(Upload(Item()).ok());
  EXPECT_THAT(library_.pieces, IsEmpty());
  library_.asked.clear();
  library_.begin = [](v1::BeginUploadResponse* out) {
    out->mutable_item()->set_id("known");
    return grpc::Status::OK;
  };
  EXPECT_EQ(Upload(Item())->id(), "known");
  EXPECT_THAT(library_.asked, IsEmpty());
}

// 9,000 entries of 80 bytes do not fit into one message.
TEST_F(LibraryClientTest, SendsLargeManifestsInParts) {
  LocalItem item;
  for (int i = 0; i < 9000; ++i) {
    v1::ItemFile& file = *item.manifest.add_files();
    file.set_path(absl::StrCat("images/", i));
    file.set_sha256(std::string(64, 'a'));
  }
  library_.begin = [](v1::BeginUploadResponse* out) {
    out->mutable_item()->set_id("known");
    return grpc::Status::OK;
  };
  ASSERT_TRUE(client_.Upload(v1::ITEM_KIND_DUMP, "take", item).ok());
  ASSERT_EQ(library_.manifests.size(), 2u);
  EXPECT_EQ(library_.manifests[0].name(), "take");
  EXPECT_EQ(library_.manifests[1].name(), "");
  EXPECT_LE(library_.manifests[0].ByteSizeLong(), (512u << 10) + 40'000);  // and a few bytes for each entry
  v1::ItemManifest all = library_.manifests[0].manifest();
  all.MergeFrom(library_.manifests[1].manifest());
  EXPECT_EQ(all.SerializeAsString(), item.manifest.SerializeAsString());
}

TEST_F(LibraryClientTest, TriesAgainWhereThatMayHelp) {
  int calls = 0;
  library_.begin = [&](v1::BeginUploadResponse* out) {
    if (++calls == 1) return BrokenOff();
    out->mutable_item()->set_id("known");
    return grpc::Status::OK;
  };
  EXPECT_EQ(Upload(Item())->id(), "known");
  EXPECT_EQ(calls, 2);
  calls = 0;
  library_.begin = [&](v1::BeginUploadResponse*) {
    ++calls;
    return grpc::Status(grpc::StatusCode::FAILED_PRECONDITION, "no room");
  };
  EXPECT_EQ(Upload(Item()).status(), absl::FailedPreconditionError("no room"));
  EXPECT_EQ(calls, 1);
}

TEST_F(LibraryClientTest, FilesThatChangeAreSentOnceMore) {
  Begin({0, 0});
  int calls = 0;
  library_.finish = [&](v1::LibraryItem*) {
    ++calls;
    return grpc::Status(grpc::StatusCode::DATA_LOSS, "small: other bytes");
  };
  EXPECT_EQ(Upload(Item()).status(), absl::DataLossError("small: other bytes; did they change meanwhile?"));
  EXPECT_EQ(calls, 2);
  library_.finish = [&](v1::LibraryItem*) {
    ++calls;
    return grpc::Status(grpc::StatusCode::PERMISSION_DENIED, "not yours");
  };
  calls = 0;
  EXPECT_TRUE(absl::IsPermissionDenied(Upload(Item()).status()));
  EXPECT_EQ(calls, 1);
}

TEST_F(LibraryClientTest, SaysWhatIsWrongWithFilesAndDaemon) {
  Begin({0});
  const absl::Status other = Upload(Item()).status();
  EXPECT_TRUE(absl::IsInternal(other));
  EXPECT_EQ(other.message(), "the daemon at " + daemon_.address() + " counts other files than were named");
  Begin({0, 0});
  const LocalItem item = Item();
  fs::remove(item.paths[1]);
  const absl::Status gone = Upload(item).status();
  EXPECT_TRUE(absl::IsNotFound(gone)) << gone;
  EXPECT_THAT(std::string(gone.message()), HasSubstr("small"));
  EXPECT_THAT(library_.asked, IsEmpty());
}

TEST_F(LibraryClientTest, ListsAllPages) {
  library_.list = [](const v1::ListItemsRequest& request, v1::ListItemsResponse* out) {
    EXPECT_EQ(request.kind(), v1::ITEM_KIND_RIG);
    out->add_items()->set_id(request.page_token() + "1");
    if (request.page_token().empty()) out->set_next_page_token("b");
    return grpc::Status::OK;
  };
  const auto list = client_.List(v1::ITEM_KIND_RIG);
  ASSERT_TRUE(list.ok()) << list.status();
  ASSERT_EQ(list->items_size(), 2);
  EXPECT_EQ(list->items(1).id(), "b1");
  EXPECT_EQ(list->next_page_token(), "");
}

TEST_F(LibraryClientTest, NamesTheItem) {
  EXPECT_EQ(client_.Get(v1::ITEM_KIND_RIG, "studio@2")->kind(), v1::ITEM_KIND_RIG);
  EXPECT_EQ(client_.Delete(v1::ITEM_KIND_DUMP, "take")->item().kind(), v1::ITEM_KIND_DUMP);
  EXPECT_THAT(library_.asked, ElementsAre("get studio@2", "delete take"));
}

TEST_F(LibraryClientTest, FetchesWhatIsNotThere) {
  library_.fetch = [](const v1::FetchFileRequest&, grpc::ServerWriter<v1::FileChunk>* out) {
    out->Write(Chunk("abc", 0, 5, "v1"));
    out->Write(Chunk("de", 3, 5, "v1"));
    return grpc::Status::OK;
  };
  const auto fetch = [&] {
    progress_.clear();
    library_.asked.clear();
    return client_.Fetch(Stored(), folder_ / "out",
                         [this](uint64_t done, uint64_t all) { progress_.emplace_back(done, all); });
  };
  ASSERT_TRUE(fetch().ok());
  EXPECT_EQ(ReadBytes(Out()), "abcde");
  EXPECT_FALSE(fs::exists(Out() + ".partial"));
  EXPECT_THAT(library_.asked, ElementsAre("sha256:f00 deep/file 0 "));
  EXPECT_THAT(progress_, ElementsAre(std::pair<uint64_t, uint64_t>(5, 5)));
  ASSERT_TRUE(fetch().ok());
  EXPECT_THAT(library_.asked, IsEmpty()) << "it is there";
  EXPECT_THAT(progress_, ElementsAre(std::pair<uint64_t, uint64_t>(5, 5)));
  WriteBytes(Out(), "abcdf");
  ASSERT_TRUE(fetch().ok());
  EXPECT_EQ(ReadBytes(Out()), "abcde");
}

TEST_F(LibraryClientTest, AFetchGoesOnWhereItBrokeOffOrWasRefused) {
  library_.fetch = [this](const v1::FetchFileRequest& request, grpc::ServerWriter<v1::FileChunk>* out) {
    if (library_.asked.size() == 1)
      return ToGrpcStatus(
          RetryLater(absl::StatusCode::kResourceExhausted, "busy", std::chrono::milliseconds(1)));
    if (request.offset() == 0) {
      out->Write(Chunk("abc", 0, 5, "v1"));
      return BrokenOff();
    }
    out->Write(Chunk("abc", 0, 5, "v1"));  // not what was asked for
    out->Write(Chunk("de", 3, 5, "v1"));
    return grpc::Status::OK;
  };
  ASSERT_TRUE(client_.Fetch(Stored(), folder_ / "out").ok());
  EXPECT_EQ(ReadBytes(Out()), "abcde");
  EXPECT_THAT(library_.asked,
              ElementsAre("sha256:f00 deep/file 0 ", "sha256:f00 deep/file 0 ", "sha256:f00 deep/file 3 v1"));
}

TEST_F(LibraryClientTest, AFetchLeavesNoFileThatIsWrong) {
  const auto fetch = [&](const std::string& bytes, const grpc::Status& end) {
    library_.fetch = [=](const v1::FetchFileRequest&, grpc::ServerWriter<v1::FileChunk>* out) {
      out->Write(Chunk(bytes, 0, 5, "v1"));
      return end;
    };
    return client_.Fetch(Stored("file"), folder_ / "out");
  };
  const absl::Status other = fetch("abcdX", grpc::Status::OK);
  EXPECT_TRUE(absl::IsDataLoss(other));
  EXPECT_THAT(std::string(other.message()),
              HasSubstr("file: other bytes arrived than the item has; get it again"));
  const absl::Status longer = fetch("abcdef", grpc::Status::OK);
  EXPECT_TRUE(absl::IsDataLoss(longer));
  EXPECT_THAT(std::string(longer.message()), HasSubstr("file: is too long"));
  EXPECT_TRUE(absl::IsPermissionDenied(fetch("ab", {grpc::StatusCode::PERMISSION_DENIED, "not yours"})));
  EXPECT_TRUE(fs::is_empty(folder_ / "out"));
}

TEST_F(LibraryClientTest, WritesNothingOutsideOfTheFolder) {
  for (const char* path : {"../file", "/file", ""}) {
    EXPECT_TRUE(absl::IsInvalidArgument(client_.Fetch(Stored(path), folder_ / "out"))) << path;
  }
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  // A folder on the way may be no link.
  fs::create_directories(folder_ / "elsewhere");
  fs::create_directories(folder_ / "out");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out/deep");
  EXPECT_FALSE(client_.Fetch(Stored(), folder_ / "out").ok());
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
}

}  // namespace
}  // namespace weft
