// What every call of a daemon shares: patience, repetition, words.
#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/support/sync_stream.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/tools/client/registration_client.h"

namespace weft {

// Between a call that found no daemon and the next one: 0.3, 1, 3 seconds, then no more.
class Pauses {
 public:
  // Waits; false where it is time to give up.
  bool Next() {
    if (next_ > kLast) return false;
    std::this_thread::sleep_for(next_);
    next_ = next_ * 10 / 3;
    return true;
  }

 private:
  static constexpr std::chrono::milliseconds kLast{4000};
  std::chrono::milliseconds next_{300};
};

// How long to wait before a call that a busy daemon refused is made again; none: it does not say when.
// Clients that were refused together come again apart.
std::optional<std::chrono::milliseconds> PauseAfter(const grpc::Status& status);

// Makes `call()` again while a busy daemon says when to, for `patience` in all. Any call may be: one that was
// refused did nothing.
template <typename Call>
grpc::Status CallWhenAdmitted(Call call, std::chrono::milliseconds patience = std::chrono::seconds(60)) {
  const auto give_up = std::chrono::steady_clock::now() + patience;
  for (;;) {
    const grpc::Status status = call();
    const auto pause = PauseAfter(status);
    if (!pause || std::chrono::steady_clock::now() + *pause > give_up) return status;
    std::this_thread::sleep_for(*pause);
  }
}

// A request whose first field says of what it is: an id, or a lease.
template <typename Request>
Request RequestNaming(const std::string& id) {
  Request request;
  request.GetReflection()->SetString(&request, Request::descriptor()->FindFieldByNumber(1), id);
  return request;
}

// A unary method of a service's stub.
template <typename Stub, typename Request, typename Answer>
using DaemonMethod = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Answer*);

// Calls the method once, of what may not be done twice: a busy daemon alone is asked again, since it did
// nothing.
template <typename Stub, typename Request, typename Answer>
grpc::Status CallMethod(Stub& stub, DaemonMethod<Stub, Request, Answer> method, const Request& request,
                        std::chrono::milliseconds patience, Answer* answer) {
  return CallWhenAdmitted([&] {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience);
    return (stub.*method)(&context, request, answer);
  });
}

// The same with errors of RegistrationClient.
template <typename Stub, typename Request, typename Answer>
absl::StatusOr<Answer> CallDaemonOnce(const RegistrationClient& connection, Stub& stub,
                                      DaemonMethod<Stub, Request, Answer> method, const Request& request,
                                      std::chrono::milliseconds patience) {
  Answer answer;
  const grpc::Status status = CallMethod(stub, method, request, patience, &answer);
  if (!status.ok()) return connection.Explain(status);
  return answer;
}

// The same, and again while no daemon answers: only for calls that may be made twice.
template <typename Stub, typename Request, typename Answer>
absl::StatusOr<Answer> CallDaemon(const RegistrationClient& connection, Stub& stub,
                                  DaemonMethod<Stub, Request, Answer> method, const Request& request,
                                  std::chrono::milliseconds patience = std::chrono::seconds(60)) {
  for (Pauses pauses;;) {
    Answer answer;
    const grpc::Status status = CallMethod(stub, method, request, patience, &answer);
    if (status.ok()) return answer;
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE || !pauses.Next())
      return connection.Explain(status);
  }
}

// Reads a stream of messages to its end, with `update` of each. `stop` ends it.
template <typename Message, typename Stub, typename Request>
grpc::Status ReadStream(Stub& stub,
                        std::unique_ptr<grpc::ClientReader<Message>> (Stub::*method)(grpc::ClientContext*,
                                                                                     const Request&),
                        const Request& request, const std::stop_token& stop,
                        const std::function<void(const Message&)>& update) {
  return CallWhenAdmitted([&] {
    grpc::ClientContext context;
    const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
    const auto stream = (stub.*method)(&context, request);
    for (Message message; stream->Read(&message);) update(message);
    return stream->Finish();
  });
}

// The last of a stream's messages, of which `update`, if any, is called with each. Cancelled, "stopped
// watching; WHAT goes on at SERVER": `stop` was requested.
template <typename Message, typename Stub, typename Request>
absl::StatusOr<Message> WatchToEnd(
    const RegistrationClient& connection, Stub& stub,
    std::unique_ptr<grpc::ClientReader<Message>> (Stub::*method)(grpc::ClientContext*, const Request&),
    const Request& request, const std::stop_token& stop, const std::function<void(const Message&)>& update,
    const std::string& what) {
  Message last;
  const std::function<void(const Message&)> keep = [&](const Message& now) {
    last = now;
    if (update) update(now);
  };
  const grpc::Status status = ReadStream(stub, method, request, stop, keep);
  if (status.ok()) return last;
  if (!stop.stop_requested()) return connection.Explain(status);
  return absl::CancelledError(absl::StrCat("stopped watching; ", what, " goes on at ", connection.server()));
}

// The pages of a list as one answer: the first `most` entries, or all where it is 0. `count` tells how many
// an answer has: &v1::ListTakesResponse::takes_size. Errors of CallDaemon.
template <typename Stub, typename Request, typename Answer>
absl::StatusOr<Answer> CallForPages(const RegistrationClient& connection, Stub& stub,
                                    DaemonMethod<Stub, Request, Answer> method, Request request, int most,
                                    int (Answer::*count)() const) {
  Answer all;
  while (true) {
    request.set_limit(most == 0 ? 0 : most - (all.*count)());
    WEFT_ASSIGN_OR_RETURN(const Answer page, CallDaemon(connection, stub, method, request));
    all.MergeFrom(page);
    all.set_next_page_token(page.next_page_token());
    if (page.next_page_token().empty() || (most != 0 && (all.*count)() >= most)) return all;
    request.set_page_token(page.next_page_token());
  }
}

// The client's side of a service, v1::Takes. Errors as those of RegistrationClient. Thread safety: any thread
// may call any function. `connection` must outlive it.
template <typename Service>
class ServiceClient {
 public:
  explicit ServiceClient(const RegistrationClient& connection)
      : connection_(connection), stub_(Service::NewStub(connection.channel())) {}

 protected:
  using Stub = typename Service::Stub;

  template <typename Request, typename Answer>
  absl::StatusOr<Answer> Call(DaemonMethod<Stub, Request, Answer> method, const Request& request) const {
    return CallDaemon(connection_, *stub_, method, request);
  }
  template <typename Request, typename Answer>
  absl::StatusOr<Answer> CallNaming(DaemonMethod<Stub, Request, Answer> method, const std::string& id) const {
    return CallDaemon(connection_, *stub_, method, RequestNaming<Request>(id));
  }

  const RegistrationClient& connection_;
  const std::unique_ptr<Stub> stub_;
};

}  // namespace weft
