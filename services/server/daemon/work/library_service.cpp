#include "services/server/daemon/work/library_service.h"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/callers/fair_share.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/file_stream.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/rpc/page.h"
#include "services/work/items/item_path.h"
#include "services/work/items/manifest.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {
namespace {

void AddDamaged(const std::vector<std::string>& damaged, v1::ListItemsResponse& response) {
  constexpr size_t kMost = 1000;
  const size_t told = std::min(damaged.size(), kMost);
  response.mutable_damaged()->Assign(damaged.begin(), damaged.begin() + static_cast<std::ptrdiff_t>(told));
  if (told < damaged.size()) response.add_damaged(absl::StrCat("and ", damaged.size() - told, " more"));
}

class LibraryService final : public v1::Library::WithCallbackMethod_FetchFile<v1::Library::Service> {
 public:
  LibraryService(JobQueue& queue, OperationQueue& operations, Library& library, Uploads& uploads,
                 FindCaller caller)
      : queue_(queue),
        operations_(operations),
        library_(library),
        uploads_(uploads),
        caller_(std::move(caller)) {}

  grpc::Status BeginUpload(CallContext* context, grpc::ServerReader<v1::BeginUploadRequest>* reader,
                           v1::BeginUploadResponse* response) override {
    return Answer("BeginUpload", [&] {
      return Receive(context, [&](std::optional<StallWatch>& stalls) -> absl::Status {
        v1::BeginUploadRequest request;
        if (!reader->Read(&request)) return absl::InvalidArgumentError("the call has no message");
        size_t bytes = request.ByteSizeLong();
        for (v1::BeginUploadRequest more; reader->Read(&more);) {
          stalls->Moved();
          bytes += more.ByteSizeLong();
          if (bytes > kMaxManifestBytes || request.manifest().files_size() > kMaxItemFiles) {
            return absl::InvalidArgumentError(absl::StrCat("manifest: at most ", kMaxItemFiles, " files and ",
                                                           kMaxManifestBytes, " bytes are allowed"));
          }
          request.mutable_manifest()->MergeFrom(more.manifest());
        }
        stalls.reset();
        return Assign(uploads_.Begin(request, caller_(*context)), response);
      });
    });
  }

  grpc::Status WriteFile(CallContext* context, grpc::ServerReader<v1::WriteFileRequest>* reader,
                         v1::WriteFileResponse* response) override {
    return Answer("WriteFile", [&] {
      return Receive(context, [&](std::optional<StallWatch>& stalls) -> absl::Status {
        UploadWriter writer(uploads_, caller_(*context));
        for (v1::WriteFileRequest piece; reader->Read(&piece);) {
          stalls->Moved();
          WEFT_RETURN_IF_ERROR(writer.Add(piece));
        }
        stalls.reset();
        const absl::StatusOr<int64_t> written = writer.Sync();
        if (written.ok()) response->set_written_bytes(*written);
        return written.status();
      });
    });
  }

  grpc::Status FinishUpload(CallContext* context, const v1::FinishUploadRequest* request,
                            v1::LibraryItem* item) override {
    return Answer("FinishUpload", [&] {
      const absl::Status status = Assign(uploads_.Finish(request->upload_id(), caller_(*context)), item);
      item->clear_manifest();
      return status;
    });
  }

  grpc::Status ListItems(CallContext*, const v1::ListItemsRequest* request,
                         v1::ListItemsResponse* response) override {
    return Answer("ListItems", [&]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(const int limit, LimitOrAll(request->limit()));
      WEFT_RETURN_IF_ERROR(CheckPageToken(request->page_token()));
      WEFT_ASSIGN_OR_RETURN(Library::Listing listing, library_.List(request->kind()));
      std::map<std::string, v1::LibraryItem> items;
      for (v1::LibraryItem& item : listing.items) items[PlaceInList(item)] = std::move(item);
      response->set_next_page_token(AddPage(items, static_cast<size_t>(limit), request->page_token(),
                                            std::identity(), response->mutable_items()));
      if (request->page_token().empty()) AddDamaged(listing.damaged, *response);
      return absl::OkStatus();
    });
  }

  grpc::Status GetItem(CallContext*, const v1::GetItemRequest* request, v1::LibraryItem* item) override {
    return Answer("GetItem", [&] { return Assign(library_.Find(request->kind(), request->item()), item); });
  }

  grpc::ServerWriteReactor<v1::FileChunk>* FetchFile(grpc::CallbackServerContext* context,
                                                     const v1::FetchFileRequest* request) override {
    return SendFile(context, "FetchFile", [&] { return OpenFile(*request); });
  }

  grpc::Status DeleteItem(CallContext*, const v1::DeleteItemRequest* request,
                          v1::DeleteItemResponse* response) override {
    return Answer("DeleteItem", [&]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(Library::Deletion deletion, library_.Delete(request->kind(), request->item(),
                                                                        [this](const v1::LibraryItem& item) {
                                                                          return CheckUnused(item);
                                                                        }));
      *response->mutable_item() = std::move(deletion.item);
      response->set_content_deleted(deletion.content_deleted);
      return absl::OkStatus();
    });
  }

 private:
  // Each has a thread. So many leave enough for the calls that take none for long.
  static constexpr ShareLimits kUploadCalls{.all = 32, .of_one_caller = 8, .reserve = 4};

  // ResourceExhausted: too many run. `receive` reads from the client, tells of each
  // message, and ends the watch before it works for long.
  absl::Status Receive(CallContext* context,
                       const std::function<absl::Status(std::optional<StallWatch>& stalls)>& receive) {
    const Caller caller = caller_(*context);
    {
      const MutexLock lock(counting_);
      WEFT_RETURN_IF_ERROR(upload_calls_.Check(caller));
      upload_calls_.Take(caller.name);
    }
    const absl::Cleanup release = [this, &caller] {
      const MutexLock lock(counting_);
      upload_calls_.Give(caller.name);
    };
    std::optional<StallWatch> stalls(context);
    return receive(stalls);
  }

  absl::StatusOr<FilePieces> OpenFile(const v1::FetchFileRequest& request) {
    if (request.offset() < 0) return absl::InvalidArgumentError("offset: must not be negative");
    WEFT_ASSIGN_OR_RETURN(const HeldItem held, library_.Hold(request.kind(), request.item()));
    if (FindFile(held.item.manifest(), request.path()) == nullptr) {
      return absl::NotFoundError(
          absl::StrCat("path: the item has no file \"", EscapedText(request.path()), "\""));
    }
    WEFT_ASSIGN_OR_RETURN(const auto place, FindPlace(library_.ContentFolder(request.kind(), held.item.id()),
                                                      request.path(), ConfinedFolder::IfMissing::kFail));
    return FilePieces::Open(place.folder, place.name, {request.offset(), request.version()});
  }

  absl::Status CheckUnused(const v1::LibraryItem& item) {
    for (const v1::Job& job : queue_.Unfinished()) {
      const v1::JobItems& used = job.items();
      std::vector<std::string> ids(used.work().begin(), used.work().end());
      ids.insert(ids.end(), {used.dump(), used.rig(), used.board(), used.garment(), used.avatar()});
      for (const std::string& id : ids) {
        if (id != item.id()) continue;
        return absl::FailedPreconditionError(
            absl::StrCat("item ", item.id(), ": job ", job.id(), " uses it; wait for its end, or cancel it"));
      }
    }
    if (operations_.Reads(library_.ContentFolder(item.kind(), item.id()))) {
      return absl::FailedPreconditionError(
          absl::StrCat("item ", item.id(), ": an operation uses it; wait for its end, or cancel it"));
    }
    return absl::OkStatus();
  }

  JobQueue& queue_;
  OperationQueue& operations_;
  Library& library_;
  Uploads& uploads_;
  const FindCaller caller_;
  Mutex counting_;
  FairShare upload_calls_ ABSL_GUARDED_BY(counting_){kUploadCalls, "uploads open"};
};

}  // namespace

std::unique_ptr<grpc::Service> MakeLibraryService(JobQueue& queue, OperationQueue& operations,
                                                  Library& library, Uploads& uploads, FindCaller caller) {
  return std::make_unique<LibraryService>(queue, operations, library, uploads, std::move(caller));
}

}  // namespace weft
