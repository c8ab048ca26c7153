// A daemon with clients of several names, besides the test's own user.
#pragma once

#include <grpcpp/grpcpp.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "services/server/access/access_list.h"
#include "services/tools/client/channel.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "weft/v1/jobs.grpc.pb.h"

namespace weft {

class CallersTest : public DaemonTest {
 protected:
  CallersTest() {
    std::filesystem::create_directories(options_.state_folder);
    for (const char* name : {"anna", "ben"}) AddCaller(name, name, v1::ROLE_CLIENT);
    AddCaller("anna-too", "anna", v1::ROLE_CLIENT);
    AddCaller("stage", "stage", v1::ROLE_OPERATOR);
  }

  // A token of this name in a file that has another one.
  void AddCaller(const std::string& file, const std::string& name, v1::Role role) {
    std::ofstream(folder_ / file)
        << AddToken(AccessListFile(options_.state_folder), {name, role}).value().text;
  }

  std::shared_ptr<grpc::Channel> ChannelOf(const std::string& file) {
    return OpenChannel(daemon_->address(), {folder_ / file, "", "", ""}).value();
  }
  std::unique_ptr<v1::Jobs::Stub> JobsOf(const std::string& file) {
    return v1::Jobs::NewStub(ChannelOf(file));
  }

  grpc::Status SubmitAs(const std::string& file, const v1::SubmitJobRequest& request, v1::Job* job) {
    grpc::ClientContext context;
    return JobsOf(file)->SubmitJob(&context, request, job);
  }
  grpc::Status CancelAs(const std::string& file, const std::string& id) {
    grpc::ClientContext context;
    v1::CancelJobRequest request;
    request.set_job_id(id);
    v1::Job job;
    return JobsOf(file)->CancelJob(&context, request, &job);
  }
};

}  // namespace weft
