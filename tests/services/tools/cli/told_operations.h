// A daemon that notes what operations are asked of it, and answers what it was told.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/operations.grpc.pb.h"

namespace weft {

class ToldOperations final : public v1::Operations::Service {
 public:
  std::vector<std::string> asked;
  std::vector<std::string> keys;
  v1::Operation answer;
  std::vector<v1::Operation> watched;
  v1::ListOperationsResponse list;

 private:
  using Context = grpc::ServerContext;
  template <typename Request>
  grpc::Status Answer(const std::string& call, const Request& request, v1::Operation* out) {
    asked.push_back(call + " " + TextOf(request));
    *out = answer;
    return grpc::Status::OK;
  }
  grpc::Status StartOperation(Context*, const v1::StartOperationRequest* request,
                              v1::Operation* out) override {
    keys.push_back(request->idempotency_key());
    return Answer("start", request->spec(), out);
  }
  grpc::Status CancelOperation(Context*, const v1::CancelOperationRequest* request,
                               v1::Operation* out) override {
    return Answer("cancel", *request, out);
  }
  grpc::Status DeleteOperation(Context*, const v1::DeleteOperationRequest* request,
                               v1::Operation* out) override {
    return Answer("delete", *request, out);
  }
  grpc::Status ListOperations(Context*, const v1::ListOperationsRequest* request,
                              v1::ListOperationsResponse* out) override {
    asked.push_back("list " + TextOf(*request));
    *out = list;
    return grpc::Status::OK;
  }
  grpc::Status WatchOperation(Context*, const v1::WatchOperationRequest* request,
                              grpc::ServerWriter<v1::Operation>* out) override {
    asked.push_back("watch " + TextOf(*request));
    for (const v1::Operation& operation : watched) out->Write(operation);
    return grpc::Status::OK;
  }
  grpc::Status ListOperationFiles(Context*, const v1::ListOperationFilesRequest* request,
                                  v1::ListOperationFilesResponse* out) override {
    asked.push_back("files " + request->operation_id());
    out->add_files()->set_path("images/0005/left.png");
    return grpc::Status::OK;
  }
  grpc::Status FetchOperationFile(Context*, const v1::FetchOperationFileRequest*,
                                  grpc::ServerWriter<v1::FileChunk>* out) override {
    out->Write(Chunk("abc", 0, 3, "v1"));
    return grpc::Status::OK;
  }
};

class ToldOperationsTest : public ::testing::Test {
 protected:
  AloudRun Run(AddCommandFunction add, std::vector<std::string> words) const {
    words.insert(words.end(), {"--server", daemon_.address()});
    return RunAloud(add, std::move(words));
  }

  ToldOperations operations_;
  AnsweringDaemon daemon_{{&operations_}};
  const TempFolder folder_;
};

}  // namespace weft
