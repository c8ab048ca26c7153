// What every call of a daemon shares: patience, repetition, words.
#pragma once

#include <grpcpp/client_context.h>

#include <chrono>
#include <thread>

#include "absl/status/statusor.h"
#include "services/client/registration_client.h"

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

// Calls `call(context, &answer)`, and again while no daemon answers: only for calls that may be made twice.
// Errors of RegistrationClient.
template <typename Answer, typename Call>
absl::StatusOr<Answer> CallDaemon(const RegistrationClient& connection, Call call,
                                  std::chrono::milliseconds patience = std::chrono::seconds(60)) {
  for (Pauses pauses;;) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience);
    Answer answer;
    const grpc::Status status = call(&context, &answer);
    if (status.ok()) return answer;
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE || !pauses.Next())
      return connection.Explain(status);
  }
}

}  // namespace weft
