// Uploads: for how much there is room, on the disk and for one caller.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/server/library/uploads.h"
#include "tests/services/server/library/items_on_disk.h"

namespace weft {
namespace {

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

TEST_F(ItemsOnDisk, AreRefusedWhereTheDiskHasNoRoom) {
  v1::BeginUploadRequest request = RequestOf("lab", {{"rig.json", "1"}});
  request.mutable_manifest()->mutable_files(0)->set_bytes(int64_t{1} << 49);
  EXPECT_EQ(uploads_->Begin(request, kAnna).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(CountUploads(), 0u);
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

TEST_F(ItemsOnDisk, LackOfRoomIsToldInBytes) {
  const std::string id = uploads_->Begin(RequestOf("lab", {{"a", "12"}}), kAnna)->upload_id();
  const auto digits = [](const char* pattern) { return ::testing::MatchesRegex(pattern); };
  const auto refused = [&] { return std::string(Write(id, "a", 0, "12").message()); };
  uploads_->SetLeastFree(uint64_t{1} << 60);
  EXPECT_THAT(refused(),
              digits("data: 2 bytes are to come, but .* has [0-9]+ bytes free, of which 1152921504606846976 "
                     "stay free by --least-free-gib; delete items that nobody needs"));
  uploads_->SetLeastFree(1);
  EXPECT_TRUE(Write(id, "a", 0, "1").ok());
  v1::BeginUploadRequest request = RequestOf("big", {{"a", "1"}});
  request.mutable_manifest()->mutable_files(0)->set_bytes(int64_t{1} << 49);
  const Caller stage{"user weft", v1::ROLE_ADMIN};
  EXPECT_THAT(
      std::string(uploads_->Begin(request, stage).status().message()),
      digits(
          "manifest: 5629499534213[0-9]+ bytes are to come, but .* has [0-9]+ bytes free, of which 67108864 "
          "are kept for the list of jobs; delete items that nobody needs"));
  EXPECT_THAT(
      std::string(uploads_->Begin(request, kAnna).status().message()),
      digits(
          "manifest: 562949953421312 bytes are to come, and other unfinished uploads of token 1 .anna. have "
          "2; of the [0-9]+ bytes that .* has for uploads one client may take [0-9]+: finish uploads, or ask "
          "an operator to delete items"));
}

TEST_F(ItemsOnDisk, ThreeQuartersOfTheDiskAreForOneClient) {
  const double free_bytes = static_cast<double>(std::filesystem::space(folder_.path()).available);
  const auto begin = [&](double share) {
    v1::BeginUploadRequest request = RequestOf("lab", {{"a", std::to_string(share)}});
    request.mutable_manifest()->mutable_files(0)->set_bytes(static_cast<int64_t>(share * free_bytes));
    return uploads_->Begin(request, kAnna).status();
  };
  EXPECT_TRUE(absl::IsResourceExhausted(begin(0.85)));
  EXPECT_TRUE(begin(0.65).ok());
}

}  // namespace
}  // namespace weft
