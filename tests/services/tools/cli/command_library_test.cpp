// weft library: what is asked of a daemon, and what it answers in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include "services/formats/files/rig_file.h"
#include "services/tools/cli/commands.h"
#include "services/work/items/sha256.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Knows whatever is sent, and answers what it was told.
class ToldLibrary final : public v1::Library::Service {
 public:
  std::vector<std::string> asked;
  std::vector<v1::BeginUploadRequest> begun;
  v1::LibraryItem item;
  v1::ListItemsResponse list;
  bool deletes_content = false;

 private:
  using Context = grpc::ServerContext;
  grpc::Status BeginUpload(Context*, grpc::ServerReader<v1::BeginUploadRequest>* in,
                           v1::BeginUploadResponse* out) override {
    for (v1::BeginUploadRequest message; in->Read(&message);) begun.push_back(message);
    *out->mutable_item() = item;
    return grpc::Status::OK;
  }
  grpc::Status ListItems(Context*, const v1::ListItemsRequest* request, v1::ListItemsResponse* out) override {
    asked.push_back("list " + TextOf(*request));
    *out = list;
    return grpc::Status::OK;
  }
  grpc::Status GetItem(Context*, const v1::GetItemRequest* request, v1::LibraryItem* out) override {
    asked.push_back("get " + TextOf(*request));
    *out = item;
    return grpc::Status::OK;
  }
  grpc::Status DeleteItem(Context*, const v1::DeleteItemRequest* request,
                          v1::DeleteItemResponse* out) override {
    asked.push_back("delete " + TextOf(*request));
    out->set_content_deleted(deletes_content);
    return grpc::Status::OK;
  }
  grpc::Status FetchFile(Context*, const v1::FetchFileRequest* request,
                         grpc::ServerWriter<v1::FileChunk>* out) override {
    asked.push_back("fetch " + TextOf(*request));
    out->Write(Chunk("abcde", 0, 5, "v1"));
    return grpc::Status::OK;
  }
};

class CommandLibrary : public ::testing::Test {
 protected:
  CommandLibrary() {
    setenv("TZ", "UTC", 1);
    tzset();
    library_.item = FromText<v1::LibraryItem>(R"(
      id: "f00" kind: ITEM_KIND_RIG bytes: 12345678 file_count: 2
      names { name: "studio" version: 3 created_unix_ns: 1769856300000000000 }
      names { name: "hall" version: 1 created_unix_ns: 1769856301000000000 })");
  }
  AloudRun Library(std::vector<std::string> words) const {
    words.insert(words.begin(), "library");
    words.insert(words.end(), {"--server", daemon_.address()});
    return RunAloud(AddLibraryCommand, std::move(words));
  }

  ToldLibrary library_;
  AnsweringDaemon daemon_{{&library_}};
  const TempFolder folder_;
};

constexpr char kItemText[] =
    "rig             2 files        12.346 MB  sha256:f00  2026-01-31 10:45:00  studio@3\n"
    "rig             2 files        12.346 MB  sha256:f00  2026-01-31 10:45:01  hall@1\n";

TEST_F(CommandLibrary, ListsALineForEachName) {
  *library_.list.add_items() = library_.item;
  *library_.list.add_items() =
      FromText<v1::LibraryItem>(R"(id: "0a" kind: ITEM_KIND_TEMPLATE bytes: 500 file_count: 123)");
  library_.list.add_damaged("0b: its files are gone");
  const AloudRun run = Library({"list"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, std::string(kItemText) + "template      123 files         0.001 MB  sha256:0a\n");
  EXPECT_EQ(run.err, "weft: warning: 0b: its files are gone\n");
  const AloudRun json = Library({"list", "rig", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::ListItemsResponse>(json.out)), TextOf(library_.list));
  EXPECT_EQ(json.err, "");
  library_.list.Clear();
  EXPECT_EQ(Library({"list", "dump"}).out, "no items at " + daemon_.address() + "\n");
  EXPECT_THAT(library_.asked, ElementsAre("list ", "list kind: ITEM_KIND_RIG", "list kind: ITEM_KIND_DUMP"));
}

TEST_F(CommandLibrary, GetShowsAnItemAndCopiesItsFiles) {
  EXPECT_EQ(Library({"get", "rig", "studio@3"}).out, kItemText);
  EXPECT_THAT(library_.asked, ElementsAre("get kind: ITEM_KIND_RIG item: \"studio@3\""));
  v1::ItemFile& file = *library_.item.mutable_manifest()->add_files();
  file.set_path("rig.json");
  file.set_bytes(5);
  file.set_sha256(Sha256().Add("abcde").Hex());
  const AloudRun run = Library({"get", "rig", "studio", "--out", folder_ / "rig"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, kItemText);
  EXPECT_EQ(ReadBytes(folder_ / "rig/rig.json"), "abcde");
  EXPECT_EQ(library_.asked[2], "fetch kind: ITEM_KIND_RIG item: \"sha256:f00\" path: \"rig.json\"");
  library_.item.mutable_manifest()->mutable_files(0)->set_sha256(std::string(64, '0'));
  EXPECT_TRUE(absl::IsDataLoss(Library({"get", "rig", "studio", "--out", folder_ / "other"}).status));
  const AloudRun json = Library({"get", "rig", "studio", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::LibraryItem>(json.out)), TextOf(library_.item));
}

TEST_F(CommandLibrary, DeleteTellsWhetherTheContentWent) {
  EXPECT_EQ(Library({"delete", "board", "stripes@1"}).out, "name deleted; other names keep the content\n");
  library_.deletes_content = true;
  EXPECT_EQ(Library({"delete", "board", "stripes@2"}).out, "deleted\n");
  EXPECT_THAT(library_.asked, ElementsAre("delete kind: ITEM_KIND_BOARD item: \"stripes@1\"",
                                          "delete kind: ITEM_KIND_BOARD item: \"stripes@2\""));
}

TEST_F(CommandLibrary, UploadsUnderTheNameOfThePathOrAnother) {
  Rig rig;
  rig.cameras.resize(1);
  rig.cameras[0].id = "a";
  rig.cameras[0].width_px = rig.cameras[0].height_px = 100;
  rig.cameras[0].fx_px = rig.cameras[0].fy_px = 200;
  ASSERT_TRUE(WriteRig(folder_ / "hall.json", rig).ok());
  const AloudRun run = Library({"upload", "rig", folder_ / "hall.json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, kItemText);
  ASSERT_TRUE(Library({"upload", "rig", folder_ / "hall.json", "--name", "studio"}).status.ok());
  ASSERT_EQ(library_.begun.size(), 2u);
  EXPECT_EQ(library_.begun[0].kind(), v1::ITEM_KIND_RIG);
  EXPECT_EQ(library_.begun[0].name(), "hall");
  EXPECT_EQ(library_.begun[1].name(), "studio");
  ASSERT_EQ(library_.begun[0].manifest().files_size(), 1);
  EXPECT_EQ(library_.begun[0].manifest().files(0).path(), "hall.json");
  EXPECT_EQ(library_.begun[0].manifest().files(0).sha256(),
            Sha256().Add(ReadBytes(folder_ / "hall.json")).Hex());
  EXPECT_EQ(Library({"upload", "rig", folder_ / "none.json"}).status.code(), absl::StatusCode::kNotFound);
}

TEST_F(CommandLibrary, AKindThatIsNoneIsToldBeforeItConnects) {
  const std::vector<std::vector<std::string>> all = {
      {"upload", "hat", "x"}, {"list", "hat"}, {"get", "hat", "x"}, {"delete", "hat", "x"}};
  for (std::vector<std::string> words : all) {
    words.insert(words.begin(), "library");
    words.insert(words.end(), {"--server", "127.0.0.1:1"});
    const AloudRun run = RunAloud(AddLibraryCommand, words);
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument) << words[1];
    EXPECT_THAT(run.message(), HasSubstr("give rig, board, template, dump, avatar or garment"));
  }
}

}  // namespace
}  // namespace weft
