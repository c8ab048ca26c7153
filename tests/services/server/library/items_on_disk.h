// A library and its uploads in a folder, for tests.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "services/server/library/library.h"
#include "services/server/library/uploads.h"
#include "services/work/items/sha256.h"
#include "tests/capture/temp_folder.h"

namespace weft {

inline const Caller kAnna{"token 1 (anna)", v1::ROLE_CLIENT}, kBen{"token 2 (ben)", v1::ROLE_CLIENT};

inline absl::Status TakeAny(v1::ItemKind, const v1::ItemManifest&, const std::string&) {
  return absl::OkStatus();
}

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

}  // namespace weft
