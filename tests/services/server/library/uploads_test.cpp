// Items on their way: uploads that go on, share the disk, and are finished or abandoned.
#include "services/server/library/uploads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/formats/files/json_file.h"
#include "services/work/items/check_item.h"
#include "tests/services/server/library/items_on_disk.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

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

TEST_F(ItemsOnDisk, FollowNoLinksThatStandInTheWay) {
  const std::string id = uploads_->Begin(RequestOf("lab", {{"a/rig.json", "1"}}), kAnna).value().upload_id();
  std::filesystem::create_directory(folder_ / "elsewhere");
  std::filesystem::create_symlink(folder_ / "elsewhere", folder_ / ("uploads/" + id + "/content/a"));
  EXPECT_FALSE(Write(id, "a/rig.json", 0, "1").ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "elsewhere"));
}

v1::WriteFileRequest PieceOf(const std::string& upload, const std::string& path, int64_t offset,
                             const std::string& data) {
  v1::WriteFileRequest piece;
  piece.set_upload_id(upload);
  piece.set_path(path);
  piece.set_offset(offset);
  piece.set_data(data);
  return piece;
}

// By sha256sum: of the manifest with "12" as rig.json, and of the lines rig, lab, that one and "token anna".
constexpr char kItemId[] = "67dc88175ef6b24b2a5db1106e5c10432b31557ac19405c9f94660f4a3acae10";
constexpr char kAnnasId[] = "7b003db2106ddc3bd3aa1385fa006cafff944f85af69407a960e51cc80d8d2b7";
// The same without the last one, as a version without owners named it.
constexpr char kOldId[] = "9736eb7d7bba101377d025939c13beb07dcf1ea3c083a85d5cf35a22ab67724f";

TEST_F(ItemsOnDisk, UploadsSayWhatIsThere) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"a", "123"}, {"b", ""}, {"c/d", "45"}});
  const std::string id = uploads_->Begin(request, kAnna)->upload_id();
  ASSERT_TRUE(Write(id, "c/d", 0, "4").ok());
  ASSERT_TRUE(Write(id, "a", 0, "123").ok());
  EXPECT_THAT(uploads_->Begin(request, kAnna)->received_bytes(), ElementsAre(3, 0, 1));
  v1::ItemUpload what;
  ASSERT_TRUE(ReadJsonFile(folder_ / ("uploads/" + id + "/upload.json"), what).ok());
  EXPECT_EQ(what.begun_by(), "token 1 (anna)");
  EXPECT_EQ(what.name(), "lab");
  EXPECT_EQ(what.kind(), v1::ITEM_KIND_RIG);
  EXPECT_EQ(what.manifest().DebugString(), request.manifest().DebugString());
  ASSERT_TRUE(Write(id, "c/d", 1, "5").ok());
  ASSERT_TRUE(uploads_->Finish(id, kAnna).ok());
  const auto known = uploads_->Begin(request, kBen);
  EXPECT_EQ(known->item().names(0).name(), "lab");
  EXPECT_FALSE(known->item().has_manifest());
  EXPECT_EQ(known->upload_id(), "");
}

TEST_F(ItemsOnDisk, OnlyWhatCanBeAnItemIsUploaded) {
  v1::BeginUploadRequest request = RequestOf("lab", {{"a", "1"}});
  request.set_kind(v1::ITEM_KIND_UNSPECIFIED);
  EXPECT_TRUE(absl::IsInvalidArgument(uploads_->Begin(request, kAnna).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(uploads_->Begin(RequestOf("a/b", {{"a", "1"}}), kAnna).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(uploads_->Begin(RequestOf("lab", {}), kAnna).status()));
  EXPECT_EQ(CountUploads(), 0u);
}

TEST_F(ItemsOnDisk, PiecesSayWhatIsWrongWithThem) {
  const std::string id =
      uploads_->Begin(RequestOf("lab", {{"a", "0123456789"}, {"b", "1"}}), kAnna)->upload_id();
  const std::string other = uploads_->Begin(RequestOf("hall", {{"a", "1"}}), kAnna)->upload_id();
  const auto error_of = [this](std::vector<v1::WriteFileRequest> pieces) {
    UploadWriter writer(*uploads_, kAnna);
    absl::Status status;
    for (const v1::WriteFileRequest& piece : pieces) status = writer.Add(piece);
    return status;
  };
  EXPECT_EQ(error_of({PieceOf("", "a", 0, "0")}), absl::InvalidArgumentError("upload_id: must not be empty"));
  EXPECT_EQ(error_of({PieceOf("x", "a", 0, "0")}),
            absl::InvalidArgumentError("upload_id: must be one of BeginUpload"));
  EXPECT_EQ(error_of({PieceOf(std::string(64, 'a'), "a", 0, "0")}),
            absl::NotFoundError("upload_id: there is no upload " + std::string(64, 'a') +
                                "; is it finished, or was it abandoned?"));
  EXPECT_EQ(error_of({PieceOf(id, "", 0, "0")}), absl::InvalidArgumentError("path: must not be empty"));
  EXPECT_EQ(error_of({PieceOf(id, "c", 0, "0")}),
            absl::NotFoundError("path: the manifest has no file \"c\""));
  EXPECT_EQ(error_of({PieceOf(id, "a", 0, "0123"), PieceOf(other, "a", 4, "4")}),
            absl::InvalidArgumentError("upload_id: all pieces of a call are of one upload"));
  EXPECT_EQ(error_of({PieceOf(id, "a", 3, "3")}),
            absl::OutOfRangeError("\"a\": 1 bytes at 3, but 4 of 10 bytes are there"));
  EXPECT_EQ(error_of({PieceOf(id, "a", 4, "4567890")}),
            absl::OutOfRangeError("\"a\": 7 bytes at 4, but 4 of 10 bytes are there"));
  EXPECT_TRUE(error_of({PieceOf(id, "a", 4, "4"), PieceOf("", "", 5, "56"), PieceOf(id, "b", 0, "1"),
                        PieceOf(id, "a", 7, "789")})
                  .ok());
  EXPECT_TRUE(uploads_->Finish(id, kAnna).ok());
}

TEST_F(ItemsOnDisk, PiecesAreHalfAMebibyteAtMost) {
  const std::string half(512 << 10, 'h'),
      id = uploads_->Begin(RequestOf("lab", {{"a", half}, {"b", "x"}}), kAnna)->upload_id();
  UploadWriter writer(*uploads_, kAnna);
  EXPECT_EQ(writer.Add(PieceOf(id, "a", 0, half + "h")),
            absl::InvalidArgumentError("data: at most 524288 bytes in a piece"));
  EXPECT_EQ(writer.Sync().value(), 0);
  ASSERT_TRUE(writer.Add(PieceOf("", "a", 0, half)).ok());
  ASSERT_TRUE(writer.Add(PieceOf("", "b", 0, "x")).ok());
  EXPECT_EQ(writer.Sync().value(), (512 << 10) + 1) << "of the whole call";
}

TEST_F(ItemsOnDisk, WhatIsMissingIsNamed) {
  const std::string id =
      uploads_->Begin(RequestOf("lab", {{"a", "12"}, {"b", "34"}, {"c", "56"}, {"d/e", ""}}), kAnna)
          ->upload_id();
  const auto finish = [&] { return uploads_->Finish(id, kAnna).status(); };
  EXPECT_EQ(finish(), absl::FailedPreconditionError("\"a\": 0 of 2 bytes are there; upload the rest"));
  ASSERT_TRUE(Write(id, "a", 0, "xx").ok());
  ASSERT_TRUE(Write(id, "b", 0, "34").ok());
  ASSERT_TRUE(Write(id, "c", 0, "5").ok());
  EXPECT_EQ(finish(), absl::FailedPreconditionError("\"c\": 1 of 2 bytes are there; upload the rest"));
  ASSERT_TRUE(Write(id, "a", 0, "xx").ok()) << "the wrong ones were dropped";
  ASSERT_TRUE(Write(id, "c", 1, "7").ok());
  EXPECT_EQ(finish(),
            absl::DataLossError("bytes other than declared in a, c; they were dropped, upload them again"));
  ASSERT_TRUE(Write(id, "a", 0, "12").ok());
  ASSERT_TRUE(Write(id, "c", 0, "56").ok());
  EXPECT_TRUE(finish().ok());
  EXPECT_EQ(ReadBytes(library_->Hold(v1::ITEM_KIND_RIG, "lab")->path + "/b"), "34");
}

TEST_F(ItemsOnDisk, UploadsOfAVersionWithoutOwnersGoOn) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "12"}});
  ASSERT_EQ(uploads_->Begin(request, kAnna)->upload_id(), kAnnasId);
  const std::string annas = folder_ / absl::StrCat("uploads/", kAnnasId),
                    old = folder_ / absl::StrCat("uploads/", kOldId);
  ASSERT_TRUE(Write(kAnnasId, "rig.json", 0, "1").ok());
  // As such a version would have left it.
  v1::ItemUpload what;
  ASSERT_TRUE(ReadJsonFile(annas + "/upload.json", what).ok());
  std::filesystem::rename(annas, old);
  Restart();
  EXPECT_EQ(uploads_->Begin(request, kAnna)->received_bytes(0), 0) << "it is somebody's";
  EXPECT_EQ(AbandonAll(), 2);
  what.clear_begun_by();
  WriteBytes(old + "/content/rig.json", "1");
  ASSERT_TRUE(WriteJsonFile(old + "/upload.json", what).ok());
  Restart();
  EXPECT_EQ(uploads_->Begin(request, kAnna)->received_bytes(0), 1);
  EXPECT_FALSE(std::filesystem::exists(old));
  ASSERT_TRUE(Write(kAnnasId, "rig.json", 1, "2").ok());
  EXPECT_EQ(uploads_->Finish(kAnnasId, kAnna)->id(), kItemId);
}

TEST_F(ItemsOnDisk, WhatAKillLeftIsRemoved) {
  const std::string id = uploads_->Begin(RequestOf("lab", {{"a", "1"}}), kAnna)->upload_id();
  for (const bool restarts : {true, false}) {
    WriteBytes(folder_ / "uploads/deleted-x/upload.json", "{}");
    WriteBytes(folder_ / ("uploads/" + std::string(64, 'b') + "/content/a"), "1");
    if (restarts) {
      Restart();
    } else {
      ASSERT_TRUE(uploads_->Begin(RequestOf("lab", {{"a", "1"}}), kAnna).ok());
    }
    EXPECT_EQ(CountUploads(), 1u);
    EXPECT_TRUE(std::filesystem::exists(folder_ / ("uploads/" + id)));
  }
}

TEST_F(ItemsOnDisk, UnfinishedUploadsAreCounted) {
  const int64_t before_ns = HostTime_ns();
  const std::string id = uploads_->Begin(RequestOf("lab", {{"a", "123"}, {"b", "45"}}), kAnna)->upload_id();
  ASSERT_TRUE(Write(id, "a", 0, std::string("123")).ok());
  WriteBytes(folder_ / "uploads/other/upload.json", "{}");
  const std::vector<Uploads::Unfinished> unfinished = uploads_->ListUnfinished();
  ASSERT_EQ(unfinished.size(), 1u);
  EXPECT_EQ(unfinished[0].upload_id, id);
  const size_t of_description = ReadBytes(folder_ / ("uploads/" + id + "/upload.json")).size();
  EXPECT_GE(unfinished[0].bytes, of_description + 3);
  // The clock of files is coarser.
  EXPECT_GE(unfinished[0].last_piece_unix_ns, before_ns - 20'000'000);
  EXPECT_LE(unfinished[0].last_piece_unix_ns, HostTime_ns());
  EXPECT_EQ(uploads_->Abandon(id, 7), absl::FailedPreconditionError("more of it came"));
  {
    UploadWriter writer(*uploads_, kAnna);
    ASSERT_TRUE(writer.Add(PieceOf(id, "b", 0, "4")).ok());
    EXPECT_EQ(uploads_->Abandon(id, uploads_->ListUnfinished()[0].last_piece_unix_ns),
              absl::FailedPreconditionError("pieces of it come"));
  }
  EXPECT_TRUE(uploads_->Abandon(id, uploads_->ListUnfinished()[0].last_piece_unix_ns).ok());
  EXPECT_TRUE(uploads_->ListUnfinished().empty());
}

TEST_F(ItemsOnDisk, PiecesThatComeWhileAllIsCheckedAreRefused) {
  const v1::BeginUploadRequest request = RequestOf("lab", {{"a", "1"}});
  std::unique_ptr<UploadWriter> late;
  absl::Status meanwhile;
  Restart([&](v1::ItemKind kind, const v1::ItemManifest& manifest, const std::string& folder) {
    EXPECT_EQ(kind, v1::ITEM_KIND_RIG);
    EXPECT_EQ(manifest.DebugString(), request.manifest().DebugString());
    EXPECT_EQ(ReadBytes(folder + "/a"), "1");
    meanwhile = late->Add(PieceOf("", "a", 1, "2"));
    return absl::OkStatus();
  });
  const std::string id = uploads_->Begin(request, kAnna)->upload_id();
  late = std::make_unique<UploadWriter>(*uploads_, kAnna);
  ASSERT_TRUE(late->Add(PieceOf(id, "a", 0, "1")).ok());
  ASSERT_TRUE(uploads_->Finish(id, kAnna).ok());
  EXPECT_EQ(meanwhile, absl::AbortedError("the upload is being finished"));
  EXPECT_EQ(late->Add(PieceOf("", "a", 1, "2")), absl::AbortedError("the upload is finished"));
}

TEST_F(ItemsOnDisk, OnlyContentThatNeverWillBeIsDropped) {
  absl::Status verdict = absl::UnavailableError("the disk is away");
  Restart([&](v1::ItemKind, const v1::ItemManifest&, const std::string&) { return verdict; });
  const v1::BeginUploadRequest request = RequestOf("lab", {{"a", "1"}});
  const std::string id = uploads_->Begin(request, kAnna)->upload_id();
  ASSERT_TRUE(Write(id, "a", 0, "1").ok());
  EXPECT_EQ(uploads_->Finish(id, kAnna).status(), verdict);
  EXPECT_EQ(uploads_->Begin(request, kAnna)->received_bytes(0), 1) << "it may be tried again";
  verdict = absl::InvalidArgumentError("no rig");
  EXPECT_EQ(uploads_->Finish(id, kAnna).status(), verdict);
  EXPECT_EQ(CountUploads(), 0u);
  EXPECT_TRUE(absl::IsNotFound(uploads_->Finish(id, kAnna).status()));
  EXPECT_EQ(uploads_->Begin(request, kAnna)->received_bytes(0), 0);
  verdict = absl::OkStatus();
  ASSERT_TRUE(Write(id, "a", 0, "1").ok());
  EXPECT_TRUE(uploads_->Finish(id, {"user weft", v1::ROLE_ADMIN}).ok()) << "operators may";
}

TEST_F(ItemsOnDisk, ThreeAreCheckedAtOnceOfOneCallerOne) {
  std::atomic<int> inside = 0, most = 0, begun = 0;
  Restart([&](v1::ItemKind, const v1::ItemManifest&, const std::string&) {
    const int now = ++inside;
    for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
    }
    ++begun;
    for (int i = 0; i < 5000 && begun < 3; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    --inside;
    return absl::OkStatus();
  });
  const auto finish_all = [&](const std::vector<Caller>& callers) {
    most = 0;
    std::vector<std::jthread> threads;
    for (size_t i = 0; i < callers.size(); ++i) {
      const std::string bytes = absl::StrCat(begun.load(), "-", i);
      const std::string id = uploads_->Begin(RequestOf("lab", {{"a", bytes}}), callers[i])->upload_id();
      UploadWriter writer(*uploads_, callers[i]);
      EXPECT_TRUE(writer.Add(PieceOf(id, "a", 0, bytes)).ok());
      threads.emplace_back([&, i, id] { EXPECT_TRUE(uploads_->Finish(id, callers[i]).ok()); });
    }
    threads.clear();
    return most.load();
  };
  const Caller carl{"token 3 (carl)", v1::ROLE_CLIENT}, dora{"token 4 (dora)", v1::ROLE_CLIENT};
  EXPECT_EQ(finish_all({kAnna, kBen, carl, dora}), 3);
  EXPECT_EQ(finish_all({kAnna, kAnna, kAnna}), 1);
}

}  // namespace
}  // namespace weft
