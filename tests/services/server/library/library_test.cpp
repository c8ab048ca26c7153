// Items on the disk: uploads that go on, versions, damage, deletion.
#include "services/server/library/library.h"
#include "base/host_clock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/server/library/uploads.h"
#include "services/work/items/check_item.h"
#include "services/work/items/manifest.h"
#include "services/work/items/sha256.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

const Caller kAnna{"token 1 (anna)", v1::ROLE_CLIENT}, kBen{"token 2 (ben)", v1::ROLE_CLIENT};

absl::Status TakeAny(v1::ItemKind, const v1::ItemManifest&, const std::string&) { return absl::OkStatus(); }

class ItemsOnDisk : public ::testing::Test {
 protected:
  using Files = std::map<std::string, std::string>;

  ItemsOnDisk() { Restart(); }
  void Restart(ItemCheck check = TakeAny) {
    uploads_.reset();
    library_ = Library::Open(folder_.path()).value();
    uploads_ = std::make_unique<Uploads>(*library_, folder_.path(), std::move(check));
  }

  // How many were.
  int AbandonAll() {
    int abandoned = 0;
    for (const Uploads::Unfinished& one : uploads_->ListUnfinished())
      abandoned += uploads_->Abandon(one.upload_id, one.last_piece_unix_ns).ok() ? 1 : 0;
    return abandoned;
  }

  static v1::BeginUploadRequest RequestOf(const std::string& name, const Files& files) {
    v1::BeginUploadRequest request;
    request.set_kind(v1::ITEM_KIND_RIG);
    request.set_name(name);
    for (const auto& [path, bytes] : files) {
      v1::ItemFile& file = *request.mutable_manifest()->add_files();
      file.set_path(path);
      file.set_bytes(static_cast<int64_t>(bytes.size()));
      file.set_sha256(Sha256().Add(bytes).Hex());
    }
    return request;
  }

  absl::Status Write(const std::string& upload, const std::string& path, int64_t offset,
                     const std::string& data) {
    UploadWriter writer(*uploads_, kAnna);
    v1::WriteFileRequest piece;
    piece.set_upload_id(upload);
    piece.set_path(path);
    piece.set_offset(offset);
    piece.set_data(data);
    absl::Status status = writer.Add(piece);
    status.Update(writer.Sync().status());
    return status;
  }

  absl::StatusOr<v1::LibraryItem> Upload(const std::string& name, const Files& files) {
    const auto begun = uploads_->Begin(RequestOf(name, files), kAnna);
    if (!begun.ok()) return begun.status();
    if (begun->has_item()) return begun->item();
    for (const auto& [path, bytes] : files) {
      if (bytes.empty()) continue;
      if (absl::Status status = Write(begun->upload_id(), path, 0, bytes); !status.ok()) return status;
    }
    return uploads_->Finish(begun->upload_id(), kAnna);
  }

  absl::StatusOr<Library::Deletion> Delete(const std::string& item) {
    return library_->Delete(v1::ITEM_KIND_RIG, item, [](const auto&) { return absl::OkStatus(); });
  }
  std::string FindId(const std::string& item) {
    const auto found = library_->Find(v1::ITEM_KIND_RIG, item);
    return found.ok() ? found->id() : found.status().ToString();
  }
  size_t CountUploads() {
    const std::filesystem::directory_iterator uploads(folder_ / "uploads");
    return static_cast<size_t>(std::distance(begin(uploads), end(uploads)));
  }

  TempFolder folder_;
  std::unique_ptr<Library> library_;
  std::unique_ptr<Uploads> uploads_;
};

TEST_F(ItemsOnDisk, AreThereAfterARestart) {
  const auto item = Upload("lab", {{"rig.json", "{}"}, {"more/empty", ""}});
  ASSERT_TRUE(item.ok()) << item.status();
  Restart();
  EXPECT_EQ(FindId("lab"), item->id());
  const auto held = library_->Hold(v1::ITEM_KIND_RIG, "lab");
  ASSERT_TRUE(held.ok()) << held.status();
  EXPECT_EQ(ReadBytes(held->path + "/rig.json"), "{}");
  EXPECT_EQ(CountUploads(), 0u);
}

TEST_F(ItemsOnDisk, UploadsAreTheirOwners) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "12"}});
  const std::string annas = uploads_->Begin(request, kAnna)->upload_id();
  ASSERT_TRUE(Write(annas, "rig.json", 0, "1").ok());
  // Ben sends the same: an upload of his own, from its beginning.
  const auto bens = uploads_->Begin(request, kBen);
  EXPECT_NE(bens->upload_id(), annas);
  EXPECT_EQ(bens->received_bytes(0), 0);
  EXPECT_TRUE(absl::IsPermissionDenied(uploads_->Finish(annas, kBen).status()));
  UploadWriter writer(*uploads_, kBen);
  v1::WriteFileRequest piece;
  piece.set_upload_id(annas);
  piece.set_path("rig.json");
  piece.set_offset(1);
  piece.set_data("x");
  EXPECT_TRUE(absl::IsPermissionDenied(writer.Add(piece)));
  // Another token of anna's goes on, also with the next daemon.
  Restart();
  const Caller anna{"token 9 (anna)", v1::ROLE_CLIENT};
  EXPECT_EQ(uploads_->Begin(request, anna)->received_bytes(0), 1);
  ASSERT_TRUE(Write(annas, "rig.json", 1, "2").ok());
  EXPECT_TRUE(uploads_->Finish(annas, anna).ok());
}

TEST_F(ItemsOnDisk, UnfinishedUploadsOfOneCallerAreFew) {
  int begun = 0;
  absl::Status refused;
  while (begun < 1000 && refused.ok()) {
    refused = uploads_->Begin(RequestOf("n" + std::to_string(begun), {{"a", std::to_string(begun)}}), kBen)
                  .status();
    begun += refused.ok() ? 1 : 0;
  }
  EXPECT_EQ(begun, 200);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  // They count for the next daemon as well; what was begun may go on.
  Restart();
  EXPECT_FALSE(uploads_->Begin(RequestOf("one-more", {{"a", "x"}}), kBen).ok());
  EXPECT_TRUE(uploads_->Begin(RequestOf("n7", {{"a", "7"}}), kBen).ok());
  EXPECT_TRUE(uploads_->Begin(RequestOf("annas", {{"a", "x"}}), kAnna).ok());
  EXPECT_GT(AbandonAll(), 0);
  EXPECT_TRUE(uploads_->Begin(RequestOf("one-more", {{"a", "x"}}), kBen).ok());
}

TEST_F(ItemsOnDisk, OneClientLeavesPartOfTheDisk) {
  const auto free_bytes = static_cast<int64_t>(std::filesystem::space(folder_.path()).available);
  const auto of_size = [](const std::string& name, int64_t bytes) {
    v1::BeginUploadRequest request = RequestOf(name, {{"a", name}});
    request.mutable_manifest()->mutable_files(0)->set_bytes(bytes);
    return request;
  };
  EXPECT_TRUE(uploads_->Begin(of_size("half", free_bytes / 2), kAnna).ok());
  const absl::Status refused = uploads_->Begin(of_size("more", free_bytes / 2), kAnna).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_TRUE(uploads_->Begin(of_size("bens", free_bytes / 5), kBen).ok());
  EXPECT_TRUE(uploads_->Begin(of_size("more", free_bytes / 5), {"user weft", v1::ROLE_ADMIN}).ok());
}

TEST_F(ItemsOnDisk, HaveVersionsByContent) {
  const std::string first = Upload("lab", {{"rig.json", "1"}}).value().id();
  const std::string second = Upload("lab", {{"rig.json", "2"}}).value().id();
  EXPECT_EQ(Upload("lab", {{"rig.json", "1"}}).value().names_size(), 1);
  EXPECT_EQ(FindId("lab"), second);
  EXPECT_EQ(FindId("lab@1"), first);
  EXPECT_EQ(FindId("sha256:" + first), first);
  EXPECT_THAT(FindId("lab@3"), HasSubstr("lab@1, lab@2"));
  EXPECT_EQ(Upload("hall", {{"rig.json", "1"}}).value().id(), first);
  EXPECT_FALSE(Delete("lab@1").value().content_deleted);
  EXPECT_EQ(FindId("hall"), first);
  EXPECT_TRUE(Delete("hall").value().content_deleted);
  EXPECT_THAT(FindId("hall"), HasSubstr("no rig \"hall\""));
}

TEST_F(ItemsOnDisk, GoOnWhereAnUploadBrokeOff) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "0123456789"}});
  const std::string id = uploads_->Begin(request, kAnna).value().upload_id();
  ASSERT_TRUE(Write(id, "rig.json", 0, "0123").ok());
  Restart();
  const auto again = uploads_->Begin(request, kAnna);
  EXPECT_EQ(again->upload_id(), id);
  EXPECT_EQ(again->received_bytes(0), 4);
  EXPECT_EQ(uploads_->Finish(id, kAnna).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(Write(id, "rig.json", 3, "3").code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(Write(id, "rig.json", 4, "4567890").code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(Write(id, "other.json", 0, "4").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Write(id, "../upload.json", 0, "4").code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(Write(id, "rig.json", 4, "456789").ok());
  EXPECT_TRUE(uploads_->Finish(id, kAnna).ok());
}

TEST_F(ItemsOnDisk, DropFilesWithOtherBytesThanDeclared) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "good"}});
  const std::string id = uploads_->Begin(request, kAnna).value().upload_id();
  ASSERT_TRUE(Write(id, "rig.json", 0, "evil").ok());
  EXPECT_EQ(uploads_->Finish(id, kAnna).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(uploads_->Begin(request, kAnna).value().received_bytes(0), 0);
  ASSERT_TRUE(Write(id, "rig.json", 0, "good").ok());
  EXPECT_TRUE(uploads_->Finish(id, kAnna).ok());
}

TEST_F(ItemsOnDisk, AreReadAsJobsReadThem) {
  Restart(CheckItemContent);
  const absl::Status status = Upload("lab", {{"rig.json", "{\"cameras\": 3}"}}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("rig.json"));
  EXPECT_THAT(std::string(status.message()), HasSubstr("cameras"));
  EXPECT_EQ(CountUploads(), 0u);
}

TEST_F(ItemsOnDisk, ThatAreDamagedHideNoOther) {
  const std::string good = Upload("good", {{"rig.json", "1"}}).value().id();
  const std::string bad = Upload("bad", {{"rig.json", "2"}}).value().id();
  WriteBytes(folder_ / ("library/rig/" + bad + "/item.json"), "{");
  const auto listing = library_->List(v1::ITEM_KIND_UNSPECIFIED);
  ASSERT_EQ(listing->items.size(), 1u);
  EXPECT_EQ(listing->items[0].id(), good);
  ASSERT_EQ(listing->damaged.size(), 1u);
  EXPECT_THAT(listing->damaged[0], HasSubstr(bad));
  EXPECT_EQ(Upload("bad", {{"rig.json", "2"}}).value().id(), bad);
  std::filesystem::remove(folder_ / ("library/rig/" + bad + "/content/rig.json"));
  EXPECT_EQ(library_->Hold(v1::ITEM_KIND_RIG, "bad").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(Upload("bad", {{"rig.json", "2"}}).value().id(), bad);
  EXPECT_TRUE(library_->Hold(v1::ITEM_KIND_RIG, "bad").ok());
}

TEST_F(ItemsOnDisk, AreNotDeletedWhileHeld) {
  ASSERT_TRUE(Upload("lab", {{"rig.json", "1"}}).ok());
  auto held = library_->Hold(v1::ITEM_KIND_RIG, "lab");
  EXPECT_EQ(Delete("lab").status().code(), absl::StatusCode::kFailedPrecondition);
  held = absl::UnknownError("");
  EXPECT_TRUE(Delete("lab").ok());
}

TEST_F(ItemsOnDisk, AreRefusedWhereTheDiskHasNoRoom) {
  v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "1"}});
  request.mutable_manifest()->mutable_files(0)->set_bytes(int64_t{1} << 49);
  EXPECT_EQ(uploads_->Begin(request, kAnna).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(CountUploads(), 0u);
}

TEST_F(ItemsOnDisk, OfUploadsThatAreGoingOnAreNotRemoved) {
  const std::string id = uploads_->Begin(RequestOf("lab", {{"rig.json", "12"}}), kAnna).value().upload_id();
  {
    UploadWriter writer(*uploads_, kAnna);
    v1::WriteFileRequest piece;
    piece.set_upload_id(id);
    piece.set_path("rig.json");
    piece.set_data("1");
    ASSERT_TRUE(writer.Add(piece).ok());
    EXPECT_EQ(AbandonAll(), 0);
    EXPECT_EQ(CountUploads(), 1u);
    ASSERT_TRUE(writer.Sync().ok());
  }
  ASSERT_TRUE(Write(id, "rig.json", 1, "2").ok());
  ASSERT_TRUE(uploads_->Finish(id, kAnna).ok());
  EXPECT_EQ(AbandonAll(), 0);
  EXPECT_TRUE(library_->Hold(v1::ITEM_KIND_RIG, "lab").ok());
}

TEST_F(ItemsOnDisk, ThatAnotherClientFinishedAreThere) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "1"}});
  const std::string id = uploads_->Begin(request, kAnna).value().upload_id();
  ASSERT_TRUE(Write(id, "rig.json", 0, "1").ok());
  ASSERT_TRUE(uploads_->Finish(id, kAnna).ok());
  EXPECT_EQ(uploads_->Finish(id, kAnna).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Write(id, "rig.json", 1, "1").code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(uploads_->Begin(request, kAnna).value().has_item());
}

TEST_F(ItemsOnDisk, AreRemovedWhenTheirUploadIsAbandoned) {
  const std::string id = uploads_->Begin(RequestOf("lab", {{"rig.json", "12"}}), kAnna).value().upload_id();
  ASSERT_TRUE(Write(id, "rig.json", 0, "1").ok());
  // A clock that jumps removes nothing by itself.
  const std::string upload = folder_ / ("uploads/" + id + "/upload.json");
  std::filesystem::last_write_time(
      upload, std::filesystem::file_time_type::clock::now() - std::chrono::hours(400 * 24));
  Restart();
  const std::vector<Uploads::Unfinished> unfinished = uploads_->ListUnfinished();
  ASSERT_EQ(unfinished.size(), 1u);
  EXPECT_EQ(unfinished[0].upload_id, id);
  EXPECT_GE(unfinished[0].bytes, 1u);
  EXPECT_LT(unfinished[0].last_piece_unix_ns, HostTime_ns() - int64_t{399} * 24 * 3600 * 1'000'000'000);
  // A piece that comes in between keeps it.
  ASSERT_TRUE(Write(id, "rig.json", 1, "2").ok());
  EXPECT_EQ(uploads_->Abandon(id, unfinished[0].last_piece_unix_ns).code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(AbandonAll(), 1);
  EXPECT_EQ(CountUploads(), 0u);
  EXPECT_EQ(Write(id, "rig.json", 0, "1").code(), absl::StatusCode::kNotFound);
}

TEST_F(ItemsOnDisk, LeaveTheRoomThatShallStayFree) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "12"}});
  const std::string id = uploads_->Begin(request, kAnna).value().upload_id();
  ASSERT_TRUE(Write(id, "rig.json", 0, "1").ok());
  uploads_->SetLeastFree(uint64_t{1} << 60);
  EXPECT_EQ(Write(id, "rig.json", 1, "2").code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(uploads_->Begin(request, kAnna).status().code(), absl::StatusCode::kResourceExhausted);
  uploads_->SetLeastFree(0);
  EXPECT_TRUE(Write(id, "rig.json", 1, "2").ok());
  EXPECT_TRUE(uploads_->Finish(id, kAnna).ok());
}

// Each would have room alone.
TEST_F(ItemsOnDisk, ThatAreOnTheirWayTogetherNeedRoomTogether) {
  const int64_t free_bytes =
      static_cast<int64_t>(std::filesystem::space(std::string(folder_ / "")).available);
  const auto begin = [&](const std::string& name, int64_t bytes) {
    v1::BeginUploadRequest request = RequestOf(name, {{"rig.json", name}});
    request.mutable_manifest()->mutable_files(0)->set_bytes(bytes);
    return uploads_->Begin(request, kAnna).status().code();
  };
  EXPECT_EQ(begin("a", free_bytes / 3 * 2), absl::StatusCode::kOk);
  EXPECT_EQ(begin("b", free_bytes / 3 * 2), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(begin("a", free_bytes / 3 * 2), absl::StatusCode::kOk);  // goes on
}

TEST_F(ItemsOnDisk, FollowNoLinksThatStandInTheWay) {
  const std::string id = uploads_->Begin(RequestOf("lab", {{"a/rig.json", "1"}}), kAnna).value().upload_id();
  std::filesystem::create_directory(folder_ / "elsewhere");
  std::filesystem::create_symlink(folder_ / "elsewhere", folder_ / ("uploads/" + id + "/content/a"));
  EXPECT_FALSE(Write(id, "a/rig.json", 0, "1").ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "elsewhere"));
}

}  // namespace
}  // namespace weft
