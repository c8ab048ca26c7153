// Every call from its method's begin to its end.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_interceptor.h>

#include <memory>

#include "services/server/daemon/door/call_check.h"

namespace weft {

// Counts the calls that run by their callers, and records those that change something in the audit log. What
// `sources` names outlives the server.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> ObserveCalls(
    const CallerSources& sources);

// A FindCaller: the caller as the audit log names them.
Caller CallerOf(const grpc::ServerContextBase& context, AccessControl& access);

}  // namespace weft
