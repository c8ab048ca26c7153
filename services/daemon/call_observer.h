// Every call from its method's begin to its end.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_interceptor.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/daemon/call_check.h"

namespace weft {

// A call that has ended.
struct ObservedCall {
  Method method;
  std::string outcome;  // "OK", or the category of the error
  std::chrono::duration<double> lasted;
};

// Told of each; called by many threads at once.
using CallEnded = std::function<void(const ObservedCall& call)>;

// Counts the calls that run by their callers, and records those that change something in the audit log.
// `sources` outlive the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> ObserveCalls(
    const CallerSources& sources, CallEnded ended);

// Of a call that was let in, as the audit log names it; empty where it is nobody's (health).
std::string CallerOf(const grpc::ServerContextBase& context, AccessControl& access);

}  // namespace weft
